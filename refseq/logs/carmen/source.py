"""Scans of a log with the poses that hold with each."""

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from refseq.errors import LogError
from refseq.logs.carmen.layouts import LASERS, POSES, SCANS, LaserLine, reach_told, read_laser, read_poses
from refseq.logs.carmen.line import CarmenLine, lines_in
from refseq.logs.carmen.text import CutOffError
from refseq.logs.closing import CuttableLog
from refseq.logs.source import Channel, Role, Sample
from refseq.logs.unreadable import ALL_READABLE
from refseq.planar import Pose, in_world, relative_pose
from refseq.view import LASER

LASER_TOPIC, ODOMETRY_TOPIC, TRUTH_TOPIC = f"/{LASER}", "/odometry", "/truth"
TEXT = "text"


@dataclass(frozen=True, slots=True)
class LineSpan:
    """Numbers of lines, from 1: ``first`` to ``last``, both among them, and the ``poses`` before that still hold."""

    first: int
    last: int
    poses: frozenset[int]

    def __contains__(self, number: int) -> bool:
        return self.first <= number <= self.last or number in self.poses


@dataclass(slots=True)
class _State:
    """State of the reader: all that was read so far and concerns the scans to come.

    A true pose holds where the odometer stood as ``at_truth`` says.
    """

    odometry: Pose | None = None
    truth: Pose | None = None
    at_truth: Pose | None = None

    def truth_at(self, odometry: Pose | None) -> Pose | None:
        """The true pose where the odometer shows this one; without an odometer it is that of the next scan only."""
        truth = self.truth
        if truth is None:
            return None
        if odometry is None or self.at_truth is None:
            self.truth = None  # who knows where the robot is by the next one
            return truth
        moved = relative_pose(odometry, self.at_truth)
        x, y = in_world((moved.x, moved.y), truth).tolist()
        return Pose(x, y, truth.heading + moved.heading)


class CarmenSource(CuttableLog):
    """A laser's scans of a CARMEN log, each a moment of its own with the poses in or before its line.

    The truth is TRUEPOS, carried on by the odometer, where the log has such lines; else the pose that the log itself
    corrected (the front laser's pose in FLASER and ROBOTLASER1). The odometer's pose is in the line too, or the last
    ODOM.
    """

    kind = "a CARMEN log"
    has_moments = True
    unreadable = ALL_READABLE

    def __init__(self, path: Path) -> None:
        self.path = path
        self._cut = ""
        self._counts: Counter[str] = Counter()
        told: dict[str, str] = {}
        for line in self._readable():
            self._counts[line.kind] += 1
            if line.kind == "PARAM":
                if len(line.fields) < 3 and not line.ended:
                    break  # cut off
                if len(line.fields) < 3:
                    raise line.error(f"has {len(line.fields)} fields; valid are at least 3: PARAM, a name and a value")
                told[line.fields[1]] = line.fields[2]
        self._told = told
        self._kinds = next((kinds for kinds in LASERS if any(self._counts[kind] for kind in kinds)), ())
        self._reach = reach_told(told)
        if not self._scans:
            seen = _some(sorted(self.skipped))
            why = f"is text, so a CARMEN log, and holds no scan (kinds of lines seen: {seen})"
            raise LogError(f"{path}: {why}; valid are {', '.join(SCANS)}")

    @property
    def metadata(self) -> Mapping[str, str]:
        """Values of its PARAM lines."""
        return self._told

    def _readable(self) -> Iterator[CarmenLine]:
        """The lines up to where the log is cut off."""
        try:
            yield from lines_in(self.path)
        except CutOffError as error:
            self._cut = str(error)

    @property
    def _scans(self) -> int:
        return sum(self._counts[kind] for kind in self._kinds)

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The laser, the poses beside its scans, and all other kinds of lines."""
        schema = "+".join(kind for kind in self._kinds if self._counts[kind])
        posed = [
            Channel(topic, schema, TEXT, self._scans, role)
            for topic, role in ((LASER_TOPIC, Role.LASER), (ODOMETRY_TOPIC, Role.ODOMETRY), (TRUTH_TOPIC, Role.TRUTH))
        ]
        others = (Channel(kind, kind, TEXT, count, Role.IGNORED) for kind, count in self.skipped.items())
        return tuple(sorted([*posed, *others], key=lambda channel: channel.topic))

    @property
    def skipped(self) -> Mapping[str, int]:
        """Lines of other kinds."""
        return {kind: count for kind, count in self._counts.items() if kind not in {*self._kinds, *POSES, "PARAM"}}

    def samples(self, topics: Collection[str] | None = None) -> Iterator[Sample]:
        """Scans and their poses. Raises ``LogError`` with file and line for a line that does not fit its kind."""
        state = _State()
        moment = 0
        for line in self._readable():
            try:
                found = self._read_line(line, state)
            except LogError:
                if line.ended:
                    raise
                self._cut = f"line {line.number} is cut off"
                return
            if found is not None:
                for topic, content in (
                    (LASER_TOPIC, found.scan),
                    (ODOMETRY_TOPIC, found.odometry),
                    (TRUTH_TOPIC, found.truth),
                ):
                    if content is not None and (topics is None or topic in topics):
                        yield Sample(topic, found.time, found.logged, "", content, moment=moment)
                moment += 1

    def lines_of(self, first: int, last: int) -> LineSpan:
        """Lines of the scans ``first`` to ``last``, counted from 0, of all between, and of the poses that hold then.

        The order of the lines tells, for a logger's clock may be another than the stamps', or stand still.
        """
        poses: dict[str, int] = {}
        begin = end = scans = 0
        for line in self._readable():
            if line.kind in POSES and not begin:
                poses[line.kind] = line.number
            if line.kind not in self._kinds:
                continue
            if scans == first:
                begin = line.number
            elif not begin and line.kind.startswith("RAW") and "ODOM" not in poses:
                poses.pop("TRUEPOS", None)  # it was that scan's
            end, scans = line.number, scans + 1
            if scans > last:
                break
        return LineSpan(begin, end, frozenset(poses.values()))

    def _read_line(self, line: CarmenLine, state: _State) -> LaserLine | None:
        """Take one line into the state; a line of the laser is returned."""
        if line.kind == "ODOM":
            state.odometry, _ = read_poses(line)
        elif line.kind == "TRUEPOS":
            state.truth, state.at_truth = read_poses(line)
        if line.kind not in self._kinds:
            return None
        found = read_laser(line, self._reach)
        if line.kind.startswith("RAW"):
            found = replace(found, odometry=state.odometry)
        if self._counts["TRUEPOS"]:
            found = replace(found, truth=state.truth_at(found.odometry))
        return found


def _some(kinds: Sequence[str], most: int = 5) -> str:
    """The first few kinds, shortened: a text that is no log has as many as it has lines."""
    named = [f"{kind:.20}" for kind in kinds[:most]] + ([f"and {len(kinds) - most} more"] if len(kinds) > most else [])
    return ", ".join(named) or "none"
