"""Rerun viewer of runs: tabs of one layout, saved, shown, sent, served, or live.

Rerun's plane has y downwards; whatever lies in the world is drawn with north up, so the second coordinate shown is −y.
"""
