"""Scores of localisation, missions and atlases against the truth."""
