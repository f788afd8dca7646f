"""Several simulations that go on side by side, and whose physics MuJoCo steps together, on its own threads.

Each is a generator that does all that is its own, and yields where steps of its physics are due. When all have come so
far, one call of ``mujoco.batch`` takes the steps of all whose models are alike. Every simulation keeps its own model
and data: its state goes into a row of the batch before the call, and all of the batch's data comes back after it, so
that whoever looks at a simulation's data finds the very bits that its own ``mj_step`` would have left there.
"""

from collections.abc import Generator, Mapping
from typing import TypeVar

import mujoco
import numpy as np
from mujoco.batch import Batch

from refseq_bench.sim.physics import Due

T = TypeVar("T")
_KEPT = mujoco.mjtState.mjSTATE_INTEGRATION
_NUMBER = 1
"""Where a warning's count is in a row of the batch's warnings: ``mjWarningStat`` is (lastinfo, number)."""


class PhysicsBatch:
    """Lets simulations go on side by side, on so many ``threads`` (0: one for each core, as MuJoCo counts them).

    A simulation is known by a number. Those of one layout, all sizes of their models the same, are stepped in one call,
    one layout after the other.
    """

    def __init__(self, threads: int = 0) -> None:
        self._threads = threads
        self._known: dict[int, Due] = {}
        self._groups: list[LayoutBatch] = []

    @property
    def groups(self) -> list[tuple[int, ...]]:
        """The numbers of those that are stepped in one call."""
        return [group.numbers for group in self._groups]

    def run(self, runs: Mapping[int, Generator[Due, None, T]]) -> dict[int, T]:
        """Let all go on to their ends; returns what they do, by their numbers."""
        going, ended = dict(runs), dict[int, T]()
        while going:
            due: dict[int, Due] = {}
            for number, run in list(going.items()):
                try:
                    due[number] = next(run)
                except StopIteration as end:
                    ended[number] = end.value
                    del going[number]
            self._step(due)
        return ended

    def _step(self, due: Mapping[int, Due]) -> None:
        if any(self._known.get(number) is not one for number, one in due.items()):
            self._known |= due
            self._groups = _grouped(self._known, self._threads)
        for group in self._groups:
            group.step(due)


class LayoutBatch:
    """Simulations of one layout, by their ``numbers``, in one batch."""

    def __init__(self, numbered: Mapping[int, Due], threads: int) -> None:
        self.numbers = tuple(sorted(numbered))
        self._models = [numbered[number].physics.model for number in self.numbers]
        # Persistent: only then has the batch all data of each simulation, and not just its state.
        self._batch = Batch(self._models[0], len(self._models), threads, persistent=True)

    def step(self, due: Mapping[int, Due]) -> None:
        """Take the steps that are due for any of these."""
        mine = {row: due[number] for row, number in enumerate(self.numbers) if number in due}
        ends = {row: one.physics.after(one.steps) for row, one in mine.items()}
        moving = [row for row, one in mine.items() if one.physics.fault is None]
        if moving:
            # The batch reads the simulations' own models, and has to be told that they may have changed: brakes do it.
            self._batch.set_models(self._models)
            for row in moving:
                self._load(row, mine[row])
            self._batch.step(moving, nstep=mine[moving[0]].steps)
            for row in moving:
                self._batch.get_data(row, mine[row].physics.data)
        for row, one in mine.items():
            one.physics.arrive(ends[row])

    def _load(self, row: int, one: Due) -> None:
        physics, batch = one.physics, self._batch
        mujoco.mj_getState(physics.model, physics.data, batch.state[row], _KEPT)
        batch.warning[row, :, _NUMBER] = physics.data.warning.number


def _grouped(known: Mapping[int, Due], threads: int) -> list[LayoutBatch]:
    groups: dict[tuple[int, ...], dict[int, Due]] = {}
    for number, due in known.items():
        groups.setdefault((due.steps, *_sizes(due.physics.model)), {})[number] = due
    return [LayoutBatch(group, threads) for group in groups.values()]


_SIZES = tuple(name for name in dir(mujoco.MjModel) if name.startswith("n") and name != "names")


def _sizes(model: mujoco.MjModel) -> tuple[int, ...]:
    """All sizes of a model; it has some methods and arrays under such names, too."""
    values = (getattr(model, name) for name in _SIZES)
    return tuple(int(value) for value in values if isinstance(value, int | np.integer))
