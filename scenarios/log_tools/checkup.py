"""Checkup of a log: all that its owner should know before anything is learnt from it."""

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from refseq.dead_reckoning import dead_reckoned
from refseq.errors import LogError
from refseq.logs import open_log
from refseq.logs.pairing.plan import ViewPlan
from refseq.logs.source import LogSource, Role
from refseq.logs.unreadable import Unreadable
from refseq.view import LASER, Scan, View
from refseq_bench.scenarios.drives.inputs import DriveSelection, truth_delay
from refseq_bench.scenarios.drives.odometry_doubts import (
    course_doubts,
    odometry_jumps,
    speed_doubt,
    without_jumps,
)
from refseq_bench.scenarios.drives.truth.fit import truth_doubt
from refseq_bench.scenarios.drives.truth.repeated import repeats_odometry
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.log_tools.clocks.late import ClockedDrive, SensorClock, clocked_drive
from refseq_bench.scenarios.log_tools.clocks.offsets import ClockOffset
from refseq_bench.scenarios.log_tools.cost import TIMED, ExpectedCost, expected_cost
from refseq_bench.scenarios.log_tools.survey import (
    LogSurvey,
    TopicSurvey,
    is_assumed,
    motion_origin,
    pictures_of,
    scan_of,
    scans_of,
    survey,
    topic_of,
)
from refseq_bench.scenarios.log_tools.travel import Travel, positions, travel
from refseq_bench.scenarios.log_tools.troubles import troubles_of
from refseq_bench.scenarios.log_tools.verdicts import PROFILE, LogVerdict, Prospect, Usability, verdicts
from refseq_bench.scenarios.log_tools.warnings import warnings_of

USUAL_SPACING = 0.85
"""Distance between places that is proposed where none is asked for [m], that of the bench's own drives."""

DENSE = 0.5
"""Views nearer to each other than this, on average, are thinned unless the user says otherwise [m]."""


HEADED = (
    "Headings count from the x axis to the left, and point ahead; a table of time,x,y alone (--odometry FILE) takes "
    "those of the way driven"
)
"""Said where the odometry's headings are not believed."""

MOST = 0.5
"""Share of the views whose true poses are known from which on revisits are told by them."""


@dataclass(frozen=True, slots=True)
class LogCheckup:
    """A log with its verdicts, and what they rest on.

    ``selection`` is the one asked for, with the clocks set right that were found to differ. ``plan`` are the views
    before thinning, None where there is none, for the reason in ``refusal``; ``views`` is their number after it.
    ``path`` (n, 3) is the way by odometry: x, y [m] and heading [rad]. ``clocks`` are by the names of sensors.
    ``taken`` says of each topic what it is taken as, or why it is not.
    """

    survey: LogSurvey
    selection: DriveSelection
    plan: ViewPlan | None
    refusal: str
    views: int
    path: NDArray[np.float64]
    truth: NDArray[np.float64]
    travel: Travel
    clocks: Mapping[str, SensorClock]
    cost: ExpectedCost | None
    taken: Mapping[str, str]
    warnings: tuple[str, ...]
    verdicts: tuple[LogVerdict, ...]

    @property
    def offsets(self) -> dict[str, ClockOffset | None]:
        """Offsets of sensors' clocks by turns, by their names; None where none can be told."""
        return {name: clock.offset for name, clock in self.clocks.items()}

    @property
    def usable(self) -> bool:
        """At least the log can be localised in a map."""
        return any(one.task == "localise" and one.usability is not Usability.FAILS for one in self.verdicts)


def check_log(path: Path, selection: DriveSelection) -> LogCheckup:
    """Check a log up. Raises ``LogError`` and ``ScenarioError`` for what is no log, and for a selection beside it."""
    source = open_log(path)
    clocked, refusal = _planned(source, selection)
    plan, selection = (clocked.plan, clocked.selection) if clocked else (None, selection)
    found = survey(source)
    if selection.thin is None and plan is not None and motion_origin(plan.findings) and _spacing(plan) < DENSE:
        selection = replace(selection, thin=USUAL_SPACING)
    kept = plan.thinned(selection.thin) if plan and selection.thin else plan
    course = "" if plan is None or is_assumed(plan) else next(course_doubts(plan), "")
    way, true = (
        _way(plan, by_poses=bool(course)),
        positions([view.truth for view in plan.views if view.truth] if plan else []),
    )
    views = len(kept) if kept else 0
    troubles = troubles_of(found, plan)
    cost = expected_cost([] if plan is None else _sample_views(found, plan, troubles), views, PROFILE)
    same = plan is not None and repeats_odometry(plan.views)
    places = _places(plan, way)
    jumps = odometry_jumps(plan.views) if plan else []
    driven = _travelled(way, places, jumps=bool(jumps))
    clocks, late = (clocked.clocks, clocked.found) if clocked else ({}, {})
    doubts = _doubts(plan, selection)
    prospect = Prospect(
        path,
        selection,
        plan,
        refusal,
        views,
        driven,
        places,
        same,
        troubles,
        jumps,
        late,
        truth_doubted=bool(doubts),
        units=_units(plan),
        headings_doubted=bool(course),
    )
    return LogCheckup(
        survey=found,
        selection=selection,
        plan=plan,
        refusal=refusal,
        views=prospect.views,
        path=way,
        truth=true,
        travel=prospect.travel,
        clocks=clocks,
        cost=cost,
        taken={topic.name: taken_as(topic, plan, source.unreadable.get(topic.name)) for topic in found.topics},
        warnings=(
            *([f"{course}. {HEADED}"] if course else ()),
            *doubts,
            *warnings_of(found, plan, clocks),
        ),
        verdicts=verdicts(prospect),
    )


def _planned(source: LogSource, selection: DriveSelection) -> tuple[ClockedDrive | None, str]:
    """The views that the log would give; None, and why, where its content gives none."""
    try:
        return clocked_drive(source, selection), ""
    except LogError as error:
        asked = (selection.topics, selection.odometry, selection.truth, selection.late)
        if any(one is not None for one in asked):  # they may be what is wrong
            raise
        return None, str(error).removeprefix(f"{source.path}: ")


def _doubts(plan: ViewPlan | None, selection: DriveSelection) -> tuple[str, ...]:
    """Doubts about the true poses. Raises ``ScenarioError`` for given ones of another drive, as reading does."""
    if plan is None or not motion_origin(plan.findings):
        return ()
    name = plan.source.path.name
    doubt = truth_doubt(plan.views, selection.truth or f"{name}: its truth", name, truth_delay(selection))
    if doubt and doubt.refused and selection.truth:
        raise ScenarioError(doubt.told)
    return (doubt.told,) if doubt else ()


def _units(plan: ViewPlan | None) -> str:
    """The doubt that odometry is in metres; empty without one."""
    return "" if plan is None or is_assumed(plan) else speed_doubt(plan.views)


def _spacing(plan: ViewPlan) -> float:
    """Mean distance from view to view [m]."""
    return sum(abs(view.distance) for view in without_jumps(plan.views)) / max(1, len(plan) - 1)


def _way(plan: ViewPlan | None, *, by_poses: bool) -> NDArray[np.float64]:
    """Poses of the views by odometry, from the first true pose or the origin on, (n, 3); its jumps are no way.

    ``by_poses``: as the log has them, whose headings are not believed.
    """
    if by_poses and plan is not None and plan.motion is not None:
        poses = plan.motion.at([view.time for view in plan.views])
        return poses[np.isfinite(poses).all(axis=1)]
    views = without_jumps(plan.views) if plan and motion_origin(plan.findings) else ()
    return dead_reckoned(views, views[0].truth if views else None)


def _places(plan: ViewPlan | None, way: NDArray[np.float64]) -> NDArray[np.float64]:
    """Poses of the views, (n, 3): the true ones where most are known, and nan for the others; else by odometry."""
    true = [view.truth for view in plan.views] if plan else []
    if sum(pose is not None for pose in true) <= MOST * len(way):
        return way
    unknown = (math.nan, math.nan, math.nan)
    return np.array([(pose.x, pose.y, pose.heading) if pose else unknown for pose in true]).reshape(-1, 3)


def _travelled(way: NDArray[np.float64], places: NDArray[np.float64], *, jumps: bool) -> Travel:
    """Figures of the way by odometry; revisits by those ``places`` that are known.

    Where odometry ``jumps`` nobody knows where behind that it comes back to.
    """
    if jumps:
        return replace(travel(way), revisited=0.0)
    return replace(travel(way), revisited=travel(places[np.isfinite(places).all(axis=1)]).revisited)


def _sample_views(found: LogSurvey, plan: ViewPlan, left_out: Collection[str]) -> list[View]:
    """A few views put together of the samples that the survey kept, to time the learning by."""
    topics = {topic.name: topic for topic in found.topics}
    sensors = {name: topics[topic] for topic, name in plan.findings.sensors.items() if name not in left_out}
    pictures = {name: pictures_of(topic, TIMED) for name, topic in sensors.items() if name != LASER}
    seeing = (one for one in scans_of(sensors[LASER]) if one.returned.any()) if LASER in sensors else ()
    scan = next(iter(seeing), None)
    count = min((len(found) for found in pictures.values()), default=TIMED if scan else 0)
    return [View(0.0, {name: found[k][1].decode() for name, found in pictures.items()}, scan) for k in range(count)]


def taken_as(topic: TopicSurvey, plan: ViewPlan | None, lost: Unreadable | None = None) -> str:
    """Say what a topic is taken as, or why nothing is read from it; ``lost`` are those of its messages."""
    if lost and lost.is_all and topic.channel.role is not Role.IGNORED:
        return "ignored: none of its messages can be read"
    role, findings = topic.channel.role, plan.findings if plan else None
    if findings and (sensor := findings.sensors.get(topic.name)):
        return f"camera {sensor}{_size(topic)}" if sensor != LASER else f"laser{_beams(topic)}"
    uses = [word for word in ("odometry", "truth") if findings and topic_of(getattr(findings, word)) == topic.name]
    if uses:
        return " and ".join(uses)
    match role:
        case Role.IGNORED:
            return "ignored: no camera, laser, pose or transform"
        case Role.TRANSFORMS:
            moved = bool(findings and any("transforms" in one for one in (findings.odometry, findings.truth)))
            return "transforms: mounts and poses" if moved else "transforms: mounts of the sensors"
        case Role.ODOMETRY | Role.TRUTH if not topic.timing.count:
            return "ignored: none of its messages tells a pose"
        case Role.ODOMETRY | Role.TRUTH if findings:
            return f"ignored: {role} is that of {getattr(findings, str(role))}"
        case Role.CAMERA if any(picture.is_depth for _, picture in pictures_of(topic, 1)):
            return "ignored: a camera of distances"
        case Role.CAMERA | Role.LASER if not topic.timing.count:
            return "ignored: none of its messages is read"
        case Role.CAMERA | Role.LASER if findings:
            return f"ignored: a second {role}"
    return str(role)


def _size(topic: TopicSurvey) -> str:
    for _, picture in pictures_of(topic, 1):
        try:
            height, width = picture.decode().shape
        except LogError as error:
            return f", but {error}"
        return f", {width} × {height}"
    return ""


def _beams(topic: TopicSurvey) -> str:
    scan = scan_of(topic)
    return f", {len(scan.ranges)} beams over {math.degrees(field_of_view(scan)):.0f}°" if scan else ""


def field_of_view(scan: Scan) -> float:
    """Angle from the first beam to the last [rad]."""
    return abs(scan.step) * (len(scan.ranges) - 1)
