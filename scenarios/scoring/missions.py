"""Score missions against the truth."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq.missions.log import Touch
from refseq.missions.true_way import distance_to
from refseq_bench.scenarios.scoring.proportion import Proportion

BARN_FAST, BARN_SLOW = 4.0, 8.0
"""Between so many times the optimal time BARN's metric falls; faster earns no more."""


@dataclass(frozen=True)
class Ordered:
    """An order of a mission: from ``at`` [m along the way] the robot was to do ``behaviour``, for a reason.

    ``where`` (m, 2) [m] is a line of true places at which it may begin, as it was learnt there: one point for what ends
    by itself, the whole stretch for what lasts until a place is reached. It is empty where nobody knows.
    """

    at: float
    behaviour: str
    why: str
    where: NDArray[np.float64]


@dataclass(frozen=True)
class MissionLogLine:
    """A line of the log: when [s], where the robot believed itself to be, and what happened.

    ``along`` is in metres along its way, nan of one that believes nothing.
    """

    time: float
    along: float
    what: str

    def __str__(self) -> str:
        place = "" if math.isnan(self.along) else f"{self.along:z7.1f} m"
        return f"{self.time:7.1f} s {place:>9}  {self.what}"


@dataclass(frozen=True)
class MissionRun:
    """One mission that was run, and what is true of it.

    ``completed`` is what the robot itself believes, ``why`` what kept it from that. ``track`` (n, 5) holds time [s],
    true x, y [m], heading [rad] and where it believed itself to be [m along its way]. ``switches`` are the orders that
    were begun: number and time [s]. ``goal`` (2,) [m] is where it should end, ``way`` [m] how far that is at least,
    ``ideal`` [s] the time that this takes at the robot's limits, ``optimal`` [s] the same without its turns.
    ``touches`` are the first ones of each thing that the robot touched.
    """

    completed: bool
    why: str
    track: NDArray[np.float64]
    orders: tuple[Ordered, ...]
    switches: tuple[tuple[int, float], ...]
    log: tuple[MissionLogLine, ...]
    goal: tuple[float, float]
    way: float
    ideal: float
    optimal: float
    touches: tuple[Touch, ...] = ()
    lost: int = 0
    views: int = 0
    refused: bool = False

    @property
    def time(self) -> float:
        """Duration [s]."""
        return float(self.track[-1, 0])

    @property
    def touched(self) -> tuple[str, ...]:
        """The names of the things that the robot touched."""
        return tuple(touch.thing for touch in self.touches)

    def position(self, time: float) -> NDArray[np.float64]:
        """Where the robot really was (2,) [m]."""
        return np.array([np.interp(time, self.track[:, 0], self.track[:, axis]) for axis in (1, 2)])


@dataclass(frozen=True, slots=True)
class MissionScore:
    """One mission, scored.

    ``completed`` and ``completed_narrow``: the robot says so, and is within the one or the other tolerance of the goal.
    ``goal_distance`` [m] is how far from it it ended. ``wrong`` says of each switch whether it was a wrong one; None
    where nobody knows what would be right. ``barn`` is the metric of the BARN challenge.
    """

    completed: bool
    completed_narrow: bool
    goal_distance: float
    wrong: tuple[bool, ...] | None
    collisions: int
    time: float
    ideal: float
    barn: float
    lost: int
    views: int
    refused: bool


def score_mission(run: MissionRun, within: float, narrow: float) -> MissionScore:
    """Score a mission with two tolerances [m]; the first is also that of its switches.

    A switch is wrong where the robot really is farther than that from where the order was learnt to be begun.
    """
    apart = math.dist(run.track[-1, 1:3], run.goal)
    completed = run.completed and apart <= within
    return MissionScore(
        completed=completed,
        completed_narrow=run.completed and apart <= narrow,
        goal_distance=apart,
        wrong=_wrong(run, within),
        collisions=len(run.touched),
        time=run.time,
        ideal=run.ideal,
        barn=barn(run.time, run.optimal, success=completed and not run.touched),
        lost=run.lost,
        views=run.views,
        refused=run.refused,
    )


def _wrong(run: MissionRun, within: float) -> tuple[bool, ...] | None:
    if any(not len(order.where) for order in run.orders):
        return None
    places = ((run.orders[number].where, run.position(time)) for number, time in run.switches)
    return tuple(distance_to(line, place) > within for line, place in places)


def barn(time: float, optimal: float, *, success: bool) -> float:
    """The metric of the BARN challenge: success × OT / clip(AT, 4 OT, 8 OT), 0.25 at best.

    ``time`` AT is what was taken, ``optimal`` OT the length of the path over the top speed [s]; who touches something
    has not succeeded. X. Xiao et al., "Autonomous Ground Navigation in Highly Constrained Spaces: Lessons Learned From
    the Benchmark Autonomous Robot Navigation Challenge at ICRA 2022", IEEE Robotics & Automation Magazine 29(4), 2022.
    """
    if not success or optimal <= 0:
        return 0.0
    return float(optimal / np.clip(time, BARN_FAST * optimal, BARN_SLOW * optimal))


@dataclass(frozen=True)
class MissionFigures:
    """One method over the missions of all seeds, of one at least."""

    method: str
    scores: tuple[MissionScore, ...]

    @property
    def completed(self) -> Proportion:
        """Missions completed, of all."""
        return self._share(lambda one: one.completed)

    @property
    def completed_narrow(self) -> Proportion:
        """Those within the narrower tolerance."""
        return self._share(lambda one: one.completed_narrow)

    @property
    def goal_distance(self) -> float:
        """Distance from the goal at the end, completed or not, median [m]; nan where nobody knows the goal."""
        return _median(one.goal_distance for one in self.scores if math.isfinite(one.goal_distance))

    @property
    def wrong_switches(self) -> float:
        """Orders that were begun elsewhere than where they were learnt, of all missions; nan where nobody knows."""
        if any(one.wrong is None for one in self.scores):
            return math.nan
        return float(sum(sum(one.wrong or ()) for one in self.scores))

    @property
    def switches(self) -> int:
        """Orders that were begun."""
        return sum(len(one.wrong or ()) for one in self.scores)

    @property
    def collisions(self) -> int:
        """Things that were touched."""
        return sum(one.collisions for one in self.scores)

    @property
    def time(self) -> float:
        """Duration of those that were completed, median [s]; nan without any."""
        return _median(one.time for one in self.scores if one.completed)

    @property
    def time_over_ideal(self) -> float:
        """The same in times of what the way takes at the robot's limits."""
        return _median(one.time / one.ideal for one in self.scores if one.completed and one.ideal > 0)

    @property
    def barn(self) -> float:
        """Mean of BARN's metric."""
        return float(np.mean([one.barn for one in self.scores]))

    @property
    def lost(self) -> int:
        """Times that the robot said that it was lost."""
        return sum(one.lost for one in self.scores)

    @property
    def views(self) -> int:
        """Views that were taken."""
        return sum(one.views for one in self.scores)

    @property
    def refused(self) -> int:
        """Missions that could not be compiled for what was learnt."""
        return sum(one.refused for one in self.scores)

    def _share(self, take: Callable[[MissionScore], bool]) -> Proportion:
        return Proportion(sum(map(take, self.scores)), len(self.scores))


def mission_record(one: MissionFigures) -> dict[str, float | int | str | None]:
    """All figures by their names, units in them; None where there is none. Counts are told with what they are of."""
    runs = len(one.scores)
    return {
        "completed": f"{one.completed.successes} of {runs}",
        "completed_narrow": f"{one.completed_narrow.successes} of {runs}",
        "goal_distance_median_m": _finite(one.goal_distance),
        "wrong_switches": None if math.isnan(one.wrong_switches) else f"{one.wrong_switches:.0f} of {one.switches}",
        "collisions": one.collisions,
        "time_median_s": _finite(one.time),
        "time_over_ideal_median": _finite(one.time_over_ideal),
        "barn_mean": _finite(one.barn),
        "lost_times": one.lost,
        "views": one.views,
        "refused": one.refused,
    }


def outcome_words(run: MissionRun, score: MissionScore) -> str:
    """Outcome of a mission in words."""
    where = f"{score.goal_distance:.2f} m from the goal"
    if math.isnan(score.goal_distance):
        return run.why  # it was refused, and so nobody knows where it would have led
    if score.completed:
        return f"completed in {run.time:.0f} s, {where}"
    if run.completed:
        return f"took itself to be there, {where}"
    return f"{run.why} ({where})"


def failures(runs: Sequence[MissionRun], scores: Sequence[MissionScore]) -> list[MissionRun]:
    """Those that were not completed."""
    return [run for run, score in zip(runs, scores, strict=True) if not score.completed]


def _median(values: Iterable[float]) -> float:
    found = list(values)
    return float(np.median(found)) if found else math.nan


def _finite(value: float) -> float | None:
    return round(value, 4) if math.isfinite(value) else None
