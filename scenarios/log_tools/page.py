"""The page of a checkup: verdicts, the path, pictures and a scan, topics over time, and what to look at."""

from dataclasses import dataclass
from pathlib import Path

from refseq.errors import LogError
from refseq.files import replace_text
from refseq.logs.pairing.plan import ViewPlan
from refseq.view import LASER
from refseq_bench.scenarios.log_tools.checkup import LogCheckup
from refseq_bench.scenarios.log_tools.drawings import TimelineRow, path_drawing, timeline
from refseq_bench.scenarios.log_tools.facts import TOPIC_HEADINGS, facts_of, head_line, topic_row
from refseq_bench.scenarios.log_tools.survey import LogSurvey, pictures_of, scan_of
from refseq_bench.scenarios.log_tools.verdicts import Usability
from refseq_bench.scenarios.report.images import picture, scan_outline
from refseq_bench.scenarios.report.page import PageRow, PageTable, rendered
from refseq_bench.scenarios.report.plots.style import Plot

LOOK = {Usability.WORKS: "passed", Usability.LIMITED: "open", Usability.FAILS: "failed"}
"""Classes of the style sheet, by verdict."""

PICTURES = 4
"""Pictures that are shown of each camera."""


@dataclass(frozen=True)
class CameraRow:
    """Pictures of a camera as data URIs with their times [s] since the log's beginning."""

    name: str
    pictures: tuple[tuple[float, str], ...]


def write_checkup(path: Path, checkup: LogCheckup) -> None:
    """Write the page to ``path``, replacing it in one step."""
    found, plan = checkup.survey, checkup.plan
    page = rendered(
        "log.html.j2",
        title=found.source.path.name,
        head=head_line(found).partition(": ")[2],
        verdicts=[(LOOK[one.usability], one) for one in checkup.verdicts],
        facts=facts_of(checkup),
        warnings=checkup.warnings,
        plan=_paths(checkup),
        cameras=_cameras(found, plan),
        scan=_scan(found, plan),
        timeline=_timeline(checkup),
        other_times=[topic.name for topic in found.other_times],
        topics=PageTable(
            tuple(heading.removeprefix(">") for heading in TOPIC_HEADINGS),
            tuple(PageRow(cells[0], cells[1:]) for cells in _topic_cells(checkup)),
        ),
        metadata=sorted(found.source.metadata.items()),
        skipped=sorted(found.source.skipped.items()),
    )
    replace_text(path, page)


def _topic_cells(checkup: LogCheckup) -> list[tuple[str, ...]]:
    return [topic_row(topic, checkup.taken[topic.name]) for topic in checkup.survey.topics]


def _paths(checkup: LogCheckup) -> Plot | None:
    paths = {"by odometry": checkup.path} if len(checkup.path) > 1 else {}
    if len(checkup.truth) > 1:
        paths["true"] = checkup.truth
    return path_drawing(paths) if paths else None


def _timeline(checkup: LogCheckup) -> Plot | None:
    found = checkup.survey
    rows = [
        TimelineRow(topic.name, topic.timing, not checkup.taken[topic.name].startswith("ignored"), found.zero(topic))
        for topic in found.topics
        if topic.timing.duration == topic.timing.duration
    ]
    ends = [topic.timing.last - found.zero(topic) for topic in found.other_times]
    return timeline(rows, max([found.duration, *ends])) if rows else None


def _cameras(found: LogSurvey, plan: ViewPlan | None) -> list[CameraRow]:
    topics = {topic.name: topic for topic in found.topics}
    rows = []
    for topic, sensor in plan.findings.sensors.items() if plan else ():
        try:
            shown = [(time, picture(one.decode())) for time, one in pictures_of(topics[topic], PICTURES)]
        except LogError:  # the table of topics tells of it
            continue
        if shown:
            rows.append(CameraRow(sensor, tuple((time - found.zero(topics[topic]), uri) for time, uri in shown)))
    return rows


def _scan(found: LogSurvey, plan: ViewPlan | None) -> str:
    """The outline of a scan in the middle of the log; empty without a laser."""
    topics = {sensor: topic for topic, sensor in plan.findings.sensors.items()} if plan else {}
    chosen = next((topic for topic in found.topics if topic.name == topics.get(LASER)), None)
    scan = scan_of(chosen) if chosen else None
    return scan_outline(scan) if scan else ""
