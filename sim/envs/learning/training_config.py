"""Configuration of a training: a task, for how long, and the worlds of its evaluation."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import gymnasium as gym

from refseq_bench.sim.envs.learning.sectors import Sectors
from refseq_bench.sim.envs.registry import IDS
from refseq_bench.sim.errors import SimError

TASKS = {name.removeprefix("refseq/").removesuffix("-v0"): name for name in IDS}
"""Tasks that can be learnt, by the ids' middle parts."""
HELD_OUT = tuple(f"corridor:{seed}" for seed in range(100, 108))
"""Corridors that nobody learns in. Tasks elsewhere are tried where they were learnt, in episodes of their own."""
CORRIDOR = re.compile(r"corridor:\d+")
"""A corridor as it is drawn; those with dials are of another kind than ``HELD_OUT``."""
MISSIONS = "Mission"
"""The task that the missions' executor plays, too."""
FIRST_TRIED = 1_000_000
"""The seed of the first episode that is tried; episodes to learn from, or to imitate, have smaller ones."""


@dataclass(frozen=True, slots=True)
class TrainingConfig:
    """The training of a ``task`` of ``TASKS``, with so many ``robots`` at a time, each in a process of its own.

    It ends after ``seconds`` by the clock, start-up counted in, or after ``steps`` of all robots together, rounded up
    to what is learnt from at once, whichever comes first. Robot i is seeded with ``seed`` + i. ``worlds`` are learnt
    in, those of the task itself where none are given; so many ``episodes`` are then tried in the worlds of ``held_out``
    by turns, none of which is learnt in. In missions the policy first imitates the executor in so many episodes,
    ``taught``, seeded from ``seed`` on; ``steps`` may be 0 then. Raises ``SimError`` for values that cannot be.
    """

    task: str
    seconds: float = 600.0
    steps: int = 10_000_000
    robots: int = 4
    seed: int = 0
    worlds: tuple[str, ...] = ()
    held_out: tuple[str, ...] = ()
    episodes: int = 16
    taught: int = 0

    def __post_init__(self) -> None:
        if self.task not in TASKS:
            raise SimError(f"unknown task {self.task!r}: valid are {', '.join(TASKS)}")
        fewest = 0 if self.taught else 1
        for name, least in (
            ("seconds", 1),
            ("steps", fewest),
            ("robots", 1),
            ("seed", 0),
            ("episodes", 2),
            ("taught", 0),
        ):
            if not getattr(self, name) >= least:
                raise SimError(f"{name} = {getattr(self, name)} is not valid; valid are {least} or more")
        if self.taught and self.task != MISSIONS:
            raise SimError(f"taught = {self.taught} is not valid for {self.task}: the executor plays {MISSIONS} alone")
        self._check_apart()

    def _check_apart(self) -> None:
        """Raise ``SimError`` where something that is tried is learnt from as well."""
        for name in ("robots", "taught"):
            count = getattr(self, name)
            if self.seed + count > FIRST_TRIED:
                raise SimError(
                    f"seed = {self.seed}, {name} = {count}: episodes from seed {FIRST_TRIED} on are tried; valid is "
                    f"seed + {name} up to {FIRST_TRIED}"
                )
        # Where none are held out, and it is no drawn corridor, other episodes are tried in the same worlds.
        both = [world for world in self.tried_in if world in self.learnt_in]
        if both and (self.held_out or self.tried_in == HELD_OUT):
            raise SimError(
                f"worlds {', '.join(both)}: are learnt in, and would be tried in; valid are others to learn in, or "
                "others as held_out"
            )

    @property
    def learnt_in(self) -> tuple[str, ...]:
        """The worlds that are learnt in."""
        world = self.worlds or gym.spec(TASKS[self.task]).kwargs["world"]
        return (world,) if isinstance(world, str) else tuple(world)

    @property
    def tried_in(self) -> tuple[str, ...]:
        """The worlds that it is tried in."""
        if self.held_out:
            return self.held_out
        return HELD_OUT if all(map(CORRIDOR.fullmatch, self.learnt_in)) else self.learnt_in

    @property
    def tried_elsewhere(self) -> bool:
        """It is tried in worlds that nobody learnt in."""
        return not {*self.tried_in} & {*self.learnt_in}


def check_worlds(config: TrainingConfig) -> None:
    """Raise ``SimError`` for worlds that the task cannot be made with."""
    environment(config.task, config.learnt_in).close()
    for world in config.held_out:
        environment(config.task, (world,)).close()


def environment(task: str, worlds: Sequence[str]) -> gym.Env[Any, Any]:
    """An environment of the task as learners see it; raises ``SimError`` for worlds that it cannot be made with."""
    # Tasks with a map want one world by its name.
    world = worlds[0] if len(worlds) == 1 else list(worlds)
    return Sectors(gym.make(TASKS[task], world=world))
