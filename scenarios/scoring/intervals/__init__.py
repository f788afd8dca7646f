"""Intervals of scores over seeds, and comparisons of methods by them."""
