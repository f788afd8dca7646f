"""Acceptance tests of a robot's motion on an empty floor."""
