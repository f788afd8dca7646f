"""Verdicts: figures of a case against its expectations."""
