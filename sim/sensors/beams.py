"""Where the beams of a LMS 200 in half-degree mode look while the robot moves, and what they meet.

The mirror makes two turns a scan. The first measures at every whole degree, the second half a degree beside them, so
that neighbours in a scan are a turn apart in time. A beam is a narrow cone: seven rays stand for it.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from refseq_bench.sim.sensors.ray_scene import RayScene

BEAMS = 361
START, STEP = -np.pi / 2, np.pi / 360
TURN_TIME = 1 / 75
"""Time of one turn of the mirror [s]; half of it the mirror looks backwards, into the box."""
DIVERGENCE, EXIT_DIAMETER = 0.0044, 0.008
"""The spot's diameter is that at the exit [m], and grows with the distance by the divergence [rad]."""

SEEN_GROUPS = np.array([1, 1, 0, 1, 0, 0], np.uint8)
"""Geom groups that stop a beam: not 2 (only seen by cameras), 4 (panes of glass) and 5 (inner masses)."""
GLASS_GROUPS = np.array([0, 0, 0, 0, 1, 0], np.uint8)

_CORNERS = np.arctan(np.sqrt(3) / 9) + np.arange(6) * np.pi / 3
_RING = np.sqrt((1 / 7 + 1) / 2) * np.stack([np.cos(_CORNERS), np.sin(_CORNERS)], axis=1)
SPOT = np.concatenate([np.zeros((1, 2)), _RING])
"""Rays of a beam, across and up in radii of its spot, (7, 2): one in the middle, six in the ring of the other 6/7 area.

The hexagon is turned until the seven lie at even steps across the beam: an upright edge takes them one by one."""
_FIRING_ORDER = np.concatenate([np.arange(0, BEAMS, 2), np.arange(1, BEAMS, 2)])
_SPLIT = np.array_split(_FIRING_ORDER, 8)
_ORIGINS = np.array([part[len(part) // 2] for part in _SPLIT])
_PARTS = np.stack([np.pad(part, (0, len(_SPLIT[0]) - len(part)), mode="edge") for part in _SPLIT])
"""Beams cast together, (parts, beams), from where one of them leaves: all do within 1.7 ms, in which a robot of 0.5 m/s
moves 0.8 mm. The last beam of a part fills it up to the length of the longest."""


@dataclass(frozen=True, slots=True)
class Hits:
    """First hits of rays, each (beams, rays).

    ``distance`` [m], infinite where nothing is met; ``cosine`` of the angle of incidence; ``geom`` ids, −1 for nothing.
    """

    distance: NDArray[np.float64]
    cosine: NDArray[np.float64]
    geom: NDArray[np.int32]

    def beside(self, others: "Hits") -> "Hits":
        """These rays of each beam and then ``others``."""
        return Hits(
            np.hstack([self.distance, others.distance]),
            np.hstack([self.cosine, others.cosine]),
            np.hstack([self.geom, others.geom]),
        )


@dataclass(frozen=True, slots=True)
class LaserSweep:
    """Where the scanner was when each beam left: ``positions`` (beams, 3) [m], ``attitudes`` (beams, 3, 3)."""

    positions: NDArray[np.float64]
    attitudes: NDArray[np.float64]


def ages() -> NDArray[np.float64]:
    """Time from when each beam left to the end of the scan, (beams,) [s]; the last one, beam 359, ends the scan."""
    index = np.arange(BEAMS)
    departure = TURN_TIME * (index * STEP / (2 * np.pi) + index % 2)
    return np.asarray(departure.max() - departure)


def bearings() -> NDArray[np.float64]:
    """Directions of the beams in the scanner's frame, counter-clockwise, (beams,) [rad]."""
    return np.asarray(START + STEP * np.arange(BEAMS))


def directions() -> NDArray[np.float64]:
    """Unit vectors of the beams in the scanner's frame, counter-clockwise, (beams, 3)."""
    return np.stack([np.cos(bearings()), np.sin(bearings()), np.zeros(BEAMS)], axis=1)


def sweep(model: mujoco.MjModel, data: mujoco.MjData, site: str) -> LaserSweep:
    """Trace the scanner at ``site`` back through the scan that ends now, as if its velocity had not changed."""
    from scipy.spatial.transform import Rotation  # takes long to import, and what only names a laser turns nothing

    frame, velocity = data.site(site), np.empty(6)
    in_world_axes = 0
    mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_SITE, frame.id, velocity, in_world_axes)
    before = -ages()[:, None]
    turns = Rotation.from_rotvec(before * velocity[:3]).as_matrix()
    return LaserSweep(frame.xpos + before * velocity[3:], turns @ frame.xmat.reshape(3, 3))


def cones(distances: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unit vectors of the rays of all beams in the scanner's frame, (beams, 7, 3).

    All rays leave from one point, so a beam's rays spread by the angle under which its spot is seen from there. That
    depends on the distance: the nearest thing that the beam or a neighbour meets, ``distances`` (beams,) [m].
    """
    padded = np.pad(distances, 1, mode="edge")
    nearest = np.maximum(np.min([padded[:-2], distances, padded[2:]], axis=0), EXIT_DIAMETER)
    spread = (EXIT_DIAMETER / nearest + DIVERGENCE) / 2  # radius of the spot over its distance
    ahead = directions()
    aside = np.stack([-ahead[:, 1], ahead[:, 0], ahead[:, 2]], axis=1)
    sideways, upwards = SPOT[:, :1] * aside[:, None], SPOT[:, 1:] * (0.0, 0.0, 1.0)
    rays = ahead[:, None] + spread[:, None, None] * (sideways + upwards)
    return np.asarray(rays / np.linalg.norm(rays, axis=2, keepdims=True))


def cast(
    scene: RayScene,
    data: mujoco.MjData,
    looks: LaserSweep,
    rays: NDArray[np.float64],
    groups: NDArray[np.uint8],
    blind_body: int,
    reach: float,
) -> Hits:
    """Cast ``rays`` (beams, rays, 3) of the scanner's frame at geoms of ``groups`` within ``reach`` [m].

    Geoms of ``blind_body`` are not met: it carries the scanner.
    """
    in_world = rays @ looks.attitudes.transpose(0, 2, 1)
    shape, (parts, beams) = rays.shape[:2], _PARTS.shape
    scene.look(data, groups, blind_body)
    hits = scene.cast(looks.positions[_ORIGINS], in_world[_PARTS].reshape(parts, -1, 3), reach)
    distance, normal, geom = np.empty(shape), np.empty(rays.shape), np.empty(shape, np.int32)
    distance[_PARTS], geom[_PARTS] = hits.distance.reshape(parts, beams, -1), hits.geom.reshape(parts, beams, -1)
    normal[_PARTS] = hits.normal.reshape(parts, beams, -1, 3)
    return Hits(distance, np.abs(np.einsum("brx,brx->br", normal, in_world)), geom)
