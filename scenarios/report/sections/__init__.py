"""Sections of a report: tables, plots and frames of one experiment."""
