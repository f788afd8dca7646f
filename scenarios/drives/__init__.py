"""Drives: recording, localising and comparing."""
