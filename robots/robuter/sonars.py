"""The Robuter's ring of 24 Polaroid rangers, six a side, in one list of places for drawing and measuring.

Numbers go counter-clockwise as seen from above, from the right end of the front: 0–5 front, 6–11 left, 12–17 rear,
18–23 right. How many there are is the thesis' word; where they sit is a choice (``README.md``).
"""

import math

import mujoco

ROW = 6
"""Rangers a side."""
SONARS = tuple(f"sonar-{number}" for number in range(4 * ROW))
"""Names of the sites, in the order of the readings; x looks along the beam."""
FRONT_SONARS, LEFT_SONARS, REAR_SONARS, RIGHT_SONARS = (tuple(range(ROW * k, ROW * (k + 1))) for k in range(4))

RADIUS, THICKNESS = 0.02, 0.008
MATERIAL = "robuter-sonar"

# Middle of each side's row [m], the way from one to the next, and where they look [rad].
_SIDES = (
    ((0.267, 0.0, 0.235), (0.0, 0.08), 0.0),
    ((-0.225, 0.262, 0.46), (-0.11, 0.0), math.pi / 2),
    ((-0.717, 0.0, 0.34), (0.0, -0.08), math.pi),
    ((-0.225, -0.262, 0.46), (0.11, 0.0), -math.pi / 2),
)


def add_sonars(spec: mujoco.MjSpec, body: mujoco.MjsBody) -> None:
    """Set the rangers into ``body``: a disc to be seen and a site on its face each."""
    for name, (pos, heading) in zip(SONARS, _places(), strict=True):
        frame = body.add_frame(pos=pos, quat=(math.cos(heading / 2), 0.0, 0.0, math.sin(heading / 2)))
        body.add_site(name=name, pos=(THICKNESS, 0.0, 0.0), group=4).set_frame(frame)
        disc = body.add_geom(
            spec.find_default("robuter-visual"),
            type=mujoco.mjtGeom.mjGEOM_CYLINDER,
            size=(RADIUS, THICKNESS / 2, 0.0),
            pos=(THICKNESS / 2, 0.0, 0.0),
            quat=(math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0),
            material=MATERIAL,
        )
        disc.set_frame(frame)


def _places() -> list[tuple[tuple[float, float, float], float]]:
    """Position [m] and heading [rad] of every ranger."""
    return [
        ((x + (k - (ROW - 1) / 2) * along, y + (k - (ROW - 1) / 2) * across, z), heading)
        for (x, y, z), (along, across), heading in _SIDES
        for k in range(ROW)
    ]
