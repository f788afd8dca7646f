"""Sensors of the thesis' robots: a mast with Camera #1 (forward) and Camera #2 (to the left), and a LMS 200.

Each part is mounted on a body of a robot's spec. Its shapes become static geoms of that body, so that whoever leaves
out the body in a ray cast leaves out its sensors too.
"""

import mujoco
import numpy as np

# Names, as in the views.
CAMERA_FORWARD = "camera-1"
CAMERA_LATERAL = "camera-2"
LASER_SITE = "laser"

# Unibrain Fire-i, 4.3 mm lens: 768 px focal length at 640 x 480 (computed from 5.6 um pixels).
IMAGE_SIZE = (640, 480)
FOCAL_LENGTH = 768.0
FOVY = float(np.degrees(2 * np.arctan(IMAGE_SIZE[1] / 2 / FOCAL_LENGTH)))
CAMERA_MASS = 0.06

# Heights above the floor [m]: choices; the lateral camera is at the height where posters hang.
FORWARD_HEIGHT = 1.10
LATERAL_HEIGHT = 1.35
MAST_RADIUS = 0.02
MAST_MASS = 2.0

# SICK LMS 200 [m]: box 0.156 x 0.155 x 0.2, the mirror in its middle, the scan plane in its upper half (choice).
LASER_BOX = (0.156, 0.155, 0.2)
SCAN_HEIGHT = 0.09
LASER_WINDOW = 0.05
LASER_MASS = 4.5

VISUAL_GROUP = 2
COLLISION_GROUP = 3

Point = tuple[float, float, float]
"""Position or size along x, y, z [m]."""

_BOX = mujoco.mjtGeom.mjGEOM_BOX
_CYLINDER = mujoco.mjtGeom.mjGEOM_CYLINDER
_SPHERE = mujoco.mjtGeom.mjGEOM_SPHERE

# Axes of an image, right and up, of cameras that look along x and y.
_FORWARD = (0, -1, 0, 0, 0, 1)
_LEFT = (1, 0, 0, 0, 0, 1)


class _Mount:
    """A place on a body to which a part's shapes are fixed, upright and facing forward."""

    def __init__(self, spec: mujoco.MjSpec, body: mujoco.MjsBody, pos: Point) -> None:
        self._spec, self._body, self._frame = spec, body, body.add_frame(pos=pos)

    def material(self, name: str, grey: float, *, roughness: float, metallic: float) -> None:
        """Add a grey surface: the cameras have no colour."""
        rgba = (grey, grey, grey, 1)
        self._spec.add_material(name=name, rgba=rgba, roughness=roughness, metallic=metallic, specular=0.3)

    def visual(self, shape: mujoco.mjtGeom, size: Point, pos: Point, material: str) -> None:
        """Add a geom that is only seen."""
        self._geom(shape, size, pos, material, group=VISUAL_GROUP, contype=0, conaffinity=0, mass=0)

    def solid(self, shape: mujoco.mjtGeom, size: Point, pos: Point, material: str, mass: float) -> None:
        """Add a geom that others bump into and that weighs ``mass`` [kg]."""
        self._geom(shape, size, pos, material, group=COLLISION_GROUP, contype=1, conaffinity=1, mass=mass)

    def camera(self, name: str, pos: Point, xyaxes: tuple[int, ...]) -> None:
        """Add a Fire-i."""
        camera = self._body.add_camera(name=name, pos=pos, xyaxes=xyaxes, fovy=FOVY, resolution=IMAGE_SIZE)
        camera.set_frame(self._frame)

    def site(self, name: str, pos: Point) -> None:
        """Add a frame to measure from."""
        self._body.add_site(name=name, pos=pos, group=4).set_frame(self._frame)

    def _geom(self, shape: mujoco.mjtGeom, size: Point, pos: Point, material: str, **how: float) -> None:
        geom = self._body.add_geom(type=shape, size=size, pos=pos, material=material, **how)
        geom.set_frame(self._frame)


def add_camera_mast(spec: mujoco.MjSpec, body: mujoco.MjsBody, foot: Point) -> None:
    """Stand a column with both cameras on ``body`` at ``foot`` [m] above the floor in the robot's frame."""
    mount = _Mount(spec, body, foot)
    mount.material("mast-column", 0.4, roughness=0.4, metallic=0.8)
    mount.material("mast-camera", 0.12, roughness=0.6, metallic=0.0)
    mount.material("mast-lens", 0.03, roughness=0.1, metallic=0.0)
    top = LATERAL_HEIGHT - foot[2] + 0.05
    mount.visual(_CYLINDER, (MAST_RADIUS, top / 2, 0), (0, 0, top / 2), "mast-column")
    mount.visual(_CYLINDER, (0.06, 0.006, 0), (0, 0, 0.006), "mast-column")
    mount.solid(_CYLINDER, (MAST_RADIUS, top / 2, 0), (0, 0, top / 2), "mast-column", MAST_MASS)
    _add_camera(mount, CAMERA_FORWARD, (1, 0), FORWARD_HEIGHT - foot[2], _FORWARD)
    _add_camera(mount, CAMERA_LATERAL, (0, 1), LATERAL_HEIGHT - foot[2], _LEFT)


def add_laser_scanner(spec: mujoco.MjSpec, body: mujoco.MjsBody, foot: Point) -> None:
    """Stand a LMS 200 on ``body`` at ``foot`` [m]; its site ``laser`` is in the scan plane, x along the middle beam."""
    mount = _Mount(spec, body, foot)
    mount.material("laser-shell", 0.35, roughness=0.5, metallic=0.0)
    mount.material("laser-window", 0.03, roughness=0.15, metallic=0.0)
    length, width, height = LASER_BOX
    low, window = SCAN_HEIGHT - LASER_WINDOW / 2, LASER_WINDOW
    hood = height - low - window
    mount.visual(_BOX, (length / 2, width / 2, low / 2), (0, 0, low / 2), "laser-shell")
    mount.visual(_BOX, (0.46 * length, 0.46 * width, window / 2), (0, 0, SCAN_HEIGHT), "laser-window")
    mount.visual(_BOX, (length / 2, width / 2, hood / 2), (0, 0, height - hood / 2), "laser-shell")
    mount.solid(_BOX, (length / 2, width / 2, height / 2), (0, 0, height / 2), "laser-shell", LASER_MASS)
    mount.site(LASER_SITE, (0, 0, SCAN_HEIGHT))


def _add_camera(mount: _Mount, name: str, side: tuple[int, int], height: float, xyaxes: tuple[int, ...]) -> None:
    """Add a camera on the ``side`` (x, y) of the mast; its eye is in front of its case and so never sees it."""
    x, y = side
    mount.solid(_BOX, (0.03, 0.03, 0.03), (0.05 * x, 0.05 * y, height), "mast-camera", CAMERA_MASS)
    mount.visual(_BOX, (0.03, 0.03, 0.03), (0.05 * x, 0.05 * y, height), "mast-camera")
    mount.visual(_SPHERE, (0.018, 0, 0), (0.08 * x, 0.08 * y, height), "mast-lens")
    mount.camera(name, (0.105 * x, 0.105 * y, height), xyaxes)
