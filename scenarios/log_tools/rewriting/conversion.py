"""Conversion of logs: their views, written in another format."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from refseq.logs import RecordingWriter, write_carmen
from refseq.logs.carmen.writer import as_word
from refseq.logs.closing import incomplete, noted_damage
from refseq.logs.pairing.plan import ViewPlan
from refseq.planar import Pose, after_motion
from refseq.view import LASER, View
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.log_tools.survey import motion_origin

if TYPE_CHECKING:
    from refseq.logs.ros.writer import BagWriter


class LogFormat(StrEnum):
    """Formats that logs are converted to."""

    MCAP = "mcap"
    ROSBAG2 = "rosbag2"
    CARMEN = "carmen"
    TUM = "tum"
    KITTI = "kitti"


SUFFIXES = {
    ".mcap": LogFormat.MCAP,
    ".log": LogFormat.CARMEN,
    ".clf": LogFormat.CARMEN,
    ".carmen": LogFormat.CARMEN,
    ".tum": LogFormat.TUM,
    ".kitti": LogFormat.KITTI,
}
FORMATS = f"{', '.join(LogFormat)}"


class ViewWriter(Protocol):
    """Takes a drive view by view."""

    def write(self, view: View, odometry: Pose) -> None:
        """Add a view and the odometer's pose at it."""
        ...


def format_of(path: Path, asked: str | None) -> LogFormat:
    """The format asked for, or that of the name.

    Raises ``ScenarioError`` for another, for a name that tells another than is asked for, and without any.
    """
    found = SUFFIXES.get(path.suffix.lower())
    if asked is not None:
        if asked not in tuple(LogFormat):
            raise ScenarioError(f"format {asked!r} is unknown; valid are {FORMATS}")
        if found is not None and found != asked:
            endings = ", ".join(one for one, form in SUFFIXES.items() if form == asked)
            valid = f"that ends in {endings}" if endings else "without an ending"
            raise ScenarioError(f"{path}: its name tells {found}, --format {asked}; valid is a name {valid}")
        return LogFormat(asked)
    if found is None:
        valid = ", ".join(SUFFIXES)
        raise ScenarioError(f"{path}: its name tells no format; valid are names in {valid}, or --format: {FORMATS}")
    return found


@dataclass(frozen=True, slots=True)
class Converted:
    """Account of a conversion: the views written, and what of them the format has no place for."""

    views: int
    left_out: tuple[str, ...]


def convert(plan: ViewPlan, target: Path, form: LogFormat, notes: Mapping[str, str]) -> Converted:
    """Write the planned views to ``target``, replaced in one step, with the log's metadata and ``notes``.

    Views are read and written one by one, but for CARMEN, whose scans are held. The odometer starts at the first true
    pose, or at the origin. Raises ``LogError`` and ``ScenarioError``, and then leaves nothing.
    """
    told = {**{key: str(value) for key, value in plan.source.metadata.items()}, **notes, **_unwhole(plan)}
    match form:
        case LogFormat.TUM | LogFormat.KITTI:
            return _poses(plan, target, form)
        case LogFormat.CARMEN:
            views = [replace(view, images={}) for view in plan.read()]
            write_carmen(target, views, told)
            return Converted(len(views), tuple(_lost_by_carmen(plan, views, told)))
        case _:
            writing = _recording(target, told) if form is LogFormat.MCAP else _bag(target, told)
            with writing as writer:
                return Converted(_written(plan, writer), ())


def _lost_by_carmen(plan: ViewPlan, views: Sequence[View], told: Mapping[str, str]) -> Iterator[str]:
    """Names of what a CARMEN log has no place for."""
    yield from (f"pictures of {sensor}" for sensor in plan.findings.sensors.values() if sensor != LASER)
    if any(view.behaviour for view in views):
        yield "behaviours"
    if blank := sorted(name for name, value in told.items() if as_word(value) not in ("", value)):
        yield f"blanks and line ends in the metadata's {', '.join(blank)}, now underscores"


def _unwhole(plan: ViewPlan) -> dict[str, str]:
    """Notes on a log that was cut off, which what is made of it would not show; a marked one's own are copied."""
    source = plan.source
    return {} if source.complete or noted_damage(source.metadata) else incomplete(source.damage)


def odometer(views: Iterable[View]) -> Iterator[tuple[View, Pose]]:
    """Views with the pose that the odometer shows at each, summed up from the first true pose or the origin."""
    pose: Pose | None = None
    for view in views:
        pose = (view.truth or Pose(0.0, 0.0, 0.0)) if pose is None else after_motion(pose, view.distance, view.turn)
        yield view, pose


def _written(plan: ViewPlan, writer: ViewWriter) -> int:
    count = 0
    for view, pose in odometer(plan.read()):
        writer.write(view, pose)
        count += 1
    return count


@contextmanager
def _recording(target: Path, told: Mapping[str, str]) -> Iterator[ViewWriter]:
    with _kept_or_discarded(RecordingWriter(target, told)) as writer:
        yield writer


@contextmanager
def _bag(target: Path, told: Mapping[str, str]) -> Iterator[ViewWriter]:
    from refseq.logs.ros.writer import BagWriter

    with _kept_or_discarded(BagWriter(target, told)) as writer:
        yield writer


@contextmanager
def _kept_or_discarded(writer: "RecordingWriter | BagWriter") -> Iterator[ViewWriter]:
    """Give the file its name when the block ends well; otherwise nothing is left of it."""
    try:
        yield writer
        writer.close()
    except BaseException:
        writer.discard()
        raise


def _poses(plan: ViewPlan, target: Path, form: LogFormat) -> Converted:
    """The odometry, or the truth where there is no odometry, as a trajectory; no picture is read."""
    from refseq.logs.trajectories import TrajectoryFormat, write_trajectory

    if not motion_origin(plan.findings):
        raise ScenarioError(f"{plan.source.path}: has no poses; valid for {form} is a log with odometry or truth")
    rows = [(view.time, pose) for view, pose in odometer(plan.views)]
    write_trajectory(target, rows, TrajectoryFormat(form))
    return Converted(len(rows), ("pictures and scans",))
