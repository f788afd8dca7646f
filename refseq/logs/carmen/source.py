"""Scans of a log with the poses that hold with each."""

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from refseq.errors import LogError
from refseq.logs.carmen.layouts import LASERS, SCANS, LaserLine, reach_told, read_laser, read_poses
from refseq.logs.carmen.line import CarmenLine, lines_in
from refseq.logs.carmen.text import CutOffError
from refseq.logs.closing import CuttableLog
from refseq.logs.source import Channel, Role, Sample
from refseq.logs.unreadable import Unreadable, UnreadableError, UnreadableTally
from refseq.planar import Pose, in_world, relative_pose
from refseq.view import LASER

TOPICS = LASER_TOPIC, ODOMETRY_TOPIC, TRUTH_TOPIC = f"/{LASER}", "/odometry", "/truth"
POSES = {"ODOM": ODOMETRY_TOPIC, "TRUEPOS": TRUTH_TOPIC}
"""Kinds of lines with poses alone, and the topic that they tell of."""
TEXT, PARAMETER = "text", "PARAM"


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

    def __init__(self, path: Path) -> None:
        self.path = path
        self._cut = ""
        self._tally = UnreadableTally()
        self._counts: Counter[str] = Counter()
        told: dict[str, str] = {}
        for line in self._readable():
            self._counts[line.kind] += 1
            if line.kind == PARAMETER:
                if len(line.fields) < 3 and not line.ended:
                    break  # cut off
                self._tally.see(PARAMETER)
                if len(line.fields) < 3:
                    why = f"has {len(line.fields)} fields; valid are at least 3: PARAM, a name and a value"
                    self._tally.lose(_unreadable(line, why))
                    continue
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
        return {kind: count for kind, count in self._counts.items() if kind not in {*self._kinds, *POSES, PARAMETER}}

    @property
    def unreadable(self) -> Mapping[str, Unreadable]:
        """Lines that do not fit their kind, by the topic that they tell of, and of parameters by PARAM."""
        return self._tally.found

    def samples(self, topics: Collection[str] | None = None) -> Iterator[Sample]:
        """Scans and their poses. Lines that do not fit their kind are left out, and ``unreadable``."""
        self._tally.begin(TOPICS)
        state = _State()
        moment = 0
        for line in self._readable():
            try:
                found = self._read_line(line, state)
            except LogError as error:
                if not line.ended:
                    self._cut = f"line {line.number} is cut off"
                    return
                self._lose(line, str(error), state)
                continue
            self._see(line, found)
            if found is not None:
                for topic, content in (
                    (LASER_TOPIC, found.scan),
                    (ODOMETRY_TOPIC, found.odometry),
                    (TRUTH_TOPIC, found.truth),
                ):
                    if content is not None and (topics is None or topic in topics):
                        yield Sample(topic, found.time, found.logged, "", content, moment=moment)
                moment += 1

    def _see(self, line: CarmenLine, found: LaserLine | None) -> None:
        """Count a line that was read, for the topics that it tells of."""
        if found is None and line.kind in POSES:
            self._tally.see(POSES[line.kind])
        elif found is not None:
            self._tally.see(LASER_TOPIC)
            if found.odometry is not None:
                self._tally.see(ODOMETRY_TOPIC)

    def _lose(self, line: CarmenLine, why: str, state: _State) -> None:
        """Leave a line out."""
        error = _unreadable(line, why)
        self._tally.see(error.topic)
        self._tally.lose(error)
        if line.kind.startswith("RAW"):
            state.truth_at(state.odometry)  # without an odometer the last true pose was this scan's

    def lines_of(self, first: int, last: int) -> LineSpan:
        """Lines of the scans ``first`` to ``last``, counted from 0, of all between, and of the poses that hold then.

        The order of the lines tells, for a logger's clock may be another than the stamps', or stand still.
        """
        poses: dict[str, int] = {}
        begin = end = scans = 0
        for line in self._readable():
            if (line.kind not in self._kinds and line.kind not in POSES) or not self._fits(line):
                continue
            if line.kind in POSES:
                if not begin:
                    poses[line.kind] = line.number
                continue
            if scans == first:
                begin = line.number
            elif not begin and line.kind.startswith("RAW") and "ODOM" not in poses:
                poses.pop("TRUEPOS", None)  # it was that scan's
            end, scans = line.number, scans + 1
            if scans > last:
                break
        return LineSpan(begin, end, frozenset(poses.values()))

    def _fits(self, line: CarmenLine) -> bool:
        """Tell whether a line is as its kind says."""
        try:
            self._read_line(line, _State())
        except LogError:
            return False
        return True

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


def _unreadable(line: CarmenLine, why: str) -> UnreadableError:
    """Make the error of a line that does not fit its kind."""
    if line.kind == PARAMETER:
        return UnreadableError(PARAMETER, f"line {line.number}", why)
    return UnreadableError(POSES.get(line.kind, LASER_TOPIC), f"line {line.number}, {line.kind},", why)


def _some(kinds: Sequence[str], most: int = 5) -> str:
    """The first few kinds, shortened: a text that is no log has as many as it has lines."""
    named = [f"{kind:.20}" for kind in kinds[:most]] + ([f"and {len(kinds) - most} more"] if len(kinds) > most else [])
    return ", ".join(named) or "none"
