"""The commands ``refseq log``: logs of any robot, before anything is learnt."""

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from refseq_bench.scenarios.cli.terminal.console import err, out, print_json
from refseq_bench.scenarios.cli.terminal.options import (
    LOG_KINDS,
    Json,
    LogReading,
    Selection,
    grouped,
    only_one_of,
    option,
    output,
)
from refseq_bench.scenarios.cli.terminal.outputs import LAYOUT, PAGE_TO_WRITE, output_file
from refseq_bench.scenarios.cli.terminal.usage import BenchCommand, group
from refseq_bench.scenarios.drives.inputs import (
    check_beside,
    check_output,
    check_room,
    origin_notes,
    plan_drive,
    thinned_drive,
    writing,
)
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.tables import TextTable, plural, say

if TYPE_CHECKING:
    from refseq.logs import ViewPlan
    from refseq_bench.scenarios.log_tools.checkup import LogCheckup
    from refseq_bench.scenarios.log_tools.rewriting.cutting import KeptStretch

BELOW = 1

app = group("Look at logs of any robot, convert and cut them; `refseq log check FILE` is the first thing to run.")

LOG_HELP = f"Log: {LOG_KINDS}"
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
    from refseq.logs.notes import NOTES
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
        out.print(table)
        for line in one.source.metadata.get(NOTES, "").splitlines():
            say(out, f"  {NOTES}: {line}")
        for key, value in sorted(one.source.metadata.items()):
            if key == NOTES:
                continue
            say(out, f"  {key}: {value if len(value) <= 100 else f'{value[:99]}…'}")


@app.command(
    cls=BenchCommand,
    epilog="""Example: `refseq log layout drive.mcap -o drive-layout.json`

In Foxglove: menu of layouts, *Import from file…*, then open the log itself.""",
)
def layout(log: LogFile, output: Annotated[Path, output_file(LAYOUT, "Layout to write")]) -> None:
    """Write a layout with which Foxglove shows the log: pictures, scans, odometry and truth."""
    from refseq.files import replace_text
    from refseq.logs import open_log
    from refseq.logs.foxglove.layout import foxglove_layout

    check_output(output, of=[log])
    text = foxglove_layout(open_log(log))
    with writing(output):
        replace_text(output, text)
    say(out, f"{output}")


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
    output: Annotated[Path | None, PAGE_TO_WRITE] = None,
    as_json: Json = False,
    selection: Selection = Selection(),
) -> None:
    """Tell what a log serves for: run this first.

    It shows what is taken as what, clocks, pauses, how far the robot goes, and what is missing.
    """
    from refseq_bench.scenarios.log_tools.checkup import check_log
    from refseq_bench.scenarios.log_tools.plain import check_record

    check_output(output, of=[log, *selection.chosen().files])
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


def _print_check(found: "LogCheckup") -> None:
    """Topics, the drive, warnings, and the verdicts last, where a reader's eye is."""
    from refseq_bench.scenarios.log_tools.facts import TOPIC_HEADINGS, facts_of, head_line, topic_row

    table = TextTable(*TOPIC_HEADINGS, title=head_line(found.survey))
    for topic in found.survey.topics:
        table.add_row(*topic_row(topic, found.taken[topic.name]))
    out.print(table)
    for fact in facts_of(found):
        say(out, f"{fact.about:<10} {fact.text}")
    for line in found.warnings:
        say(out, f"{'look at':<10} {line}")
    for one in found.verdicts:
        say(out, "")
        say(out, f"{one.task:<10} {one.usability}: {one.reason}")
        for command in one.commands:
            say(out, f"{'':<10} {command}")


@app.command(
    cls=BenchCommand,
    epilog="""Examples:

* `refseq log drift first.mcap second.mcap`
* `refseq log drift raw.clf --truth poses.csv`""",
)
@grouped
def drift(
    files: Annotated[list[Path], typer.Argument(metavar="LOG", help=LOG_HELP)],
    as_json: Json = False,
    reading: LogReading = LogReading(),
) -> None:
    """Measure how odometry drifts from true poses: a metre, a turn, and by chance."""
    from refseq.logs import open_log
    from refseq_bench.scenarios.log_tools.drift import drift_of
    from refseq_bench.scenarios.log_tools.facts import DRIFT_HEADINGS, drift_row

    if len(files) > 1 and (reading.truth or reading.odometry):
        raise ScenarioError(f"--truth and --odometry belong to one log; valid is one with them, not {len(files)}")
    found = {path: drift_of(plan_drive(open_log(path), reading.chosen()).views, str(path)) for path in files}
    if as_json:
        print_json([{"log": str(path), **asdict(one)} for path, one in found.items()])
        return
    table = TextTable(*DRIFT_HEADINGS)
    for path, one in found.items():
        table.add_row(*drift_row(path.name, one))
    out.print(table)


@app.command(
    cls=BenchCommand,
    epilog="""Examples:

* `refseq log laser real.clf simulated.mcap --thin 2.5`

Walls are straight pieces of 20°. docs/validity.md has real lasers beside ours.""",
)
@grouped
def laser(
    files: Annotated[list[Path], typer.Argument(metavar="LOG", help=LOG_HELP)],
    as_json: Json = False,
    selection: Selection = Selection(),
) -> None:
    """Measure a laser's scans: noise on walls, beams that bring nothing back, edges."""
    from refseq.logs import open_log
    from refseq_bench.scenarios.log_tools.facts import LASER_HEADINGS, laser_row
    from refseq_bench.scenarios.log_tools.scan_statistics import scan_statistics

    found = {}
    for path in files:
        views = thinned_drive(open_log(path), selection.chosen()).recording().views
        found[path] = scan_statistics([view.scan for view in views if view.scan is not None], str(path))
    if as_json:
        print_json([{"log": str(path), **asdict(one)} for path, one in found.items()])
        return
    table = TextTable(*LASER_HEADINGS)
    for path, one in found.items():
        table.add_row(*laser_row(path.name, one))
    out.print(table)


@app.command(
    cls=BenchCommand,
    epilog="""Examples:

* `refseq log convert robot_bag --thin 0.5 -o drive.mcap`
* `refseq log convert drive.mcap --format rosbag2 -o bag`
* `refseq log convert drive.mcap -o odometry.tum`

Views are written, with all their sensors at one time: samples between them are left out. `refseq log cut` copies
messages as they are.""",
)
@grouped
def convert(
    log: LogFile,
    target: Annotated[Path, output("File or folder to write.")],
    form: Annotated[
        str | None,
        option("FORMAT", "mcap, rosbag2, carmen, tum or kitti. [default: by the output's name]", "--format"),
    ] = None,
    selection: Selection = Selection(),
) -> None:
    """Write a log's views in another format: ours (MCAP), a rosbag2 folder, CARMEN, or its poses alone."""
    from refseq.logs import open_log
    from refseq_bench.scenarios.log_tools.rewriting.conversion import LogFormat, format_of
    from refseq_bench.scenarios.log_tools.rewriting.conversion import convert as write

    wanted = format_of(target, form)
    check_beside(log, target)
    if wanted is LogFormat.ROSBAG2:
        check_room(target)
    else:
        check_output(target)
    plan = thinned_drive(open_log(log), selection.chosen())
    notes = {"source": log.name, "source_kind": plan.source.kind, **origin_notes(selection.chosen())}
    with writing(target):
        found = write(plan, target, wanted, notes)
    left = f"; left out: {', '.join(found.left_out)}" if found.left_out else ""
    say(out, f"{target}: {plural(found.views, 'view')} as {wanted}{left}")


@app.command(
    cls=BenchCommand,
    epilog="""Examples:

* `refseq log cut drive.mcap --views 0:160 -o first.mcap`
* `refseq log cut robot_bag --times 60:120 -o minute`
* `refseq log cut drive.clf --distances 0:37 -o first.clf`""",
)
def cut(
    log: LogFile,
    output: Annotated[Path, output("Log to write, of the same kind.")],
    views: Annotated[str | None, option("FROM:TO", "Keep these views, TO not among them.")] = None,
    times: Annotated[str | None, option("FROM:TO", "Keep these seconds since the first view.")] = None,
    distances: Annotated[str | None, option("FROM:TO", "Keep these metres along the path by odometry.")] = None,
) -> None:
    """Keep a stretch of a log: its messages as they are, all topics, in the log's own format."""
    from refseq_bench.scenarios.log_tools.rewriting.cutting import by_distance, by_time, by_views

    only_one_of(views=views, times=times, distances=distances)
    ways = {"views": (views, by_views), "times": (times, by_time), "distances": (distances, by_distance)}
    name, text, way = next(((n, text, way) for n, (text, way) in ways.items() if text is not None), ("", "", None))
    if way is None:
        raise ScenarioError("a stretch is missing; valid is --views, --times or --distances FROM:TO")
    _cut(log, output, lambda plan: way(plan, text), f"{name} {text}")


@app.command(cls=BenchCommand, epilog="Example: `refseq log trim drive.mcap -o moving.mcap`")
def trim(log: LogFile, output: Annotated[Path, output("Log to write, of the same kind.")]) -> None:
    """Drop the standing at the beginning and the end of a log, but for a second of each."""
    from refseq_bench.scenarios.log_tools.rewriting.cutting import without_standing

    _cut(log, output, without_standing, "trimmed")


def _cut(log: Path, output: Path, choose: "Callable[[ViewPlan], KeptStretch]", how: str) -> None:
    from refseq.logs import open_log
    from refseq_bench.scenarios.log_tools.rewriting.copies import check_copy, copy_stretch
    from refseq_bench.scenarios.log_tools.rewriting.cutting import log_span

    check_beside(log, output)
    source = open_log(log)
    check_copy(log, output)
    plan = plan_drive(source)
    kept = choose(plan)
    begin, end = plan.views[0].time, plan.views[-1].time
    notes = {"cut": f"{how} of {log.name}, {kept.first - begin:.3f} to {kept.last - begin:.3f} s"}
    with writing(output):
        messages = copy_stretch(log, output, log_span(plan, kept), notes)
    if not plan.source.complete:
        say(err, f"note: {log} is incomplete ({plan.source.damage}): what lies before is written")
    say(
        out,
        f"{output}: {plural(messages, 'message')}, {kept.views.stop - kept.views.start} of {plural(len(plan), 'view')}"
        f"; dropped {kept.first - begin:.1f} s at the beginning and {end - kept.last:.1f} s at the end",
    )
