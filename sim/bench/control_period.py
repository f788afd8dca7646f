"""Period of a drive: how often a robot is commanded."""

CONTROL_PERIOD = 0.04
"""Time between two commands to the Control layer [s]; a choice, well above the rate of a person's hand."""
