"""The figures that a mission can be expected something of: by name, with their unit and what they mean."""

from collections.abc import Mapping
from types import MappingProxyType

from refseq_bench.scenarios.campaign.declare.figures import Figure, Unit
from refseq_bench.scenarios.scoring.missions import MissionFigures

MISSION_FIGURES: Mapping[str, Figure[MissionFigures]] = MappingProxyType(
    {
        "completed": Figure(
            lambda f: f.completed.value, Unit.SHARE, "the robot says so, within score.within of the goal"
        ),
        "completed_narrow": Figure(lambda f: f.completed_narrow.value, Unit.SHARE, "the same within score.narrow"),
        "goal_distance": Figure(lambda f: f.goal_distance, Unit.METRES, "from the goal in the end, median"),
        "wrong_switches": Figure(
            lambda f: f.wrong_switches, Unit.NONE, "orders begun farther than score.within from where they were learnt"
        ),
        "collisions": Figure(lambda f: float(f.collisions), Unit.NONE, "things that were touched"),
        "time": Figure(lambda f: f.time, Unit.SECONDS, "of those that were completed, median"),
        "time_over_ideal": Figure(
            lambda f: f.time_over_ideal, Unit.NONE, "the same over the time at the robot's limits"
        ),
        "barn": Figure(lambda f: f.barn, Unit.NONE, "metric of the BARN challenge, mean"),
        "lost": Figure(lambda f: float(f.lost), Unit.NONE, "times that the robot said it was lost"),
        "views": Figure(lambda f: float(f.views), Unit.VIEWS, "views that were taken"),
        "refused": Figure(lambda f: float(f.refused), Unit.NONE, "missions that what was learnt has no place for"),
    }
)
"""Figures that an expectation may name."""
