"""Tasks by name: the bench's own, and those that anybody writes, as ``package.module:Class``."""

import inspect
from collections.abc import Mapping, Sequence
from pkgutil import resolve_name
from typing import Any

from refseq_bench.sim.envs.tasks.cross_door import CrossDoorTask
from refseq_bench.sim.envs.tasks.follow_corridor import FollowCorridorTask
from refseq_bench.sim.envs.tasks.reach_place import ReachPlaceTask
from refseq_bench.sim.envs.tasks.recover import RecoverTask
from refseq_bench.sim.envs.tasks.run_mission import RunMissionTask
from refseq_bench.sim.envs.tasks.task import Task
from refseq_bench.sim.errors import SimError

TASKS: Mapping[str, type[Task]] = {
    "follow-corridor": FollowCorridorTask,
    "cross-door": CrossDoorTask,
    "reach-place": ReachPlaceTask,
    "recover": RecoverTask,
    "run-mission": RunMissionTask,
}


def task_named(name: str) -> type[Task]:
    """The task of a name, whose module is imported if it is none of the bench's. Raises ``SimError``."""
    if name in TASKS:
        return TASKS[name]
    if ":" not in name:
        raise SimError(f"unknown task {name!r}: valid are {', '.join(TASKS)}, or package.module:Class")
    try:
        found = resolve_name(name)
    except (ImportError, AttributeError, ValueError) as error:
        raise SimError(f"task {name!r} is not found: {' '.join(str(error).split())}") from error
    return checked_task(found)


def checked_task(task: object) -> type[Task]:
    """The class, if it is that of a task that can be made. Raises ``SimError``."""
    if not (isinstance(task, type) and issubclass(task, Task)):
        raise SimError(f"task {task!r} is not valid; valid is a subclass of {Task.__module__}.{Task.__name__}")
    if inspect.isabstract(task):
        raise SimError(f"task {task.__name__} has no method {', '.join(sorted(task.__abstractmethods__))}")
    if not getattr(task, "behaviours", ()):
        raise SimError(f"task {task.__name__} has no behaviours; valid is a tuple such as ('MN:1000', 'MT:90', 'stop')")
    return task


def made_task(task: str | type[Task], asked: Mapping[str, Any], beside: Sequence[str] = ()) -> Task:
    """A task with the keywords that it takes itself. Raises ``SimError`` for others; those ``beside`` are valid too."""
    kind = task_named(task) if isinstance(task, str) else checked_task(task)
    for name in asked:
        if name not in kind.keywords:
            valid = ", ".join((*beside, *kind.keywords)) or "none"
            raise SimError(f"unknown keyword {name!r} of {kind.__name__}: valid are {valid}")
    return kind(**asked)


def name_of(task: type[Task]) -> str:
    """The name by which another process finds a task too. Raises ``SimError`` for one that it could not find."""
    if "<locals>" in checked_task(task).__qualname__:
        raise SimError(f"task {task.__qualname__} lies in a function; valid is a class at the top of a module")
    return f"{task.__module__}:{task.__qualname__}"
