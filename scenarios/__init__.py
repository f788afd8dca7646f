"""Experiments: recording, scoring, reports, and the command line over all rooms."""
