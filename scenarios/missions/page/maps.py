"""Maps that the page offers, and their drawings."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from refseq.logs.notes import NOTES
from refseq.map.map import Map, MapFrame
from refseq.map.paths.path import MapPath
from refseq_bench.scenarios.driven_plan import driven_plan
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.missions.map_world import check_world
from refseq_bench.worlds.drawing.outline import outline_of
from refseq_bench.worlds.plans.load import load_plan

ENDING = ".refseq"
APART = 3.0
"""Distance between the straight lines as which paths are drawn whose places nobody knows [m]."""
TOLD = ("world", "light", "robot", "seed", NOTES)
"""Metadata that the page shows."""


@dataclass
class MapShelf:
    """The maps of a folder, or a single one; the last that was read is kept."""

    place: Path
    _kept: tuple[Path, tuple[int, int, int], Map] | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        if not self.files():
            raise ScenarioError(f"{self.place}: holds no map; valid is a map ({ENDING}), or a folder with some")

    def files(self) -> dict[str, Path]:
        """Files by the names that the page calls them."""
        found = [self.place] if self.place.is_file() else self.place.glob(f"*{ENDING}")
        return {path.name: path for path in sorted(found) if path.suffix == ENDING and path.is_file()}

    def listed(self) -> list[dict[str, Any]]:
        """Names and sizes, for the page."""
        return [{"name": name, "bytes": path.stat().st_size} for name, path in self.files().items()]

    def load(self, name: object) -> Map:
        """Read a map by its name on the page. Raises ``ScenarioError``, ``MapError``."""
        files = self.files()
        path = files.get(name) if isinstance(name, str) else None
        if path is None:
            raise ScenarioError(f"map {name!r:.80} is not here; valid are {', '.join(files)}")
        try:
            told = path.stat()
        except OSError as error:
            raise ScenarioError(f"{path}: cannot be read: {error.strerror}") from None
        written = told.st_mtime_ns, told.st_size, told.st_ino
        kept = self._kept
        if kept is None or kept[:2] != (path, written):
            kept = self._kept = path, written, Map.load(path)
        return kept[2]  # another page may have had another one read by now


def drawn_map(map_: Map, world: str | None = None) -> dict[str, Any]:
    """A map as the page draws it: its paths with their places and doors, walls where the world is known, facts.

    ``world`` is the one that missions are run in, None: the map's. ``refused`` says why none can be.
    """
    points = place_points(map_)
    return {
        "paths": [_path(map_, path, points) for path in map_.paths],
        "places": _rounded(points),
        "outline": [_rounded(line) for line in _outline(map_, world)],
        "told": {key: map_.metadata[key] for key in TOLD if key in map_.metadata},
        "sensors": sorted(map_.sensors),
        "refused": "" if world is not None else _refused(map_),
    }


def place_points(map_: Map) -> NDArray[np.float64]:
    """A point for each place, (K, 2) [m]: where it is; else on a straight line for each path."""
    poses = map_.places_in_frame
    if map_.frame is not MapFrame.NONE and all(pose is not None for pose in poses):
        return np.array([(pose.x, pose.y) for pose in poses if pose is not None]).reshape(-1, 2)
    points = np.zeros((len(map_), 2))
    for number, path in reversed(list(enumerate(map_.paths))):
        points[map_.numbered(path)] = np.stack([path.along, np.full(len(path), -APART * number)], axis=1)
    return points


def _path(map_: Map, path: MapPath, points: NDArray[np.float64]) -> dict[str, Any]:
    places = map_.numbered(path)
    doors = path.annotations.doors
    at = [[float(np.interp(door.along, path.along, points[places, axis])) for axis in (0, 1)] for door in doors]
    return {
        "name": path.name,
        "places": places.tolist(),
        "length": round(float(path.along[-1]), 2),
        "doors": [
            {
                "x": round(x, 2),
                "y": round(y, 2),
                "along": round(door.along, 1),
                "beside": door.beside,
                "open": door.passable,
            }
            for (x, y), door in zip(at, doors, strict=True)
        ],
    }


def _outline(map_: Map, world: str | None) -> Sequence[NDArray[np.float64]]:
    plan = driven_plan(map_.sequences[0].metadata) if world is None else load_plan(world)
    return () if plan is None or map_.frame is not MapFrame.TRUTH else outline_of(plan)


def _refused(map_: Map) -> str:
    """Reason that no mission can be run where the map was learnt, and what to do; empty where one can."""
    try:
        check_world(map_, "refseq mission page MAP --world")
    except ScenarioError as error:
        return str(error)
    return ""


def _rounded(points: NDArray[np.float64]) -> list[list[float]]:
    found: list[list[float]] = np.round(points, 2).tolist()
    return found
