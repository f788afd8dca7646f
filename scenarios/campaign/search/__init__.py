"""Worst-case search: the dials of a scenario at which a method fails, and the smallest change that does it."""
