"""The time limit of missions, for every way to run one."""

TIMEOUT = 3600.0
"""A mission lasts no longer [s], pauses apart, where nothing else is asked for.

A choice: a longer way is cut off by a smaller one, a robot that gets nowhere is given up later by a larger one.
"""
