"""The one family of errors that this package raises for input it cannot use."""


class ScenarioError(Exception):
    """A scenario, a run or its answers cannot be used: the message names the value, its place and what is valid."""
