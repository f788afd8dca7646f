"""The one family of errors that this package raises for input it cannot use."""


class WorldsError(Exception):
    """A world cannot be had as asked: the message names the value, its place and what is valid, in one line."""


class PlanError(WorldsError):
    """A floor plan cannot be read, or describes something that cannot be built."""


class UnknownWorldError(PlanError):
    """A world was asked for by a name that there is not."""


class LightError(WorldsError):
    """A light was asked for that does not exist."""


class ChangeError(WorldsError):
    """A change between drives was asked for that cannot be."""
