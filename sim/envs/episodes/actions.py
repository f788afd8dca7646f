"""Actions of an agent: one of some behaviours, or a twist. Both become steps for a robot, period by period."""

import math
from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from gymnasium import spaces

from refseq_bench.robots import RobotsError, Twist
from refseq_bench.robots.behaviours import Behaviour, BehaviourOutcome, BehaviourStep, RobotDescription, Senses
from refseq_bench.robots.behaviours.written import make_behaviour, parse_behaviour
from refseq_bench.robots.motion import Limits
from refseq_bench.sim.drives.doors import doors_seen
from refseq_bench.sim.errors import SimError


class Acting(Protocol):
    """One form of actions: ``space``, and how long one action lasts [s]."""

    space: spaces.Space[Any]
    period: float

    @property
    def doing(self) -> str:
        """The chosen action in words; empty before the first action."""

    @property
    def behaviour(self) -> str:
        """The chosen behaviour; empty before the first action, and where actions are none."""

    @property
    def going(self) -> int | None:
        """The number of the behaviour that goes on, None where there is none."""

    def reset(self) -> None:
        """Begin an episode."""

    def choose(self, action: Any) -> None:
        """Take an action; raises ``SimError`` for one that is not in the space."""

    def step(self, senses: Senses) -> BehaviourStep:
        """The motion in the next control period."""


class ByBehaviour:
    """Actions 0 to n - 1 are behaviours, ``written`` as ``robots.behaviours.written`` has them, one a decision.

    While the same one is chosen it goes on; another one, or the same after it has ended, begins anew. Raises
    ``SimError`` for one that the robot cannot do.
    """

    period = 1.0

    def __init__(self, written: Sequence[str], description: RobotDescription) -> None:
        try:
            self._choices = [parse_behaviour(text) for text in written]
            for choice in self._choices:
                make_behaviour(choice, description, doors_seen)
        except RobotsError as error:
            raise SimError(str(error)) from None
        self._description = description
        self.space: spaces.Space[Any] = spaces.Discrete(len(self._choices))
        self.reset()

    @property
    def doing(self) -> str:
        """The behaviour chosen last."""
        return "" if self._chosen is None else self._choices[self._chosen].text

    behaviour = doing

    @property
    def going(self) -> int | None:
        """The number of the behaviour that goes on."""
        return None if self._behaviour is None else self._chosen

    def reset(self) -> None:
        """No behaviour goes on."""
        self._chosen: int | None = None
        self._behaviour: Behaviour | None = None

    def choose(self, action: Any) -> None:
        """Begin a behaviour, or go on with it."""
        if not self.space.contains(action):
            raise SimError(f"action {action!r} is not valid; valid are 0 to {len(self._choices) - 1}")
        if self._behaviour is None or int(action) != self._chosen:
            self._chosen = int(action)
            self._behaviour = make_behaviour(self._choices[self._chosen], self._description, doors_seen)

    def step(self, senses: Senses) -> BehaviourStep:
        """The behaviour's motion."""
        assert self._behaviour is not None, "an action was chosen"
        step = self._behaviour.step(senses)
        if step.outcome is not BehaviourOutcome.RUNNING:
            self._behaviour = None
        return step


class ByTwist:
    """Actions are (2,) float32 within ±1: speed ahead and turn rate to the left as shares of the robot's ``limits``."""

    period = 0.2
    behaviour, going = "", None

    def __init__(self, limits: Limits) -> None:
        self.space: spaces.Space[Any] = spaces.Box(-1.0, 1.0, (2,), np.float32)
        self._limits = limits
        self.reset()

    @property
    def doing(self) -> str:
        """The twist chosen last."""
        return "" if self._twist is None else f"twist {self._twist.linear:.3f} m/s, {self._twist.angular:.3f} rad/s"

    def reset(self) -> None:
        """Nothing was asked for."""
        self._twist: Twist | None = None

    def choose(self, action: Any) -> None:
        """Take a twist; what is beyond ±1 counts as ±1."""
        try:
            given = np.asarray(action, np.float64)
        except (TypeError, ValueError):
            given = np.full(0, np.nan)
        if given.shape != (2,) or not np.isfinite(given).all():
            raise SimError(f"action {action!r} is not valid; valid are two finite numbers from -1 to 1")
        ahead, turn = np.clip(given, -1.0, 1.0).tolist()
        self._twist = Twist(ahead * self._limits.speed, turn * self._limits.turn_rate)

    def step(self, senses: Senses) -> BehaviourStep:
        """Go on with the twist."""
        assert self._twist is not None, "an action was chosen"
        return BehaviourStep(self._twist)


def periods(acting: Acting, control_period: float) -> int:
    """Number of control periods that an action lasts."""
    return math.ceil(acting.period / control_period - 1e-9)
