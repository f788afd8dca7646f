"""Missions: what a robot should do on its way, by the landmarks that it meets (1.3, appendix C; card X1 to X5)."""

from refseq.missions.executor import Caution, Do, Entry, Executor, Status
from refseq.missions.language import (
    ADMITTED,
    Action,
    Behaviour,
    Label,
    Landmark,
    Mission,
    MissionError,
    Step,
    parse_mission,
)
from refseq.missions.path import Way, way_along, way_of
from refseq.missions.plan import Errand, Landmarks, Order, Plan, as_learnt, compiled
from refseq.missions.progress import Trust, Whereabouts, Word
from refseq.missions.tasks import Call, Photograph, Task, Wait

__all__ = [
    "ADMITTED",
    "Action",
    "Behaviour",
    "Call",
    "Caution",
    "Do",
    "Entry",
    "Errand",
    "Executor",
    "Label",
    "Landmark",
    "Landmarks",
    "Mission",
    "MissionError",
    "Order",
    "Photograph",
    "Plan",
    "Status",
    "Step",
    "Task",
    "Trust",
    "Wait",
    "Way",
    "Whereabouts",
    "Word",
    "as_learnt",
    "compiled",
    "parse_mission",
    "way_along",
    "way_of",
]
