"""The localiser of the bench: it learns a map of a drive, and finds later views in it.

A robot is led along a path once. ``read_recording`` gives the views of that drive, ``learn`` makes a map of them, and
a ``Localiser`` answers to each later view with a belief: a probability for every place of the map, and one for being
lost.

    from pathlib import Path
    from refseq import Localiser, Map, learn, read_recording

    map_ = learn(read_recording(Path("reference.mcap")).views, profile="best")
    map_.save("map.refseq")

    localiser = Localiser(Map.load("map.refseq"))
    for view in read_recording(Path("query.mcap")).views:
        belief = localiser.update(view)
        print(belief.best, round(belief.lost, 2))

A map grows by later drives with ``add_drive``. Several maps become one with ``merge``: stretches that their paths share
are kept once. Lengths are in metres, times in
seconds, angles in radians. Input that cannot be used raises ``RefseqError``, whose message is one line.

Names are imported when they are first asked for, so that a machine that lacks a package can still be told which.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from refseq.atlas.merge import merge
    from refseq.belief import Belief, LocaliserProtocol, Stage
    from refseq.errors import LogError, MapError, RefseqError, ViewError
    from refseq.logs import Recording, RecordingWriter, read_recording
    from refseq.map.growth.adding import add_drive
    from refseq.map.learning import learn
    from refseq.map.localiser import Localiser, localise
    from refseq.map.map import Map
    from refseq.map.profile import Profile
    from refseq.planar import Pose
    from refseq.view import Scan, View

__all__ = [
    "Belief",
    "Localiser",
    "LocaliserProtocol",
    "LogError",
    "Map",
    "MapError",
    "Pose",
    "Profile",
    "Recording",
    "RecordingWriter",
    "RefseqError",
    "Scan",
    "Stage",
    "View",
    "ViewError",
    "add_drive",
    "learn",
    "localise",
    "merge",
    "read_recording",
]

_HOMES = {
    "atlas.merge": ("merge",),
    "belief": ("Belief", "LocaliserProtocol", "Stage"),
    "errors": ("LogError", "MapError", "RefseqError", "ViewError"),
    "logs": ("Recording", "RecordingWriter", "read_recording"),
    "map.growth.adding": ("add_drive",),
    "map.learning": ("learn",),
    "map.localiser": ("Localiser", "localise"),
    "map.map": ("Map",),
    "map.profile": ("Profile",),
    "planar": ("Pose",),
    "view": ("Scan", "View"),
}
_HOME = {name: module for module, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> object:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
