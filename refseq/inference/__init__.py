"""Inference: from active features to beliefs; nothing here knows of maps or files."""
