"""Paths as they were learnt: their places, scans and annotations, the straight legs of a led one."""
