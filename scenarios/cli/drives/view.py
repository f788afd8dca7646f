"""The command ``refseq view``: recordings, maps, and localised drives in the Rerun viewer."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from refseq_bench.scenarios.cli.terminal.console import out
from refseq_bench.scenarios.cli.terminal.options import (
    REFERENCE,
    Screen,
    Selection,
    grouped,
    only_one_of,
    option,
)
from refseq_bench.scenarios.cli.terminal.outputs import SCREENING, output_file
from refseq_bench.scenarios.cli.terminal.screen import in_file, on_screen, rerun_command
from refseq_bench.scenarios.drives.inputs import check_folder, check_output, writing
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.tables import say

if TYPE_CHECKING:
    from refseq_bench.scenarios.drives.viewer_content import ViewerContent

VIEW_HELP = """Examples:

* `refseq view query.mcap`
* `refseq view map.refseq query.mcap beliefs.parquet --reference reference.mcap -o show.rrd`
* `refseq view map.refseq query.mcap best.parquet thesis.parquet --layers show`
* `refseq view map.refseq query.mcap beliefs.parquet --serve 9090`
* `refseq view out/second-door`"""


@grouped
def view(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE",
            help="A recording; a map; map, recording and beliefs (.parquet); a mission's folder; an .rrd.",
        ),
    ],
    output: Annotated[Path | None, output_file(SCREENING, "File for the viewer to write instead")] = None,
    layers: Annotated[
        Path | None,
        option("FOLDER", "Write the drive, and each table's answers, to files of their own instead (.rrd)."),
    ] = None,
    reference: Annotated[Path | None, REFERENCE] = None,
    selection: Selection = Selection(),
    screen: Screen = Screen(),
) -> None:
    """Show a drive, a map, or a localised drive in the Rerun viewer."""
    only_one_of(output=output, layers=layers, connect=screen.connect, serve=screen.serve)
    from refseq_bench.scenarios.drives.viewer_content import read_content

    check_output(output, of=[*files, reference])
    if layers is not None:
        check_folder(layers)
    screen.check(output or layers)
    content = read_content(files, reference, selection.chosen())
    if layers is not None:
        _write_layers(content, layers)
        return
    with in_file(output, content.name) if output is not None else on_screen(content.name, screen) as stream:
        content.send(stream)


def _write_layers(content: "ViewerContent", folder: Path) -> None:
    from refseq.viewer.layers import write_layers

    if content.drive is None or not content.drive.layers:
        raise ScenarioError(
            "--layers: there is no localiser's answer to put beside a drive; valid is map, recording and beliefs "
            "(.parquet), or --output"
        )
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
        paths = write_layers(folder, content.drive, content.tabs, name=content.name)
    say(out, f"{folder}: open any of them together with '{rerun_command(*paths)}'")
