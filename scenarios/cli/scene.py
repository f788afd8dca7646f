"""The commands ``refseq mission scene | look``: cut a scene from a recording, and look for it in another."""

from pathlib import Path
from typing import Annotated

import typer

from refseq_bench.scenarios.cli.mission import BELOW, app
from refseq_bench.scenarios.cli.terminal.console import out
from refseq_bench.scenarios.cli.terminal.options import option
from refseq_bench.scenarios.cli.terminal.outputs import SCENE, output_file
from refseq_bench.scenarios.cli.terminal.usage import BenchCommand
from refseq_bench.scenarios.drives.inputs import check_output, writing
from refseq_bench.scenarios.tables import plural, say

__all__ = ["app"]


@app.command(
    cls=BenchCommand,
    epilog="""Examples:

* `refseq mission scene drive.mcap --along 12.3 --box 200,80,240,200 -o poster.scene`
* `refseq mission scene drive.mcap --along 12.3 --seen-by camera-2 -o window.scene`

Then `refseq mission run MAP "[LI1MT180]" --scene LI1=poster.scene`. Without a box the whole picture is the scene.""",
)
def scene(
    log: Annotated[Path, typer.Argument(metavar="DRIVE", help="Recording to cut it from.")],
    at: Annotated[
        float, option("METRES", "Cut it where the robot was so far along the drive, by odometry.", "--along")
    ],
    output: Annotated[Path, output_file(SCENE, "Scene to write")],
    camera: Annotated[str, option("NAME", "Camera that saw it.", "--seen-by")] = "camera-1",
    box: Annotated[str | None, option("X,Y,WIDTH,HEIGHT", "Part of the picture [pixels]. [default: all of it]")] = None,
) -> None:
    """Cut a scene out of a recording: a landmark that a mission may name."""
    from refseq.scenes import save_scene
    from refseq_bench.scenarios.missions.scenes import cut_from

    check_output(output, of=[log])
    made = cut_from(log, at, camera, box)
    with writing(output):
        save_scene(output, made)
    say(out, f"{output}: {made.box.width} × {made.box.height} pixels of {camera} at {made.along:.1f} m of {log.name}")


@app.command(
    cls=BenchCommand,
    epilog="""Example: `refseq mission look poster.scene evening.mcap`

Exit codes: 0 found; 1 not; 2 bad input.""",
)
def look(
    scene_file: Annotated[Path, typer.Argument(metavar="SCENE", help="Scene (.scene), as `scene` writes it.")],
    log: Annotated[Path, typer.Argument(metavar="DRIVE", help="Recording to look for it in.")],
) -> None:
    """Look for a scene along a recording, and tell where a mission would be at it: try it before a robot does."""
    from refseq.scenes import load_scene
    from refseq_bench.scenarios.missions.scenes import search

    found = search(load_scene(scene_file), log)
    for one in found.seen:
        where = "" if one.left is None else f", {abs(one.left):.1f} m {'ahead' if one.left >= 0 else 'behind'}"
        say(out, f"{one.along:7.1f} m  {one.inliers} keys agree{where}")
    if found.place is None:
        say(out, f"{log}: {scene_file.name} is not found; seen in {len(found.seen)} of {plural(found.views, 'view')}")
        raise typer.Exit(BELOW)
    say(
        out,
        f"{log}: at {scene_file.name} after {found.place:.1f} m; seen in {plural(len(found.seen), 'view')} up to there",
    )
