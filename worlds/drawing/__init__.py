"""Drawings of a floor plan."""
