"""Localisation as a server: a robot's sensors in over a WebSocket, beliefs out."""
