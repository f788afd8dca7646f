"""Scenario files: schema, expansion into cases, checks before the first drive."""
