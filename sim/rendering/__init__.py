"""Renderers: luminance of every pixel, and the drivers they need."""
