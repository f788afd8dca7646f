"""The map file: its archive and arrays, its header, and what of them is valid."""
