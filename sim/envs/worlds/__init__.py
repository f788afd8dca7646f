"""Worlds of the environments."""
