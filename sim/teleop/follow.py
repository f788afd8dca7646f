"""A view of the world that follows the robot in MuJoCo Studio, and its messages to and from the bench.

Both are plug-ins: the ``FollowingView`` runs in the viewer's thread, the ``ViewerInput`` in the bench's. What a person
fills in and reads is the page around it (``capture``).
"""

import math
import time
from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco.studio import messages, plugin
from mujoco.studio.dear_imgui import dear_imgui as imgui

from refseq_bench.sim.teleop.keys import FASTER, GO_ON, HELD, OTHER_LOOK, PRESSED, SLOWER
from refseq_bench.sim.teleop.mirror import ROOF_GROUP

WALLS = np.array([1, 1, 0, 0, 0, 0], np.uint8)
"""Groups of geoms that block the view from behind: what is solid in the world, and its roof."""
CLEAR, NEAREST = 0.15, 0.8
"""Distances of the camera: to a wall behind it, and at least to the robot [m]."""


@dataclass(frozen=True)
class HeldSnapshot(messages.Snapshot):  # type: ignore[misc]
    """The keys that are held, and when that was, by this machine's clock [s]."""

    keys: frozenset[str]
    at: float


@dataclass(frozen=True)
class PressedEvent(messages.Event):  # type: ignore[misc]
    """A key that was pressed."""

    key: str


@dataclass(frozen=True)
class RobotSnapshot(messages.Snapshot):  # type: ignore[misc]
    """The body to follow, and the cameras that may be looked through."""

    robot: str
    cameras: tuple[str, ...]


@dataclass(frozen=True)
class LookEvent(messages.Event):  # type: ignore[misc]
    """The next look was asked for."""


class ViewerInput(plugin.SimPlugin):  # type: ignore[misc]
    """Keeps the keys that the viewer reports."""

    def __init__(self) -> None:
        self.held = HeldSnapshot(frozenset(), -math.inf)
        self.pressed: list[str] = []

    @messages.handler  # type: ignore[untyped-decorator]
    def on_held(self, message: HeldSnapshot) -> None:
        """Keep the newest."""
        self.held = message

    @messages.handler  # type: ignore[untyped-decorator]
    def on_pressed(self, message: PressedEvent) -> None:
        """Keep each."""
        self.pressed.append(message.key)


class FollowingView(plugin.ViewerPlugin):  # type: ignore[misc]
    """Follows the robot, and reports keys."""

    def __init__(self) -> None:
        self._robot = RobotSnapshot("", ())
        self._look = 0
        self._turned, self._raised, self._away = 0.0, 0.0, 1.0

    @messages.handler  # type: ignore[untyped-decorator]
    def on_robot(self, message: RobotSnapshot) -> None:
        """Follow another robot."""
        self._robot = message

    @messages.handler  # type: ignore[untyped-decorator]
    def on_look(self, _: LookEvent) -> None:
        """Look from elsewhere."""
        self._look += 1

    @messages.handler  # type: ignore[untyped-decorator]
    def on_update(self, _: messages.UpdateEvent) -> None:
        """Report the keys, and follow the robot."""
        self._report_keys()
        if imgui.IsKeyPressed(_key(OTHER_LOOK), False):
            self._look += 1
        if mujoco.mj_name2id(self.viewer.model, mujoco.mjtObj.mjOBJ_BODY, self._robot.robot) >= 0:  # not yet at first
            self._follow()

    def _report_keys(self) -> None:
        held = frozenset(name for name in HELD if imgui.IsKeyDown(_key(name)))
        self.viewer.send_to_sim(HeldSnapshot(held, time.monotonic()))
        for name in (GO_ON, FASTER, SLOWER, *PRESSED):
            if imgui.IsKeyPressed(_key(name), False):
                self.viewer.send_to_sim(PressedEvent(name))

    def _follow(self) -> None:
        """Look at the robot: from behind it, from above, or through one of its cameras."""
        looks = ("behind", "above", *self._robot.cameras)
        camera, model, look = self.viewer.camera, self.viewer.model, looks[self._look % len(looks)]
        self.viewer.vis_options.geomgroup[ROOF_GROUP] = look != "above"
        if look not in ("behind", "above"):
            camera.type, camera.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, model.camera(look).id
            return
        self._orbit()
        body = self.viewer.data.body(self._robot.robot)
        heading = math.atan2(body.xmat[3], body.xmat[0])
        camera.type = mujoco.mjtCamera.mjCAMERA_FREE
        camera.lookat[:] = (*body.xpos[:2], 0.8)
        camera.azimuth = math.degrees(heading) + self._turned
        camera.elevation = -80.0 if look == "above" else -14.0 + self._raised
        camera.distance = self._away * (11.0 if look == "above" else 3.4)
        if look == "behind":
            camera.distance = min(camera.distance, self._free_distance(camera))

    def _free_distance(self, camera: mujoco.MjvCamera) -> float:
        """Free distance behind the robot before a wall or ceiling [m]."""
        azimuth, elevation = math.radians(camera.azimuth), math.radians(camera.elevation)
        level = -math.cos(elevation)
        way = np.array([level * math.cos(azimuth), level * math.sin(azimuth), -math.sin(elevation)])
        begin, geom = np.array(camera.lookat, float), np.zeros(1, np.int32)
        distance = mujoco.mj_ray(self.viewer.model, self.viewer.data, begin, way, WALLS, 1, -1, geom)
        return max(distance - CLEAR, NEAREST) if distance >= 0 else math.inf

    def _orbit(self) -> None:
        """Orbit by dragging, zoom by the wheel."""
        io = imgui.GetIO()
        if io.WantCaptureMouse:
            return
        if imgui.IsMouseDragging(int(imgui.MouseButton.Left)):
            self._turned -= 0.3 * io.MouseDelta.x
            self._raised = min(max(self._raised - 0.3 * io.MouseDelta.y, -70.0), 10.0)
        self._away = min(max(self._away * math.exp(-0.1 * io.MouseWheel), 0.3), 4.0)


def _key(name: str) -> imgui.Key:
    return getattr(imgui.Key, name)
