"""Parked cars: a hull that is seen, touched and scanned, and all that is not paint as a second mesh.

A kind of car is a row of cross-sections, which are skinned; glass lies on the skin between some of them. The sizes are
choices, after common cars of the years around 2000.
"""

from dataclasses import dataclass
from itertools import pairwise
from types import MappingProxyType
from typing import Any

import numpy as np

from refseq_bench.worlds.arrays import Floats, Span
from refseq_bench.worlds.parts import scenery
from refseq_bench.worlds.parts.facets import Facets, add_mesh, fan, joined, quad
from refseq_bench.worlds.parts.greyscale import Image
from refseq_bench.worlds.parts.scenery import ATLAS
from refseq_bench.worlds.parts.site import SEEN, Site
from refseq_bench.worlds.plans.frame import LocalFrame
from refseq_bench.worlds.plans.schema import Car, FloorPlan, Material

PROUD = 0.006
"""Distance by which glass, lamps and plates stand out from the hull [m]."""
WHEEL, TYRE, ARCH = 0.30, 0.18, 0.36
"""Radius and width of a wheel, and radius of the dark opening around it [m]."""
RIM_POINTS = 14
"""Corners of a wheel."""
CLEARANCE = 0.2
"""Height of a car's floor above the ground [m]."""
SHADED = 0.12
"""Length that the shade under a car goes on beyond it [m]."""
TRIM = Material(albedo=0.05, roughness=1.0)
PAINT_ROUGHNESS = 0.35

Section = tuple[float, float, float, float, float, float]
"""x, then heights of sill, belt line and top, then half widths at the belt line and at the top [m]."""


@dataclass(frozen=True, slots=True)
class CarBody:
    """Cross-sections from the rear to the front, and what of the skin is glass.

    ``sides`` and ``tops`` count the stretches between sections; ``axles`` are where the wheels are along x [m].
    """

    sections: tuple[Section, ...]
    sides: tuple[int, ...]
    tops: tuple[int, ...]
    axles: tuple[float, float]

    @property
    def length(self) -> float:
        """From end to end [m]."""
        return self.sections[-1][0] - self.sections[0][0]

    @property
    def half_width(self) -> float:
        """Half the width of the hull [m]."""
        return max(s[4] for s in self.sections)


CARS = MappingProxyType(
    {
        "hatchback": CarBody(
            (
                (-1.95, 0.34, 0.84, 0.88, 0.74, 0.62),
                (-1.86, 0.22, 0.92, 0.98, 0.82, 0.63),
                (-1.45, 0.20, 0.93, 1.41, 0.83, 0.56),
                (-0.55, 0.20, 0.92, 1.46, 0.83, 0.56),
                (0.25, 0.20, 0.91, 1.44, 0.83, 0.56),
                (1.00, 0.20, 0.88, 0.96, 0.83, 0.66),
                (1.72, 0.20, 0.76, 0.81, 0.81, 0.62),
                (1.95, 0.30, 0.62, 0.67, 0.70, 0.54),
            ),
            sides=(2, 3, 4),
            tops=(1, 4),
            axles=(-1.2, 1.25),
        ),
        "saloon": CarBody(
            (
                (-2.20, 0.34, 0.84, 0.88, 0.74, 0.62),
                (-2.10, 0.22, 0.91, 0.96, 0.84, 0.67),
                (-1.52, 0.20, 0.93, 1.00, 0.86, 0.68),
                (-0.90, 0.20, 0.93, 1.38, 0.86, 0.57),
                (-0.25, 0.20, 0.92, 1.43, 0.86, 0.57),
                (0.35, 0.20, 0.91, 1.41, 0.86, 0.57),
                (1.10, 0.20, 0.88, 0.96, 0.86, 0.68),
                (1.95, 0.20, 0.74, 0.79, 0.84, 0.64),
                (2.20, 0.30, 0.60, 0.65, 0.73, 0.56),
            ),
            sides=(3, 4, 5),
            tops=(2, 5),
            axles=(-1.3, 1.35),
        ),
        "van": CarBody(
            (
                (-2.25, 0.32, 1.02, 1.80, 0.82, 0.72),
                (-2.17, 0.22, 1.02, 1.92, 0.88, 0.76),
                (0.10, 0.20, 1.02, 1.97, 0.90, 0.76),
                (0.80, 0.20, 1.01, 1.93, 0.90, 0.75),
                (1.45, 0.20, 0.98, 1.10, 0.89, 0.74),
                (2.05, 0.20, 0.84, 0.90, 0.86, 0.68),
                (2.25, 0.30, 0.68, 0.73, 0.76, 0.60),
            ),
            sides=(2, 3),
            tops=(3,),
            axles=(-1.35, 1.4),
        ),
    }
)


def park_cars(site: Site, plan: FloorPlan) -> None:
    """Put every car of the plan on its place."""
    ground = plan.material[plan.floor.material].albedo
    for name in sorted({car.kind for car in plan.car}):
        add_mesh(site, f"{name}:hull", hull(CARS[name]))
        add_mesh(site, f"{name}:trim", trim(CARS[name]))
    for car in plan.car:
        _park(site, car, ground)


def _park(site: Site, car: Car, ground: float) -> None:
    key, kind = f"car:{car.name}", CARS[car.kind]
    site.plain(key, Material(albedo=car.albedo, roughness=PAINT_ROUGHNESS))

    def draw() -> Image:
        shade = scenery.shade_under((kind.length, 2 * kind.half_width), CLEARANCE, SHADED, ground)
        return scenery.car_atlas(shade, site.rng(key))

    site.picture(f"{key}:trim", draw, TRIM)
    place: dict[str, Any] = {"pos": [*car.at, 0.0], "quat": LocalFrame.under(car).box_quat}
    site.meshed(key, f"{car.kind}:hull", key, **place)
    site.meshed(f"{key}:trim", f"{car.kind}:trim", f"{key}:trim", SEEN, castshadow=True, **place)


# --- the hull ---


def _ring(section: Section) -> Floats:
    """Outline of a cross-section, (10, 3), counter-clockwise as seen from the front."""
    x, sill, belt, top, wide, narrow = section
    edge = min(0.05, (top - belt) / 2)
    right = np.array(
        [
            (x, -0.93 * wide, sill),
            (x, -wide, 0.55 * (sill + belt)),
            (x, -0.97 * wide, belt),
            (x, -narrow - 0.2 * edge, top - edge),
            (x, -narrow + 0.10, top),
        ]
    )
    return np.vstack([right[0], right * [1.0, -1.0, 1.0], right[:0:-1]])


def _rail(section: Section) -> Floats:
    """Belt line and roof edge of a section's right side, (2, 3)."""
    return _ring(section)[[8, 7]]


def hull(kind: CarBody) -> Facets:
    """Skin the sections and close both ends."""
    rings = np.array([_ring(s) for s in kind.sections])  # (sections, points, 3)
    sections, points = rings.shape[:2]
    i, j = (a.ravel() for a in np.meshgrid(np.arange(sections - 1), np.arange(points), indexing="ij"))
    a, b = i * points + j, i * points + (j + 1) % points
    skin = np.concatenate([np.stack([a, b, b + points], axis=1), np.stack([a, b + points, a + points], axis=1)])
    corners = rings.reshape(-1, 3)
    # Neighbouring facets share their corners: MuJoCo smooths the shading between them where they are nearly flat.
    ends = [fan(ring, np.zeros((points, 2))) for ring in (rings[0][::-1], rings[-1])]
    return joined([Facets(corners, np.zeros((len(corners), 2)), skin), *ends])


# --- what is not paint ---


def trim(kind: CarBody) -> Facets:
    """Glass, wheels, lamps, bumpers, plates, and the shade on the ground, over one picture."""
    right = [_side_glass(kind, i) for i in kind.sides]
    right += [part for x in kind.axles for part in _wheel(x, kind.half_width)]
    right += [part for a, b in pairwise(kind.sections[1:-1]) for part in (_strip(a, b), _sill(a, b))]
    parts = [*right, *(p.mirrored() for p in right), *(_top_glass(kind, i) for i in kind.tops)]
    return joined([*parts, *_end(kind, front=False), *_end(kind, front=True), _shade(kind)])


def _side_glass(kind: CarBody, i: int) -> Facets:
    """The right-hand pane between sections ``i`` and ``i + 1``, and between belt line and roof."""
    return _pane(_rail(kind.sections[i]), _rail(kind.sections[i + 1]), (0.04, 0.96), (0.10, 0.88))


def _strip(a: Section, b: Section) -> Facets:
    """A dark strip along the right side where the car is widest."""
    corners = [_ring(s)[9] + [0.0, -PROUD, z] for s, z in ((a, -0.035), (b, -0.035), (b, 0.035), (a, 0.035))]
    return quad(corners, ATLAS["dark"])


def _sill(a: Section, b: Section) -> Facets:
    """Dark plastic along the right side's lower edge, which hides the floor."""
    start, end = (_ring(s)[[0, 9]] for s in (a, b))
    return _pane(start, end, (0.0, 1.0), (-0.05, 0.25), "dark")


def _top_glass(kind: CarBody, i: int) -> Facets:
    """The pane across the car between sections ``i`` and ``i + 1``: windscreen or rear window."""
    falls = kind.sections[i][3] > kind.sections[i + 1][3]
    lower, upper = (i + 1, i) if falls else (i, i + 1)
    right = np.array([_ring(kind.sections[j])[6] for j in (lower, upper)])
    left = right * [1.0, -1.0, 1.0]
    return _pane(*((right, left) if falls else (left, right)), (0.06, 0.94), (0.08, 0.92))


def _pane(start: Floats, end: Floats, across: Span, up: Span, part: str = "glass") -> Facets:
    """Glass, or another ``part`` of the picture, over a part of the quad between two edges.

    Edges are (2, 3), each from its lower to its upper end.
    """

    def at(s: float, t: float) -> Floats:
        low, high = (1 - s) * start[0] + s * end[0], (1 - s) * start[1] + s * end[1]
        return (1 - t) * low + t * high

    corners = np.array([at(across[0], up[0]), at(across[1], up[0]), at(across[1], up[1]), at(across[0], up[1])])
    out = np.cross(corners[2] - corners[0], corners[3] - corners[1])
    return quad(corners + PROUD * out / np.linalg.norm(out), ATLAS[part])


def _wheel(x: float, y: float) -> list[Facets]:
    """A wheel on the right: its face, its tread, and the dark opening behind it."""
    angle = np.linspace(0, 2 * np.pi, RIM_POINTS, endpoint=False)
    circle = np.stack([np.cos(angle), np.zeros(RIM_POINTS), np.sin(angle)], axis=1)
    middle = np.array([x, 0.0, WHEEL])
    face = middle + WHEEL * circle - [0, y + 0.012, 0]
    behind = face + np.array([0.0, TYRE, 0.0])
    left, bottom, right, top = ATLAS["wheel"]
    round_uv = np.array([left, bottom]) + (circle[:, ::2] + 1) / 2 * [right - left, top - bottom]
    dark = np.tile(_middle_of("dark"), (RIM_POINTS, 1))
    tread = [
        quad([face[i - 1], behind[i - 1], behind[i], face[i]], (*_middle_of("dark"), *_middle_of("dark")))
        for i in range(RIM_POINTS)
    ]
    opening = np.maximum(middle + ARCH * circle - [0, y + 0.004, 0], [-np.inf, -np.inf, CLEARANCE])
    return [fan(face, round_uv), *tread, fan(opening, dark)]


def _middle_of(part: str) -> tuple[float, float]:
    left, bottom, right, top = ATLAS[part]
    return (left + right) / 2, (bottom + top) / 2


def _end(kind: CarBody, front: bool) -> list[Facets]:
    """Lamps, bumper and number plate at one end."""
    section = kind.sections[-1 if front else 0]
    x = section[0] + (PROUD if front else -PROUD)
    side, wide = (1.0 if front else -1.0), section[4]
    sill, belt = section[1], section[2]
    lamp, lamp_size = ("head", (0.26, 0.13)) if front else ("tail", (0.15, 0.26))

    def upright(y: float, z: float, width: float, height: float, part: str) -> Facets:
        a, b = y - side * width / 2, y + side * width / 2
        low, high = z - height / 2, z + height / 2
        return quad([(x, a, low), (x, b, low), (x, b, high), (x, a, high)], ATLAS[part])

    lamps = [
        upright(s * (wide - 0.04 - lamp_size[0] / 2), belt - 0.02 - lamp_size[1] / 2, *lamp_size, lamp) for s in (-1, 1)
    ]
    bumper = upright(0.0, sill + 0.05, 1.9 * wide, 0.16, "dark")
    return [*lamps, bumper, upright(0.0, sill + 0.20, 0.52, 0.11, "plate")]


def _shade(kind: CarBody) -> Facets:
    a, b, z = kind.length / 2 + SHADED, kind.half_width + SHADED, 0.009
    return quad([(-a, -b, z), (a, -b, z), (a, b, z), (-a, b, z)], ATLAS["shade"])
