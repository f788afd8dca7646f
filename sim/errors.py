"""The one family of errors that this package raises for input it cannot use."""


class SimError(Exception):
    """A bench cannot be built or run as asked: the message names the value and what is valid, in one line."""


class StuckError(SimError):
    """A robot did not get to the end of its route in the time that it was given."""


class RendererError(SimError):
    """A renderer cannot be opened: the message names the packages that it needs."""
