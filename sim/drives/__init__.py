"""Recorded drives: operator, behaviours, recorder."""
