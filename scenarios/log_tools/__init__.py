"""Logs of any robot: inspected, judged, drawn, converted and cut."""
