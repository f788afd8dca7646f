"""Missions: what a robot should do on its way, by the landmarks that it meets (1.3, appendix C; card X1)."""

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

__all__ = [
    "ADMITTED",
    "Action",
    "Behaviour",
    "Label",
    "Landmark",
    "Mission",
    "MissionError",
    "Step",
    "parse_mission",
]
