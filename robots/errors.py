"""The one family of errors that this package raises for input it cannot use."""


class RobotsError(Exception):
    """A robot cannot be built or driven as asked: the message names the value and what is valid, in one line."""
