"""Options and arguments that several commands take."""

from pathlib import Path
from typing import Annotated

import typer

Chance = Annotated[int, typer.Option(min=0, metavar="N", help="Seed of every random draw of this command.")]
Sensors = Annotated[
    str | None,
    typer.Option(metavar="NAMES", help="Only these, commas between, of camera-1,camera-2,laser. [default: all]"),
]
Views = Annotated[
    str | None, typer.Option(metavar="FROM:TO", help="Only these views of the recording, TO not among them: 0:160.")
]
Thin = Annotated[
    float | None, typer.Option(min=0.0, metavar="METRES", help="Keep one view every so many metres. [default: all]")
]
Noise = Annotated[
    bool,
    typer.Option("--odometry-noise", help="Add noise to the odometry, for logs where it was replaced by mapped poses."),
]
AtLeast = Annotated[
    float | None,
    typer.Option(
        min=0, max=100, metavar="PERCENT", help="Exit 1 if the last stage is right within 1.5 m less often [%]."
    ),
]
MapOrAtlas = Annotated[
    Path, typer.Argument(metavar="MAP", help="Map of the first drive, or atlas of several (.refseq).")
]
