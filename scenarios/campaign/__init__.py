"""Declared experiments: scenario files, what they expand to, how they are run and judged."""
