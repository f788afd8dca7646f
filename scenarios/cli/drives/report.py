"""The command ``refseq report``: a page about a localised drive."""

from pathlib import Path
from typing import Annotated

import typer

from refseq_bench.scenarios.cli.terminal.console import out
from refseq_bench.scenarios.cli.terminal.options import REFERENCE, LogReading, MapFile, QueryFile, grouped
from refseq_bench.scenarios.cli.terminal.outputs import PAGE_TO_WRITE
from refseq_bench.scenarios.drives.inputs import check_output, writing
from refseq_bench.scenarios.drives.learnt_views import read_comparison
from refseq_bench.scenarios.tables import say

REPORT_HELP = "Example: `refseq report map.refseq query.mcap beliefs.parquet --reference reference.mcap -o report.html`"


@grouped
def report(
    map_file: MapFile,
    query: QueryFile,
    beliefs: Annotated[
        Path, typer.Argument(metavar="BELIEFS", help="Beliefs that `refseq localise` wrote (.parquet).")
    ],
    output: Annotated[Path, PAGE_TO_WRITE],
    reference: Annotated[Path | None, REFERENCE] = None,
    reading: LogReading = LogReading(),
) -> None:
    """Write a page about a localised drive.

    It has a plan, heat maps of the posterior, frames, success and cost.
    """
    check_output(output, of=[map_file, query, beliefs, reference])
    comparison = read_comparison(map_file, query, beliefs, reference, reading.chosen())

    from refseq_bench.scenarios.report.document import write_report

    with writing(output):
        write_report(output, [comparison], title=comparison.name)
    say(out, f"{output}")
