"""Perception of the behaviours: walls, doorways, free room, sonar and scans."""
