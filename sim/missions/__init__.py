"""Missions and LAMP programs run on a bench."""
