"""Missions as files, their leaders, and their runs."""
