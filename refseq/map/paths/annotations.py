"""Annotations of a path for missions: what was done at each place, and the doors along it (appendix C; X2, X3)."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from refseq.behaviours import begun
from refseq.dead_reckoning import reckoned_poses, way_along
from refseq.errors import ViewError
from refseq.features.doors import DetectedDoor, DoorSettings, find_doors
from refseq.map.paths.led import led_behaviours
from refseq.planar import in_world
from refseq.view import View

LANDMARK = DoorSettings(edge=0.04, recess=0.0)
"""Settings for doors that are landmarks: a closed one counts as well, whose leaf lies behind the wall's face."""
NARROWEST = 0.7
"""Doors for people are so wide or wider [m]. A piece of wall behind the ends of things that stand before it looks as a
closed leaf does, and is mostly narrower: of drives in 14 worlds, by the laser alone, 256 doors were found with this and
without it, and 6 gaps instead of 13."""
NEAR = 5.0
"""A door is looked for no farther off than this [m]: a choice, a few views before it is reached."""
SAME = 0.8
"""Two sightings nearer to each other than this [m] are of the same door: a choice, below what lies between two."""
FARTHEST = 1e6
"""No door of a path is farther along it, or wider [m]: a choice, a month's drive."""
SIGHTINGS = 2
"""So many views must have seen a door: a choice; what only one takes for a door is mostly a gap between things."""


class DoorSide(StrEnum):
    """Where a door is, for a robot on its path."""

    LEFT = "left"
    AHEAD = "ahead"
    RIGHT = "right"


@dataclass(frozen=True, slots=True)
class PathDoor:
    """A door beside a path, or across it: the laser is abreast of its middle ``along`` [m] from the path's start.

    ``width`` [m] is that of its opening; ``passable`` whether nothing stood in it when it was last seen.
    """

    along: float
    side: DoorSide
    width: float
    passable: bool

    @property
    def beside(self) -> str:
        """Where it is, in words."""
        return "ahead" if self.side is DoorSide.AHEAD else f"on the {self.side}"


@dataclass(frozen=True, slots=True)
class Annotations:
    """``behaviours`` say what the robot did from each place on, empty: it went on as before; ``doors`` by ``along``.

    Several at one place are ``MT:90@0.31; MN:5@0.12``, in their order; behind the @ is how far behind the place each
    begins [m along], without one there. Where nothing is known of how a path was driven there are no behaviours at all.
    """

    behaviours: tuple[str, ...] = ()
    doors: tuple[PathDoor, ...] = ()

    def __post_init__(self) -> None:
        """Raise ``ValueError`` for behaviours that begin nowhere: no map that holds them could be read again."""
        for words in self.behaviours:
            begun(words)

    def to_dict(self) -> dict[str, Any]:
        """As JSON holds it."""
        return {"behaviours": list(self.behaviours), "doors": [asdict(door) for door in self.doors]}

    @classmethod
    def from_dict(cls, content: Any) -> "Annotations":
        """The inverse of ``to_dict``. Raises ``ValueError`` for what is none."""
        if not isinstance(content, dict) or set(content) != {"behaviours", "doors"}:
            raise ValueError("annotations are no table of behaviours and doors")
        behaviours, doors = content["behaviours"], content["doors"]
        if not isinstance(behaviours, list) or not all(isinstance(one, str) for one in behaviours):
            raise ValueError("annotations: behaviours are no list of texts")
        if not isinstance(doors, list):
            raise ValueError("annotations: doors are no list")
        return cls(tuple(behaviours), tuple(map(_door, doors)))


def _door(content: Any) -> PathDoor:
    if not isinstance(content, Mapping) or set(content) != {field.name for field in fields(PathDoor)}:
        raise ValueError("annotations: a door is no table of along, side, width and passable")
    numbers = content["along"], content["width"]
    if not all(isinstance(one, int | float) and -FARTHEST < one < FARTHEST for one in numbers):
        raise ValueError("annotations: a door's along and width are no numbers")
    if not isinstance(content["passable"], bool):
        raise ValueError(f"annotations: a door's passable is {content['passable']!r}; valid is true or false")
    return PathDoor(float(numbers[0]), DoorSide(content["side"]), float(numbers[1]), content["passable"])


def annotations_of(views: Sequence[View]) -> Annotations:
    """Annotations from the views of a drive, one place a view; what a person did is told by the odometry.

    Raises ``ViewError`` for a behaviour that begins nowhere.
    """
    told = tuple(_told(number, view) for number, view in enumerate(views))
    return Annotations(told if any(told) else led_behaviours(views), tuple(doors_along(views)))


def _told(number: int, view: View) -> str:
    try:
        begun(view.behaviour)
    except ValueError:
        raise ViewError(
            f"view {number} at {view.time:g} s: behaviour is {view.behaviour!r:.60}; "
            "valid is as MT:90@0.31; MN:5, with metres behind an @"
        ) from None
    return view.behaviour


def doors_along(views: Sequence[View]) -> list[PathDoor]:
    """Doors that the scans of a drive show, in the order in which the robot passes them."""
    tracks: list[_Track] = []
    for sighting in _doors_in(views):
        track = next((track for track in tracks if track.shows(sighting)), None)
        if track is None:
            tracks.append(_Track([sighting]))
        else:
            track.sightings.append(sighting)
    doors = [track.door for track in tracks if len(track.sightings) >= SIGHTINGS]
    return sorted((door for door in doors if door.width >= NARROWEST), key=lambda door: door.along)


@dataclass(frozen=True, slots=True)
class _DoorInView:
    """A door in a view: where its middle is in the odometer's frame (2,) [m], and how far ahead of the laser [m]."""

    centre: NDArray[np.float64]
    side: DoorSide
    ahead: float
    along: float
    door: DetectedDoor


@dataclass
class _Track:
    """Sightings that are of one door, in the order of the views."""

    sightings: list[_DoorInView]

    def shows(self, other: _DoorInView) -> bool:
        """True if another sighting is of this door: by the last one, as the odometer drifts."""
        last = self.sightings[-1]
        return last.side is other.side and math.dist(last.centre, other.centre) < SAME

    @property
    def door(self) -> PathDoor:
        """The door, as the nearest view tells; as wide as any tells, since what hides some of it makes it narrower."""
        nearest = min(self.sightings, key=lambda one: abs(one.ahead))
        width = max(one.door.width for one in self.sightings)
        return PathDoor(nearest.along, nearest.side, width, nearest.door.passable)


def _doors_in(views: Sequence[View]) -> Iterator[_DoorInView]:
    for view, pose, along in zip(views, reckoned_poses(views), way_along(views).tolist(), strict=True):
        for door in find_doors(view.scan, LANDMARK) if view.scan is not None else ():
            side = _side(door)
            if side is not None and door.distance < NEAR:
                yield _DoorInView(in_world(door.centre, pose), side, door.centre[0], along + door.centre[0], door)


def _side(door: DetectedDoor) -> DoorSide | None:
    """Where a door is; None for one behind, and for one that lies ahead, but not on the way."""
    if abs(door.heading) > 3 * math.pi / 4:
        return None
    if abs(door.heading) >= math.pi / 4:
        return DoorSide.LEFT if door.heading > 0 else DoorSide.RIGHT
    return DoorSide.AHEAD if abs(door.centre[1]) < door.width / 2 else None
