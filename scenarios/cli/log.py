"""The commands ``refseq log info | check``: logs of any robot, before anything is learnt."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from refseq_bench.scenarios.cli.terminal.console import out, print_json
from refseq_bench.scenarios.cli.terminal.options import Json, Selection, grouped, output
from refseq_bench.scenarios.cli.terminal.usage import BenchCommand, group
from refseq_bench.scenarios.drives.inputs import check_output, writing
from refseq_bench.scenarios.tables import TextTable, print_whole, say

if TYPE_CHECKING:
    from refseq_bench.scenarios.log_tools.checkup import Checkup

BELOW = 1

app = group("Look at logs of any robot; `refseq log check FILE` is the first thing to run.")

LOG_HELP = "Log: an MCAP recording, a CARMEN log."
LogFile = Annotated[Path, typer.Argument(metavar="LOG", help=LOG_HELP)]


@app.command(
    cls=BenchCommand,
    epilog="""Examples:

* `refseq log info drive.mcap`
* `refseq log info *.bag --json`""",
)
def info(
    files: Annotated[list[Path], typer.Argument(metavar="LOG", help=LOG_HELP)],
    as_json: Json = False,
) -> None:
    """Tell what is in logs: topics, rates, duration, and how they were made."""
    from refseq.logs import open_log
    from refseq_bench.scenarios.log_tools.facts import INFO_HEADINGS, head_line, info_row
    from refseq_bench.scenarios.log_tools.plain import info_record
    from refseq_bench.scenarios.log_tools.survey import survey

    found = [survey(open_log(path)) for path in files]
    if as_json:
        print_json([info_record(one) for one in found])
        return
    for one in found:
        table = TextTable(*INFO_HEADINGS, title=head_line(one))
        for topic in one.topics:
            table.add_row(*info_row(topic))
        print_whole(out, table)
        for key, value in sorted(one.source.metadata.items()):
            say(out, f"  {key}: {value if len(value) <= 100 else f'{value[:99]}…'}")


@app.command(
    cls=BenchCommand,
    epilog="""Examples:

* `refseq log check drive.mcap`
* `refseq log check robot_bag --thin 0.5 -o check.html`
* `refseq log check drive.bag --topics front=/cam0/image_raw --odometry /odom --truth poses.tum`

Exit code 0: the log can be localised; 1: it cannot; 2: it is no log, or an option does not fit it.""",
)
@grouped
def check(
    log: LogFile,
    output: Annotated[Path | None, output("Page to write (.html).")] = None,
    as_json: Json = False,
    selection: Selection = Selection(),
) -> None:
    """Tell what a log serves for: run this first.

    It shows what is taken as what, clocks, pauses, how far the robot goes, and what is missing.
    """
    from refseq_bench.scenarios.log_tools.checkup import check_log
    from refseq_bench.scenarios.log_tools.plain import check_record

    check_output(output)
    found = check_log(log, selection.chosen())
    if output is not None:
        from refseq_bench.scenarios.log_tools.page import write_checkup

        with writing(output):
            write_checkup(output, found)
    if as_json:
        print_json(check_record(found))
    else:
        _print_check(found)
        if output is not None:
            say(out, f"{output}")
    if not found.usable:
        raise typer.Exit(BELOW)


def _print_check(found: "Checkup") -> None:
    """Topics, the drive, warnings, and the verdicts last, where a reader's eye is."""
    from refseq_bench.scenarios.log_tools.facts import TOPIC_HEADINGS, facts_of, head_line, topic_row

    table = TextTable(*TOPIC_HEADINGS, title=head_line(found.survey))
    for topic in found.survey.topics:
        table.add_row(*topic_row(topic, found.taken[topic.name]))
    print_whole(out, table)
    for fact in facts_of(found):
        say(out, f"{fact.about:<10} {fact.text}")
    for line in found.warnings:
        say(out, f"{'look at':<10} {line}")
    for one in found.verdicts:
        say(out, "")
        say(out, f"{one.task:<10} {one.usability}: {one.reason}")
        for command in one.commands:
            say(out, f"{'':<10} {command}")
