"""Distances and times between views: of a drive that is learnt, and of a mission."""

LEARNT_EVERY = 0.85
"""A view is taken so often [m] where nothing else is asked for, and then becomes a place."""
MISSION_EVERY = 0.6
"""On a mission a view is taken so often [m]: a choice, other than ``LEARNT_EVERY``.

Views as far apart as places would meet each of them the same way, and never tell that the robot is between two."""
CLOSER = 0.3
"""Or so often [m] where the scene that is sought was in the last view: beside the robot it is in sight for a metre."""
LOOKING = 1.0
"""While the robot stands and looks where it is, it takes a view so often [s]: a choice."""
