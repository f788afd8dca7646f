"""World and robot as one simulation: clock, stepping, sensors, odometry."""

import math
from dataclasses import dataclass, field
from types import MappingProxyType

import mujoco
import numpy as np
from numpy.typing import NDArray

from refseq.view import Pose, View, motion_between
from robots import Robot, Twist
from sim.camera import Camera, CameraModel
from sim.errors import SimError
from sim.laser import Laser, LaserModel
from sim.odometry import CalibrationErrors, Encoders, Odometry, Pulses, believed_geometry
from sim.render import Closing, Renderer, RendererKind, open_renderer, prepare_spec
from worlds.build import World

CONTROL_PERIOD = 0.04
"""Time between two commands to the wheels [s]; a choice, well above the rate of a person's hand."""
ADAPTATION = 0.5
"""How long before a view the cameras' exposure control has been looking at what the view shows [s]; a choice.

Until then it saw what the last view showed. So the exposure trails the light by the camera's lag, as a real one's does,
and no frame is rendered just to be metered: a small frame costs nearly half of a whole one."""
METER_STEP = 8
"""The exposure control's light meter takes a mean: every so many rows and columns are enough."""
OPTIONS = ("timestep", "integrator", "cone", "impratio")
"""Physics options that the robot's model asks for: the world takes them over."""


@dataclass(frozen=True, slots=True)
class BenchSettings:
    """Sensors of the bench, and the individual robot ``unit``, which fixes its calibration errors for all drives.

    ``cameras`` are those that take images, None for all of the robot's: rendering is the cost of the bench.
    """

    renderer: RendererKind = RendererKind.FILAMENT
    cameras: tuple[str, ...] | None = None
    camera: CameraModel = field(default_factory=CameraModel)
    laser: LaserModel = field(default_factory=LaserModel)
    calibration: CalibrationErrors = field(default_factory=CalibrationErrors)
    unit: int = 1


class Bench(Closing):
    """A robot in a world, at the start of a route, at simulated time 0; use it in a ``with`` block.

    Every random draw (noise of laser and cameras, calibration) comes from ``seed`` and the settings' ``unit``: the same
    seed gives the same scans and poses, bit for bit. Raises ``SimError`` for an unknown route, ``RendererError`` where
    the renderer's driver is missing.
    """

    def __init__(
        self,
        world: World,
        robot: Robot,
        *,
        route: str = "forward",
        seed: int = 0,
        settings: BenchSettings | None = None,
    ) -> None:
        if route not in world.routes:
            raise SimError(f"unknown route {route!r} in world {world.name!r}: valid are {', '.join(world.routes)}")
        self.world, self.robot, self.settings = world, robot, settings or BenchSettings()
        self.route = world.routes[route]
        self._prefix = f"{robot.name}/"
        self.model = self._compile()
        self.data = mujoco.MjData(self.model)
        self._place(_start_of(self.route))

        laser_seed, *camera_seeds = np.random.SeedSequence(seed).spawn(1 + len(robot.cameras))
        self._laser = Laser(self.settings.laser, np.random.default_rng(laser_seed))
        self._cameras = {
            name: Camera(self.settings.camera, np.random.default_rng(camera_seed))
            # Seeds go by the robot's cameras, so that one's noise does not depend on which others take images.
            for name, camera_seed in zip(robot.cameras, camera_seeds, strict=True)
            if self.settings.cameras is None or name in self.settings.cameras
        }
        geometry = believed_geometry(robot.drive, self.settings.calibration, np.random.default_rng(self.settings.unit))
        self._encoders = Encoders(robot.pulses_per_turn)
        self._odometry = Odometry(geometry, self._encoders, self._pulses())
        self._last_view: Pose | None = None
        self._last_look = 0.0
        self._steps = max(1, round(CONTROL_PERIOD / self.model.opt.timestep))
        self.renderer: Renderer = open_renderer(self.settings.renderer, self.model)

    def _compile(self) -> mujoco.MjModel:
        spec = self.world.spec.copy()
        for option in OPTIONS:
            setattr(spec.option, option, getattr(self.robot.spec.option, option))
        spec.attach(self.robot.spec, frame=spec.worldbody.add_frame(), prefix=self._prefix)
        spec.visual.global_.offwidth, spec.visual.global_.offheight = 640, 480
        prepare_spec(spec)
        return spec.compile()

    def _place(self, pose: Pose) -> None:
        half = pose.heading / 2
        joint = self.data.joint(self._prefix + self.robot.base)
        joint.qpos = (pose.x, pose.y, joint.qpos[2], math.cos(half), 0.0, 0.0, math.sin(half))
        mujoco.mj_forward(self.model, self.data)

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return float(self.data.time)

    @property
    def pose(self) -> Pose:
        """The true pose."""
        body = self.data.body(self._prefix + self.robot.base)
        return Pose(float(body.xpos[0]), float(body.xpos[1]), math.atan2(body.xmat[3], body.xmat[0]))

    @property
    def odometry(self) -> Pose:
        """The pose that the odometer shows, from the start of the drive."""
        return self._odometry.pose

    def _pulses(self) -> Pulses:
        left, right = (float(self.data.joint(self._prefix + name).qpos[0]) for name in self.robot.wheel_joints)
        return self._encoders.read(left, right)

    def drive(self, twist: Twist) -> None:
        """Go on for one control period under a command."""
        speeds = self.robot.drive.wheel_speeds(twist)
        for name, speed in zip(self.robot.wheel_actuators, (speeds.left, speeds.right), strict=True):
            self.data.actuator(self._prefix + name).ctrl = speed
        mujoco.mj_step(self.model, self.data, nstep=self._steps)
        self._odometry.update(self._pulses())

    def sense(self) -> View:
        """All sensors at this moment; distance and turn count from the last view."""
        images = {} if self.renderer.kind is RendererKind.NONE else self._photograph()
        scan = self._laser.scan(self.model, self.data, self._prefix + self.robot.laser, self._prefix + self.robot.base)
        now = self.odometry
        distance, turn = motion_between(self._last_view, now) if self._last_view else (0.0, 0.0)
        self._last_view = now
        return View(self.time, MappingProxyType(images), scan, distance, turn, self.pose)

    def _photograph(self) -> dict[str, NDArray[np.uint8]]:
        elapsed, self._last_look = self.time - self._last_look, self.time
        images = {}
        for name, camera in self._cameras.items():
            radiance = self.renderer.radiance(self.data, self._prefix + name)
            camera.adapt(radiance[::METER_STEP, ::METER_STEP], min(elapsed, ADAPTATION))
            images[name] = camera.expose(radiance)
        return images

    def close(self) -> None:
        """Give the renderer's device back."""
        self.renderer.close()


def _start_of(route: NDArray[np.float64]) -> Pose:
    """A route's first point, facing its second."""
    (x, y), (ahead_x, ahead_y) = route[:2]
    return Pose(float(x), float(y), math.atan2(ahead_y - y, ahead_x - x))
