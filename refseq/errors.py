"""The one family of errors that this package raises for input it cannot use."""


class RefseqError(Exception):
    """An input cannot be used: the message names the value, its place and what is valid, in one line."""


class MapError(RefseqError):
    """A ``.refseq`` map cannot be read, or does not fit the views."""


class LogError(RefseqError):
    """A recording (MCAP or CARMEN) cannot be read."""


class SceneError(RefseqError):
    """A scene cannot be cut or read, or is not of the camera that looks for it."""


class ViewError(RefseqError):
    """A view's images, scan or motion cannot be used."""
