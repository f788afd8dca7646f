"""The shape of a grown-up: five skins over rings, trunk with head, arms and legs, and the clothes painted on them.

Lengths are those of somebody of ``HEIGHT`` who looks along x, taken by eye from tables of body measures (choices);
others are scaled.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.random import Generator

from refseq_bench.worlds.arrays import Floats
from refseq_bench.worlds.parts.facets import Facets, grid
from refseq_bench.worlds.parts.greyscale import Image, cloud, encode

HEIGHT = 1.74
"""Height of the figure before it is scaled [m]."""
HIP, SHOULDER = 0.9, 1.41
"""Heights about which legs and arms swing [m]."""
SIDES = 16
"""Corners of a ring."""
SHEET = (348, 128)
"""Rows and columns of a painted picture: 5 mm of height a row."""
STRIPS = (0.0, 0.5), (0.5, 0.75), (0.75, 1.0)
"""Where trunk, arms and legs are in it, as shares of its width."""
HAIR_LINES = (1.695, 1.68, 1.62, 1.55, 1.52), (1.69, 1.67, 1.6, 1.52, 1.42), (1.705, 1.7, 1.65, 1.58, 1.54)
"""Lower edge of the hair [m], from the forehead to the back of the head."""

Ring = tuple[float, float, float, float, float]
"""An ellipse: height, centre x and y, half depth along x and half width along y [m]."""

TRUNK: tuple[Ring, ...] = (
    (0.79, 0.0, 0.0, 0.001, 0.001),
    (0.80, 0.0, 0.0, 0.06, 0.09),
    (0.86, -0.005, 0.0, 0.105, 0.165),
    (0.95, -0.005, 0.0, 0.112, 0.172),
    (1.05, 0.0, 0.0, 0.098, 0.15),
    (1.18, 0.005, 0.0, 0.108, 0.156),
    (1.30, 0.005, 0.0, 0.118, 0.168),
    (1.37, -0.005, 0.0, 0.108, 0.175),
    (1.41, -0.01, 0.0, 0.094, 0.166),
    (1.44, -0.01, 0.0, 0.08, 0.128),
    (1.465, -0.01, 0.0, 0.07, 0.086),
    (1.485, -0.005, 0.0, 0.064, 0.066),
    (1.51, 0.005, 0.0, 0.06, 0.059),
    (1.53, 0.03, 0.0, 0.07, 0.057),
    (1.555, 0.033, 0.0, 0.086, 0.065),
    (1.61, 0.026, 0.0, 0.097, 0.073),
    (1.66, 0.018, 0.0, 0.1, 0.077),
    (1.70, 0.012, 0.0, 0.09, 0.069),
    (1.725, 0.008, 0.0, 0.066, 0.049),
    (1.738, 0.004, 0.0, 0.03, 0.022),
    (1.74, 0.004, 0.0, 0.001, 0.001),
)
ARM: tuple[Ring, ...] = (
    (0.69, 0.06, 0.195, 0.001, 0.001),
    (0.70, 0.06, 0.195, 0.02, 0.011),
    (0.76, 0.06, 0.197, 0.038, 0.018),
    (0.83, 0.052, 0.198, 0.038, 0.021),
    (0.87, 0.044, 0.198, 0.028, 0.025),
    (0.875, 0.042, 0.198, 0.035, 0.031),
    (1.00, 0.015, 0.197, 0.04, 0.036),
    (1.12, -0.008, 0.195, 0.044, 0.04),
    (1.20, -0.01, 0.19, 0.046, 0.043),
    (1.33, -0.01, 0.18, 0.053, 0.047),
    (1.38, -0.01, 0.172, 0.05, 0.046),
    (1.41, -0.01, 0.16, 0.042, 0.04),
    (1.43, -0.01, 0.145, 0.026, 0.026),
    (1.435, -0.01, 0.14, 0.001, 0.001),
)
LEG: tuple[Ring, ...] = (
    (0.0, 0.06, 0.1, 0.001, 0.001),
    (0.001, 0.06, 0.1, 0.13, 0.044),
    (0.03, 0.06, 0.1, 0.132, 0.047),
    (0.06, 0.035, 0.1, 0.1, 0.045),
    (0.085, 0.008, 0.1, 0.062, 0.046),
    (0.09, 0.0, 0.1, 0.064, 0.054),
    (0.20, -0.008, 0.098, 0.058, 0.052),
    (0.34, -0.012, 0.095, 0.062, 0.055),
    (0.42, 0.0, 0.094, 0.062, 0.056),
    (0.50, 0.008, 0.092, 0.064, 0.06),
    (0.62, 0.006, 0.092, 0.075, 0.07),
    (0.76, 0.0, 0.09, 0.087, 0.08),
    (0.87, -0.005, 0.085, 0.09, 0.082),
    (0.93, -0.005, 0.08, 0.06, 0.06),
    (0.94, -0.005, 0.08, 0.001, 0.001),
)


@dataclass(frozen=True, slots=True)
class BodyPart:
    """A part of the figure: its skin, and how it moves.

    It swings about a line across at ``pivot`` (y, z) [m], by ``swing`` times a leg's angle; its clothes are painted on
    the columns ``strip`` of the picture, as shares of its width.
    """

    name: str
    rings: tuple[Ring, ...]
    pivot: tuple[float, float]
    swing: float
    strip: tuple[float, float]


def _mirrored(rings: tuple[Ring, ...]) -> tuple[Ring, ...]:
    return tuple((z, x, -y, depth, width) for z, x, y, depth, width in rings)


PARTS = (
    BodyPart("trunk", TRUNK, (0.0, 0.0), 0.0, STRIPS[0]),
    BodyPart("left-arm", ARM, (0.17, SHOULDER), -0.8, STRIPS[1]),
    BodyPart("right-arm", _mirrored(ARM), (-0.17, SHOULDER), 0.8, STRIPS[1]),
    BodyPart("left-leg", LEG, (0.09, HIP), 1.0, STRIPS[2]),
    BodyPart("right-leg", _mirrored(LEG), (-0.09, HIP), -1.0, STRIPS[2]),
)


def skin(part: BodyPart, height: float) -> Facets:
    """Stretch a part's skin over its rings, for somebody of ``height`` [m]; points are counted from its pivot."""
    z, x, y, depth, width = (np.array(column)[:, None] for column in zip(*part.rings, strict=True))
    angle = np.linspace(-np.pi, np.pi, SIDES + 1)[None, :]  # the seam is at the back
    points = np.stack(np.broadcast_arrays(x + depth * np.cos(angle), y + width * np.sin(angle), z), axis=2)
    around = np.stack(np.broadcast_arrays(-depth * np.sin(angle), width * np.cos(angle), 0.0 * z), axis=2)
    normals = np.cross(around, np.gradient(points, axis=0))
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    columns = part.strip[0] + (part.strip[1] - part.strip[0]) * np.linspace(0.01, 0.99, SIDES + 1)[None, :]
    uv = np.stack(np.broadcast_arrays(columns, z / HEIGHT), axis=2)
    sheet = grid((points - np.array([0.0, *part.pivot])) * height / HEIGHT, uv)
    return replace(sheet, normals=normals.reshape(-1, 3))


# --- clothes ---


def clothes(albedo: float, rng: Generator) -> Image:
    """Paint somebody: a top of ``albedo``, trousers, shoes, hair and skin, unrolled; a row is a height."""
    rows, columns = SHEET
    trousers, shoes, face = rng.choice([0.04, 0.08, 0.15, 0.3]), rng.choice([0.03, 0.06, 0.4]), rng.uniform(0.25, 0.45)
    field = np.full(SHEET, albedo)
    trunk, arm, leg = (field[:, round(a * columns) : round(b * columns)] for a, b in STRIPS)
    if rng.random() < 0.5:
        _open_jacket(trunk, rng.uniform(0.4, 0.75))
    trunk[_rows(0.0, 0.97)] = leg[:] = trousers
    trunk[_rows(0.96, 0.99)] = 0.05
    field *= 1.0 + 0.12 * cv2.resize(cloud((rows // 4, columns), rng, coarsest=6), (columns, rows))
    trunk[_rows(1.485, HEIGHT)] = face
    arm[_rows(0.0, rng.choice([0.875, 1.2], p=[0.7, 0.3]))] = face
    leg[_rows(0.0, 0.09)] = shoes
    _features(trunk)
    _hair(trunk, rng.choice([0.03, 0.07, 0.2]), HAIR_LINES[rng.integers(len(HAIR_LINES))])
    return encode(np.clip(field, 0.01, 0.9), rng)


def _rows(low: float, high: float) -> slice:
    """Rows of the picture between two heights [m]."""
    return slice(round(SHEET[0] * (1.0 - high / HEIGHT)), round(SHEET[0] * (1.0 - low / HEIGHT)))


def _turn(trunk: Floats) -> Floats:
    """Angle of each column of the trunk away from ahead [rad]."""
    return np.abs(np.linspace(-np.pi, np.pi, trunk.shape[1]))


def _open_jacket(trunk: Floats, shirt: float) -> None:
    """Let a shirt show in front, wider towards the neck."""
    heights = HEIGHT * (1.0 - np.arange(SHEET[0]) / SHEET[0])[:, None]
    trunk[_turn(trunk) < np.interp(heights, [1.0, 1.15, 1.47], [0.05, 0.1, 0.6])] = shirt


def _features(trunk: Floats) -> None:
    """Paint eyes with brows, the shade below the chin, and a mouth."""
    ahead, turn = np.linspace(-np.pi, np.pi, trunk.shape[1]), _turn(trunk)
    for eye in (-0.42, 0.42):
        trunk[_rows(1.618, 1.632), np.abs(ahead - eye) < 0.16] *= 0.35
        trunk[_rows(1.64, 1.648), np.abs(ahead - eye) < 0.22] *= 0.5
    trunk[_rows(1.558, 1.566), turn < 0.3] *= 0.55
    trunk[_rows(1.485, 1.53)] *= 0.8


def _hair(trunk: Floats, hair: float, line: tuple[float, ...]) -> None:
    """Paint hair above a line of heights, given at 0, 50, 75, 110 and 180° from ahead."""
    low = np.interp(_turn(trunk), np.radians([0, 50, 75, 110, 180]), line)
    heights = HEIGHT * (1.0 - np.arange(SHEET[0]) / SHEET[0])[:, None]
    trunk[heights > low] = hair
