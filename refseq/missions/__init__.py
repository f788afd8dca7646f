"""Missions: what a robot should do on its way, by the landmarks that it meets (1.3, appendix C; card X1 to X5).

Names are imported when they are first asked for: who reads a mission or a program loads no map.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from refseq.missions.executor import Do, Executor, ExecutorSettings
    from refseq.missions.language import (
        ADMITTED,
        Action,
        BehaviourCode,
        Label,
        Landmark,
        Mission,
        MissionError,
        Step,
        parse_mission,
    )
    from refseq.missions.log import Entry
    from refseq.missions.lookout import Lookout
    from refseq.missions.path import MissionPath, path_along, path_of
    from refseq.missions.plan import Errand, Landmarks, Order, Plan, Sought, as_learnt, compiled
    from refseq.missions.progress import Estimate, ProgressFilter, ProgressSettings
    from refseq.missions.status import Status
    from refseq.missions.tasks import Call, Photograph, Task, Wait
    from refseq.missions.true_way import TrueWay

__all__ = [
    "ADMITTED",
    "Action",
    "BehaviourCode",
    "Call",
    "Do",
    "Entry",
    "Errand",
    "Estimate",
    "Executor",
    "ExecutorSettings",
    "Label",
    "Landmark",
    "Landmarks",
    "Lookout",
    "Mission",
    "MissionError",
    "MissionPath",
    "Order",
    "Photograph",
    "Plan",
    "ProgressFilter",
    "ProgressSettings",
    "Sought",
    "Status",
    "Step",
    "Task",
    "TrueWay",
    "Wait",
    "as_learnt",
    "compiled",
    "parse_mission",
    "path_along",
    "path_of",
]

_HOMES = {
    "executor": ("Do", "Executor", "ExecutorSettings"),
    "language": (
        "ADMITTED",
        "Action",
        "BehaviourCode",
        "Label",
        "Landmark",
        "Mission",
        "MissionError",
        "Step",
        "parse_mission",
    ),
    "log": ("Entry",),
    "lookout": ("Lookout",),
    "path": ("MissionPath", "path_along", "path_of"),
    "plan": ("Errand", "Landmarks", "Order", "Plan", "Sought", "as_learnt", "compiled"),
    "progress": ("Estimate", "ProgressFilter", "ProgressSettings"),
    "status": ("Status",),
    "tasks": ("Call", "Photograph", "Task", "Wait"),
    "true_way": ("TrueWay",),
}
_HOME = {name: module for module, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> object:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
