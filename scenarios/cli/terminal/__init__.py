"""Pieces of all commands: options that are declared once, what is printed, mistakes in one line, viewers."""
