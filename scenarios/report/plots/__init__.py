"""Plots of the reports, as SVG."""
