"""Running LAMP programs (Fig. 1.6) on a bench: one stage after the other, by sonar and odometry alone."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from refseq.missions.lamp import LampStage, LampWord, Verb
from refseq_bench.robots.behaviours import Behaviour, BehaviourOutcome, BehaviourStep, RobotDescription, Senses
from refseq_bench.robots.behaviours.lamp.beside import Beside
from refseq_bench.robots.behaviours.lamp.dead_reckoned import DeadReckoned
from refseq_bench.robots.behaviours.lamp.narrow import Narrow
from refseq_bench.robots.behaviours.lamp.until import Gone, Near, Turned, Until
from refseq_bench.robots.behaviours.sensing.wall import WallSide
from refseq_bench.robots.motion import Twist
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.drives.behaviour_runner import BehaviourEnd, BehaviourMoment, description_of, run
from refseq_bench.sim.errors import SimError

PATIENCE = 20.0
"""Time that a stage waits for what stops it [s]: a choice; at the program's 20 mm/s less would be no way at all."""
TIMEOUT = 900.0
"""Time that a stage may take [s]: a choice, 18 m at 20 mm/s."""
SIDES = {1: WallSide.LEFT, 2: WallSide.RIGHT}
"""Meaning of ``PS``: the thesis does not tell, this is a choice."""


@dataclass(frozen=True, slots=True)
class StageEnded:
    """A ``stage`` and the ``end`` of its behaviour."""

    stage: LampStage
    end: BehaviourEnd


@dataclass(frozen=True, slots=True)
class LampEnded:
    """End of a program: its ``stages`` up to the first that failed, of ``asked`` ones."""

    asked: int
    stages: tuple[StageEnded, ...]

    @property
    def finished(self) -> bool:
        """True if all stages have finished."""
        return len(self.stages) == self.asked and self.stages[-1].end.outcome is BehaviourOutcome.FINISHED

    @property
    def time(self) -> float:
        """Duration [s]."""
        return sum(stage.end.time for stage in self.stages)


def run_lamp(
    bench: Bench,
    stages: Sequence[LampStage],
    *,
    timeout: float = TIMEOUT,
    patience: float = math.inf,
    each: Callable[[BehaviourMoment], None] | None = None,
) -> LampEnded:
    """Run a program until a stage fails, and call ``each`` after every control period.

    ``timeout`` [s] of simulated time is a stage's; after it, or when all of them have taken as long as ``patience``,
    it has failed. Raises ``SimError`` for no stage, for a
    robot without sonars, and for the number of a sonar that the robot has not, before it moves.
    """
    description = description_of(bench.robot)
    if not stages:
        raise SimError("LAMP program without a stage: valid is one stage or more")
    if not (math.isfinite(timeout) and timeout > 0):
        raise SimError(f"LAMP: timeout = {timeout:g} s is not valid: valid is a time above 0 s")
    behaviours = [behaviour_for(stage, description, bench.robot.name) for stage in stages]
    ended: list[StageEnded] = []
    end = bench.time + patience
    for stage, behaviour in zip(stages, behaviours, strict=True):
        done = run(bench, _WithoutLaser(behaviour), timeout=min(timeout, max(0.0, end - bench.time)), each=each)
        ended.append(StageEnded(stage, done))
        if done.outcome is not BehaviourOutcome.FINISHED:
            break
    return LampEnded(len(stages), tuple(ended))


def behaviour_for(stage: LampStage, description: RobotDescription, robot: str) -> Behaviour:
    """Make a stage's behaviour; its odometry begins where the behaviour begins. Raises as ``run_lamp``."""
    if not description.sonars:
        raise SimError(f"robot '{robot}' has no sonars, of which LAMP needs some: valid is a robot such as 'robuter'")
    has = stage.numbers
    if has.get(LampWord.SONAR, 0) >= len(description.sonars):
        most = len(description.sonars) - 1
        raise SimError(
            f"LAMP stage '{stage}': robot '{robot}' has no sonar {has[LampWord.SONAR]}: valid is 0 to {most}"
        )
    if stage.verb is Verb.CROSS:
        return Narrow(description, patience=PATIENCE)
    until = _until(stage, description)
    if stage.verb is Verb.BESIDE:
        side = SIDES[has[LampWord.SIDE]] if LampWord.SIDE in has else None
        return Beside(description, has[LampWord.SPEED_BESIDE] / 1000, side, until, patience=PATIENCE)
    twist = Twist(has.get(LampWord.SPEED, 0) / 1000, math.radians(has.get(LampWord.TURN_RATE, 0)))
    return DeadReckoned(description, twist, until, patience=PATIENCE)


def _until(stage: LampStage, description: RobotDescription) -> Until:
    """The condition that ends a stage; the parser has seen to it that something does."""
    has = stage.numbers
    if LampWord.ANGLE in has:
        return Turned(math.radians(has[LampWord.ANGLE]))
    if LampWord.DISTANCE in has:
        return Gone(has[LampWord.DISTANCE] / 1000)
    return Near(description, has[LampWord.SONAR], has[LampWord.RANGE] / 1000)


class _WithoutLaser:
    """A behaviour whose robot has no laser: LAMP's had none."""

    def __init__(self, inner: Behaviour) -> None:
        self._inner = inner

    def step(self, senses: Senses) -> BehaviourStep:
        """Say how to move now, by what is left of the senses."""
        return self._inner.step(replace(senses, scan=None))
