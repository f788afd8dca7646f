"""Run missions for the scorer: a plan, a LAMP program, or one that is refused."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from operator import itemgetter

import numpy as np
from numpy.typing import NDArray

from refseq.belief import Belief, LocaliserProtocol
from refseq.missions import Executor, ExecutorSettings, Plan, Status, TrueWay
from refseq.missions.behaviour_codes import code_of
from refseq.missions.lamp import LampStage
from refseq.missions.log import Touch
from refseq.planar import Pose
from refseq.view import View
from refseq_bench.robots.behaviours.written import parse_behaviour
from refseq_bench.robots.motion import Limits
from refseq_bench.scenarios.drives.drive import Drive
from refseq_bench.scenarios.drives.selection import only
from refseq_bench.scenarios.missions.leader import Leader
from refseq_bench.scenarios.scoring.missions import MissionLogLine, MissionRun, Ordered
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.control_period import CONTROL_PERIOD
from refseq_bench.sim.bench.faults import Fault, FaultSchedule, Traveller
from refseq_bench.sim.drives.behaviour_runner import BehaviourMoment
from refseq_bench.sim.missions.lamp import LampEnded, run_lamp
from refseq_bench.sim.missions.mission import DrivenMission, run_mission
from refseq_bench.sim.missions.touches import TouchLog

NOWHERE = (math.nan, math.nan)
"""The goal of a mission that leaves the way: nobody knows it."""
Each = Callable[[Executor, Bench], None]
SIDES = ("left", "right")


@dataclass(frozen=True)
class MissionResult:
    """A mission that was run, what was believed on its way, and what was photographed: images by name and camera."""

    run: MissionRun
    beliefs: tuple[Belief, ...] = ()
    photographs: Mapping[str, Mapping[str, NDArray[np.uint8]]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class MissionBounds:
    """Least length and duration of a mission: ``way`` [m], ``ideal`` and ``optimal`` [s] as ``MissionRun`` says."""

    way: float
    ideal: float
    optimal: float


class SensorFilter:
    """A localiser that looks at some sensors only; None: at all."""

    def __init__(self, inner: LocaliserProtocol, sensors: tuple[str, ...] | None) -> None:
        self._inner, self._sensors = inner, sensors
        inner.reset()

    def reset(self) -> None:
        """Forget all views seen."""
        self._inner.reset()

    def update(self, view: View) -> Belief:
        """Take the next view and answer."""
        return self._inner.update(only(view, self._sensors))


class _Watcher:
    """Watches a robot on its mission: what befalls it on its way, and how often it begins to say that it is lost."""

    def __init__(self, bench: Bench, ground: TrueWay, faults: Sequence[Fault]) -> None:
        self._way = _OnItsWay(bench, ground)
        self._agenda = FaultSchedule(faults, bench, self._way)
        self._agenda.look()
        self.losses, self._lost = 0, False

    def __call__(self, executor: Executor, _bench: Bench) -> None:
        """A control period has gone by."""
        self.look()
        lost = executor.status is Status.LOST
        self.losses += lost and not self._lost
        self._lost = lost

    def look(self) -> None:
        """Look where the robot is."""
        self._way.look()
        self._agenda.look()


class _OnItsWay(Traveller):
    """True progress of a robot [m]: from where it was set down along the way by all that it has gone."""

    length = math.inf  # whoever declared the faults was told what is beyond the route

    def __init__(self, bench: Bench, ground: TrueWay) -> None:
        self._bench, self._ground, self._last = bench, ground, bench.pose
        self._progress = ground.nearest(bench.pose)

    @property
    def progress(self) -> float:
        """Way behind the robot [m]."""
        return self._progress

    def look(self) -> None:
        """Note what it has gone since the last time."""
        last, self._last = self._last, self._bench.pose
        self._progress += math.dist((last.x, last.y), (self._last.x, self._last.y))

    def carried(self, to: float) -> Pose:
        """It is set down so far along the way [m]."""
        self._last, self._progress = self._ground.pose(to), to
        return self._last


def run_plan(
    bench: Bench,
    leader: Leader,
    plan: Plan,
    goal_of: Callable[[Plan], tuple[float, float] | None],
    *,
    sensors: tuple[str, ...] | None,
    drive: Drive,
    each: Each = lambda _executor, _bench: None,
) -> MissionResult:
    """Run a plan, led by the odometer and, if the leader has one, a localiser; ``each`` hears of control periods.

    ``goal_of`` tells where it should end, by the plan as it became once what it sought was found; None: where that ends
    on the way. The ``drive`` tells its faults, when views are taken, and how long it may last. Raises what these raise.
    """
    ground, start, limits = leader.ground, bench.pose, bench.robot.limits
    settings = ExecutorSettings(timeout=drive.patience)
    executor = Executor(plan, localised=leader.localiser is not None, settings=settings)
    localiser = None if leader.localiser is None else SensorFilter(leader.localiser, sensors)
    watcher = _Watcher(bench, ground, drive.faults)

    def look(executor: Executor, bench: Bench) -> None:
        watcher(executor, bench)
        each(executor, bench)

    mission = run_mission(bench, executor, localiser, trigger=drive.trigger, each=look)
    end = goal_of(executor.plan) or _pair(ground, executor.plan.goal)
    measure = mission_bounds(executor.plan, ground, start, limits, end)
    run = _told_run(mission, ground, end, measure, watcher.losses)
    return MissionResult(run, tuple(seen.belief for seen in mission.seen), mission.photographs)


def _told_run(
    mission: DrivenMission, ground: TrueWay, end: tuple[float, float], measure: MissionBounds, losses: int
) -> MissionRun:
    """A mission that was driven, for the scorer; its plan is what it became, once all that it sought was found."""
    executor = mission.executor
    completed = executor.status is Status.COMPLETED
    return MissionRun(
        completed=completed,
        why="" if completed else f"{executor.status.value}: {executor.why}",
        track=mission.track,
        orders=_given(executor.plan, ground),
        switches=tuple(executor.switches),
        log=tuple(MissionLogLine(entry.time, entry.along, entry.what) for entry in executor.log),
        goal=end,
        **asdict(measure),
        touches=mission.touches,
        lost=losses,
        views=len(mission.seen),
    )


def _given(plan: Plan, ground: TrueWay) -> tuple[Ordered, ...]:
    """The orders of a plan, each with the true places where it may begin."""
    orders = enumerate(plan.orders)
    return tuple(Ordered(one.at, one.behaviour, one.why, ground.where(plan, number)) for number, one in orders)


def run_program(
    bench: Bench,
    ground: TrueWay,
    plan: Plan,
    goal: tuple[float, float] | None,
    *,
    stages: Sequence[LampStage],
    drive: Drive,
) -> MissionResult:
    """Run a LAMP program; the plan says how far it is. Where its stages ought to begin nobody knows.

    The ``drive`` tells its faults, and how long all stages together may last.
    """
    touches, watcher = TouchLog(bench), _Watcher(bench, ground, drive.faults)
    end = goal or _pair(ground, plan.goal)
    measure = mission_bounds(plan, ground, bench.pose, bench.robot.limits, end)

    def look(_moment: BehaviourMoment) -> None:
        touches.look()
        watcher.look()

    start = bench.pose
    ended = run_lamp(bench, stages, patience=drive.patience, each=look)
    why = "" if ended.finished else f"failed: stage {len(ended.stages)}, {ended.stages[-1].end.why}"
    poses = np.concatenate([np.array([[start.x, start.y, start.heading]]), *(one.end.path[1:] for one in ended.stages)])
    times = CONTROL_PERIOD * np.arange(len(poses))[:, None]
    run = MissionRun(
        completed=ended.finished,
        why=why,
        track=np.concatenate([times, poses, np.full_like(times, math.nan)], axis=1),
        orders=tuple(Ordered(math.nan, str(stage), "", np.zeros((0, 2))) for stage in stages),
        switches=tuple(enumerate(_begun(ended))),
        log=_told(ended, touches.touches),
        goal=end,
        **asdict(measure),
        touches=touches.touches,
    )
    return MissionResult(run)


def refused_run(bench: Bench, why: str, goal: tuple[float, float] | None) -> MissionResult:
    """A mission that what was learnt has no place for: the robot stays where it is."""
    pose = bench.pose
    track = np.array([[0.0, pose.x, pose.y, pose.heading, math.nan]])
    log = (MissionLogLine(0.0, math.nan, f"refused: {why}"),)
    run = MissionRun(False, f"refused: {why}", track, (), (), log, goal or NOWHERE, 0.0, 0.0, 0.0, refused=True)
    return MissionResult(run)


def mission_bounds(
    plan: Plan, ground: TrueWay, start: Pose, limits: Limits, goal: tuple[float, float]
) -> MissionBounds:
    """Bound a mission from where the robot stood at its ``start`` to the goal.

    The way is that of the plan from the place nearest to the robot on, and straight from the plan's end to a goal that
    lies off it. Each turn by itself, and that into a door beside the way, is at the robot's turn rate.
    """
    begun = ground.nearest(start)
    way = max(plan.goal - begun, 0.0) + math.dist(ground.position(plan.goal), goal)
    optimal = way / limits.speed
    turned = math.fsum(turn_of(order.behaviour) for order in plan.orders if order.at >= begun)
    return MissionBounds(way, optimal + turned / limits.turn_rate, optimal)


def turn_of(behaviour: str) -> float:
    """Turn of a behaviour about the robot itself [rad]: a quarter before a door beside the way."""
    values = parse_behaviour(behaviour).values if ":" in behaviour else ()
    match code_of(behaviour):
        case "MT":
            return abs(float(values[0]))
        case "MC":
            return math.pi / 2 if values and values[0].name.lower() in SIDES else 0.0
        case "MA":
            return abs(float(values[2])) if len(values) > 2 else 0.0
        case _:
            return 0.0


def _pair(ground: TrueWay, along: float) -> tuple[float, float]:
    x, y = ground.position(along).tolist()
    return x, y


def _begun(ended: LampEnded) -> list[float]:
    """When each stage was begun [s]."""
    return [0.0, *np.cumsum([one.end.time for one in ended.stages]).tolist()][: len(ended.stages)]


def _told(ended: LampEnded, touches: Sequence[Touch]) -> tuple[MissionLogLine, ...]:
    """A line a stage, when it ends, and one for each thing that was touched."""
    ends = np.cumsum([one.end.time for one in ended.stages]).tolist()
    lines = (
        f"{number}. {one.stage}: {one.end.outcome.name.lower()}, {one.end.why}"
        for number, one in enumerate(ended.stages, 1)
    )
    told = [*((touch.time, str(touch)) for touch in touches), *zip(ends, lines, strict=True)]
    return tuple(MissionLogLine(time, math.nan, line) for time, line in sorted(told, key=itemgetter(0)))
