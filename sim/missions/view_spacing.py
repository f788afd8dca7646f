"""Distances and times between the views of a mission."""

EVERY = 0.6
"""On the way a view is taken so often [m]: a choice, other than the 0.85 m at which places are learnt.

Views as far apart as places would meet each of them the same way, and never tell that the robot is between two."""
CLOSER = 0.3
"""Or so often [m] where the scene that is sought was in the last view: beside the robot it is in sight for a metre."""
LOOKING = 1.0
"""While the robot stands and looks where it is, it takes a view so often [s]: a choice."""
