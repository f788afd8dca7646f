"""A robot on a line that runs a mission: its odometer may slip, it may be carried away, and its views may be wrong."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from refseq.belief import Belief, belief_from
from refseq.map.paths.annotations import PathDoor
from refseq.missions.executor import Executor
from refseq.missions.path import MissionPath
from refseq.missions.tasks import Task

STEP = 0.1
SPEED = 0.5
VIEW = 1.0
"""A view is taken each metre, and each second where the robot stands."""
ENDS = {"MT": (2.0, 0.0), "MC": (5.0, 2.5), "MA": (4.0, 2.0), "stop": (0.5, 0.0)}
"""How long behaviours last that end by themselves [s], and how far they lead along the line [m]."""
Script = Callable[[int, float], Belief]
"""What the localiser answers to a view, by its number and where it was really taken [m]."""


def way(
    length: float = 30.0, spacing: float = 1.0, told: dict[int, str] | None = None, doors: Sequence[PathDoor] = ()
) -> MissionPath:
    """A way of places evenly apart; ``told`` are the behaviours by the place where they began.

    A turn leads nowhere: the place behind it is where it began.
    """
    told = told or {}
    turns = sum(words.startswith("MT") for words in told.values())
    count = round(length / spacing) + 1 + turns
    steps = [0.0, *(0.0 if told.get(place, "").startswith("MT") else spacing for place in range(count - 1))]
    behaviours = tuple(told.get(place, "") for place in range(count))
    return MissionPath(np.arange(count), np.cumsum(steps), behaviours, tuple(doors))


def seen_at(along: NDArray[np.float64], x: float, width: float = 0.6, lost: float = 0.0) -> Belief:
    """A belief in the places around ``x`` [m]."""
    return belief_from(np.exp(-(((along - x) / width) ** 2) / 2) + 1e-9, lost)


def flat(count: int) -> Belief:
    """A belief that knows nothing."""
    return belief_from(np.ones(count))


def lost(count: int) -> Belief:
    """A belief that is at a Lost_Place."""
    return belief_from(np.ones(count), 0.95)


@dataclass(frozen=True)
class Begun:
    """A behaviour that was begun: its execution's number, its words, where by the truth [m], and when [s]."""

    number: int
    words: str
    x: float
    time: float


@dataclass
class Line:
    """The robot and its world: ``x`` [m] is where it truly is, ``travelled`` what its odometer shows."""

    executor: Executor
    script: Script | None
    x: float = 0.0
    grip: float = 1.0
    """How much of what the odometer shows the robot really goes."""
    fails: str = ""
    """The code of a behaviour that fails."""
    time: float = 0.0
    travelled: float = 0.0
    begun: list[Begun] = field(default_factory=list)
    tasks: list[tuple[Task, float]] = field(default_factory=list)
    halted: float = 0.0
    views: int = 0
    _since_view: tuple[float, float] = (0.0, 0.0)
    _running: tuple[int, float, float] = (-1, 0.0, 0.0)
    """Number of the execution, how long it has run [s], and where the odometer was when it began."""

    def run(self, limit: float = 3000.0, each: Callable[["Line"], None] | None = None) -> "Line":
        """Go on until the mission is over."""
        self._view()
        while not self.executor.status.over and self.time < limit:
            self.step()
            if each is not None:
                each(self)
        return self

    def step(self) -> None:
        """One period."""
        do = self.executor.do
        if do.task is not None:
            self.tasks.append((do.task, self.x))
            self.executor.done()
            return
        self.time += STEP
        if do.halt:
            self.halted += STEP
        else:
            self._behave(do.number, do.behaviour)
        self.executor.move(self.time, self.travelled)
        gone, stood = self.travelled - self._since_view[0], self.time - self._since_view[1]
        if gone >= VIEW or (do.halt and stood >= 1.0):
            self._view()

    def _behave(self, number: int, words: str) -> None:
        if self._running[0] != number:
            self._running = number, 0.0, self.travelled
            self.begun.append(Begun(number, words, self.x, self.time))
        _, lasted, start = self._running
        code, _, rest = words.partition(":")
        if code == self.fails:
            self.executor.ended(False, "something is in the way")
            return
        if code in ("MN", "MW") or (code == "MA" and rest.endswith(",0")):
            length = float(rest.split(",")[2 if code == "MW" else 0])
            speed, over = SPEED, self.travelled + SPEED * STEP - start >= length
        else:
            seconds, metres = ENDS[code]
            self._running = number, lasted + STEP, start
            speed, over = metres / seconds, lasted + STEP >= seconds
        self.travelled += speed * STEP
        self.x += speed * STEP * self.grip
        if over:
            self.executor.ended(True, "went so far")

    def _view(self) -> None:
        self._since_view = self.travelled, self.time
        if self.script is not None:
            self.executor.believe(self.script(self.views, self.x))
        self.views += 1

    @property
    def words(self) -> list[str]:
        """Codes of the behaviours that were begun, one for each run of the same."""
        codes = [one.words.partition(":")[0] for one in self.begun]
        return [code for code, before in zip(codes, ["", *codes], strict=False) if code != before]


def right(of: MissionPath) -> Script:
    """A localiser that always knows."""
    return lambda number, x: seen_at(of.along, x)
