"""Pairing: from the samples of a source to views."""
