"""Doors of every server here: who may come in, how many, and a proxy before servers that cannot be told."""
