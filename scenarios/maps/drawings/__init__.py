"""Drawings of maps: what needs matplotlib, which who asks for figures alone does not wait for."""
