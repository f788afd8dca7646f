"""A floor plan under a map's paths: the similarity between the map's metres and the picture's pixels, by marked places.

A picture's y runs down and the map's runs up, so that the one is a mirror image of the other. With the y of pixels
negated both are of one side. As complex numbers, z = x + iy of a place [m] and q = u - iv of its pixel (u, v), a scale,
a turn and a shift are then

    q = c z + t,    c = scale · exp(i · turn) [pixels a metre].

Over all marks |q - c z - t|² is least for c = Σ (q - q̄) conj(z - z̄) / Σ |z - z̄|² and t = q̄ - c z̄ (Umeyama 1991, in
the plane and of a known side). Two places would fix it; each more tells how well the map lies on the picture.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from refseq.errors import MapError
from refseq.logs.pictures.source import FilePicture
from refseq.map.map import Map
from refseq.planar import Pose
from refseq_bench.scenarios.errors import ScenarioError

LEAST = 3
"""Marked places: with two every fit is exact, and nothing would tell of a wrong one."""
APART = 1.0
"""Marks reach over so much at least [m]; over less, an error of a decimetre turns the plan by 6° and more."""
ASTRAY = 0.25
"""A mark that is off by a larger share of what all reach over is no error of the map's, but of a pixel's or a place's.

Marks whose y was counted from the bottom are off by more, unless they lie near one line.
"""

NUMBER = r"\s*(-?[0-9]+(?:\.[0-9]+)?)\s*"
MARK = re.compile(rf"(.+)={NUMBER},{NUMBER}", re.DOTALL)


@dataclass(frozen=True, slots=True)
class FloorMark:
    """A place, counted through its map, and the pixel (``x``, ``y``) that it lies at, from the top left.

    ``name`` is what the place was called, its number or PATH:VIEW.
    """

    name: str
    place: int
    x: float
    y: float

    @property
    def option(self) -> str:
        """The mark as it is typed."""
        return f"--at {self.name}={self.x:g},{self.y:g}"


@dataclass(frozen=True, slots=True)
class FloorFit:
    """Similarity from a map's frame to the pixels of a picture.

    ``turn`` [rad] is the direction in the picture, counter-clockwise from its right, that the map's x axis has;
    ``origin`` the pixel (x, y) that the map's origin lies at. ``off`` (n,) [m] are the distances between the pixels of
    the marks and where their places are laid.
    """

    metres_a_pixel: float
    turn: float
    origin: tuple[float, float]
    off: tuple[float, ...]

    def pixels(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Pixels (n, 2) of points of the map (n, 2) [m]."""
        c = np.exp(1j * self.turn) / self.metres_a_pixel
        q = c * (points[:, 0] + 1j * points[:, 1]) + complex(self.origin[0], -self.origin[1])
        return np.stack([q.real, -q.imag], axis=1)


@dataclass(frozen=True, eq=False)
class LaidFloor:
    """A floor plan's grey ``picture`` (height, width), the places marked on it and how they fit."""

    picture: NDArray[np.uint8]
    marks: tuple[FloorMark, ...]
    fit: FloorFit

    @property
    def told(self) -> str:
        """The scale and the worst mark, in a line."""
        worst = int(np.argmax(self.fit.off))
        scale = float(f"{1000 * self.fit.metres_a_pixel:.3g}")  # three digits, and none of them as a power of ten
        off = f"points off by {self.fit.off[worst]:.2f} m at most (place {self.marks[worst].name})"
        return f"floor plan: {scale:.15g} mm a pixel, {off}"


def check_asked(floor: Path | None, at: Sequence[str]) -> None:
    """Raise ``ScenarioError`` for a floor plan without enough marked places, or marks without a floor plan."""
    if floor is None and at:
        raise ScenarioError(f"--at {at[0]}: marks a place on the picture of --floor; valid is to name that as well")
    if floor is not None and len(at) < LEAST:
        raise ScenarioError(
            f"--floor {floor}: {len(at)} marked on it; valid are {LEAST} places or more, each by --at PLACE=X,Y"
        )


def lay_floor(file: Path, at: Sequence[str], map_: Map) -> LaidFloor:
    """Read the picture of a floor plan, and lay a map that has a plan on it by places marked PLACE=X,Y.

    Raises ``LogError`` for a file that is no picture, ``ScenarioError`` for marks that are none or do not fit.
    """
    picture = FilePicture(file, width=0).decode()
    if picture.min() == picture.max():
        raise ScenarioError(f"{file}: shows nothing; valid is a picture with lines, without transparency")
    marks = tuple(_mark(text, map_) for text in at)
    _check_on_picture(marks, picture)
    _check_distinct(marks)
    points = np.array([(pose.x, pose.y) for pose in (_pose(mark, map_) for mark in marks)])
    return LaidFloor(picture, marks, _checked_fit(points, marks))


def fit_floor(points: NDArray[np.float64], pixels: NDArray[np.float64]) -> FloorFit:
    """The similarity with the least squared errors [pixels] from points of a map (n, 2) [m] to pixels (n, 2)."""
    z, q = points[:, 0] + 1j * points[:, 1], pixels[:, 0] - 1j * pixels[:, 1]
    from_middle = z - z.mean()
    c = complex(np.vdot(from_middle, q - q.mean()) / np.vdot(from_middle, from_middle).real)
    t = complex(q.mean() - c * z.mean())
    scale = max(abs(c), 1e-9)  # marks that fit no turn at all are very far off
    off = np.abs(q - c * z - t) / scale
    return FloorFit(1 / scale, float(np.angle(c)), (t.real, -t.imag), tuple(off.tolist()))


def _checked_fit(points: NDArray[np.float64], marks: Sequence[FloorMark]) -> FloorFit:
    """The fit of marks. Raises ``ScenarioError`` where places lie at one spot, or their pixels fit no similarity."""
    reach = float(np.linalg.norm(points[:, None] - points, axis=2).max())
    if reach < APART:
        raise ScenarioError(
            f"--at: the {len(marks)} places lie within {reach:.2f} m of each other; valid are some that lie "
            f"{APART:g} m apart and more"
        )
    fit = fit_floor(points, np.array([(mark.x, mark.y) for mark in marks]))
    worst = int(np.argmax(fit.off))
    if fit.off[worst] > ASTRAY * reach:
        raise ScenarioError(
            f"{marks[worst].option}: no scale and turn of the floor plan fits the {len(marks)} points, this one least; "
            "valid are the pixels of these very places, y counted from the top, on a plan that is not mirrored"
        )
    return fit


def _mark(text: str, map_: Map) -> FloorMark:
    found = MARK.fullmatch(text)
    if found is None:
        raise ScenarioError(f"--at {text}: is no place and its pixel; valid is PLACE=X,Y, as 57=800,335")
    try:
        return FloorMark(found[1], _place(found[1], map_), float(found[2]), float(found[3]))
    except MapError as error:
        raise ScenarioError(f"--at {text}: {error}") from error


def _place(name: str, map_: Map) -> int:
    """A place by its number, counted through, or by PATH:VIEW. Raises ``MapError``."""
    if ":" in name:
        from refseq.atlas.routes import place_of  # its graphs take a tenth of a second to import

        return place_of(map_, name)
    if not re.fullmatch("[0-9]{1,9}", name) or int(name) >= len(map_):
        raise MapError(
            f"place {name!r} is unknown; valid are 0 to {len(map_) - 1}, or a path and a view of it: "
            f"{map_.paths[0].name}:0"
        )
    return int(name)


def _pose(mark: FloorMark, map_: Map) -> Pose:
    pose = map_.joined_poses[mark.place]
    if pose is None:
        laid = ", ".join(path.name for path in map_.paths if len(path.poses))
        raise ScenarioError(f"{mark.option}: is a place of a path that is not joined; valid are those of {laid}")
    return pose


def _check_on_picture(marks: Sequence[FloorMark], picture: NDArray[np.uint8]) -> None:
    height, width = picture.shape
    for mark in marks:
        if not (0 <= mark.x <= width - 1 and 0 <= mark.y <= height - 1):
            raise ScenarioError(
                f"{mark.option}: lies outside of the floor plan; valid are 0 to {width - 1} from the left and 0 to "
                f"{height - 1} from the top"
            )


def _check_distinct(marks: Sequence[FloorMark]) -> None:
    for number, one in enumerate(marks):
        for other in marks[:number]:
            if one.place == other.place:
                raise ScenarioError(f"{one.option}: is the place of {other.option}; valid is each place once")
            if (one.x, one.y) == (other.x, other.y):
                raise ScenarioError(f"{one.option}: is the pixel of {other.option}; valid is another pixel a place")
