"""Check episodes that a task draws, and their judgements: tasks are also written by users."""

import math

from refseq.planar import Pose
from refseq_bench.sim.envs.tasks.task import Episode, Judgement, Task
from refseq_bench.sim.errors import SimError
from refseq_bench.worlds.plans.schema import FloorPlan


def checked_episode(task: Task, drawn: object) -> Episode:
    """The episode, if it is one with a finite start. Raises ``SimError``."""
    name = type(task).__name__
    if not isinstance(drawn, Episode):
        raise SimError(f"task {name}: episode returned {drawn!r:.60}; valid is an {Episode.__name__}")
    start = getattr(drawn, "start", None)
    if not isinstance(start, Pose):
        raise SimError(f"task {name}: start {start!r:.60} is not valid; valid is a {Pose.__module__}.{Pose.__name__}")
    if not all(map(math.isfinite, (start.x, start.y, start.heading))):
        raise SimError(f"task {name}: start {start} is not valid; valid are finite numbers [m, m, rad]")
    return drawn


def checked_remaining(episode: Episode, remaining: float) -> float:
    """The distance to the goal, if it is finite. Raises ``SimError``."""
    if not math.isfinite(remaining):
        raise SimError(f"{type(episode).__name__}: remaining returned {remaining}; valid is a finite number")
    return remaining


def checked_judgement(episode: Episode, judged: Judgement) -> Judgement:
    """The judgement of a step, if its numbers are finite. Raises ``SimError``."""
    checked_remaining(episode, judged.remaining)
    if not math.isfinite(judged.reward):
        raise SimError(f"{type(episode).__name__}: the reward is {judged.reward}; valid is a finite number")
    return judged


def lies_in(plan: FloorPlan, start: Pose) -> bool:
    """True if a start lies within the bounds of a floor plan: beyond them there is nothing to touch."""
    (left, bottom), (right, top) = plan.bounds
    return bool(left <= start.x <= right and bottom <= start.y <= top)
