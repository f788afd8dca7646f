"""Scans laid on each other: what walls they have in common, and where one was taken as seen from the other."""
