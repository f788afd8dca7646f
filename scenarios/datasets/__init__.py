"""Data sets of place recognition: their layouts in folders, and their ground truth by picture."""
