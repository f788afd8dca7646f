"""Missions: what a robot should do on its way, by the landmarks that it meets (1.3, appendix C; card X1 to X5)."""

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
