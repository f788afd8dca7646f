"""Localisation methods by name: ours, baselines, plug-ins."""
