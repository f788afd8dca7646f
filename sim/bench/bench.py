"""World and robot as one simulation: clock, stepping, sensors, odometry."""

import math
from collections.abc import Callable, Generator, Sequence
from dataclasses import replace
from functools import partial
from types import MappingProxyType

import mujoco
import numpy as np
from numpy.typing import NDArray

from refseq.planar import Pose, motion_between
from refseq.view import Scan, View
from refseq_bench.robots import ControlLayer, Inertial, Robot, RobotState, Signals, Twist
from refseq_bench.robots.individual import built
from refseq_bench.robots.rolling import UnevenRolling
from refseq_bench.sim.bench.assembly import SensorStreams, compile_model, prefix_of, route_named, start_of, streams_of
from refseq_bench.sim.bench.control_period import CONTROL_PERIOD
from refseq_bench.sim.bench.hardware import Hardware
from refseq_bench.sim.bench.mounts import own_cameras, shift_mounts
from refseq_bench.sim.bench.polyline import polyline
from refseq_bench.sim.bench.settings import BenchSettings, resolved
from refseq_bench.sim.cameras.camera import Camera
from refseq_bench.sim.cameras.lens import Optics
from refseq_bench.sim.cameras.motion_blur import MocapPoses, paths, smeared, tell_velocities
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.physics import Due, Physics, alone
from refseq_bench.sim.rendering.baked.kept_light import kept
from refseq_bench.sim.rendering.opening import open_renderer
from refseq_bench.sim.rendering.renderer import Closing, Renderer, RendererKind
from refseq_bench.sim.sensors.laser import Laser
from refseq_bench.sim.sensors.ray_scene import RayScene
from refseq_bench.user_cache import user_cache
from refseq_bench.worlds.build import World
from refseq_bench.worlds.lighting.baking import Baked, Shell, bake, world_light
from refseq_bench.worlds.lighting.form_factors import Cards
from refseq_bench.worlds.parts.people import Crowd

SCAN_PERIOD = 0.2
"""Time between two scans while somebody steers by the laser [s]: 5.2 a second come over its serial line (facts)."""
ADAPTATION = 0.5
"""Time before a view in which the cameras' exposure control sees what the view shows [s]; a choice.

Until then it saw what the last view showed. So the exposure trails the light by the camera's lag, as a real one's does,
and no frame is rendered just to be metered: a small frame costs nearly half of a whole one."""
NO_READING = Inertial(math.nan, math.nan, math.nan, math.nan)


class Bench(Closing):
    """A robot in a world, at the start of a route, at simulated time 0; use it in a ``with`` block.

    ``route`` is the name of one of the world's, or a polyline (n, 2) [m].

    Every random draw (sensors' noise, the robot's own errors) comes from ``seed`` and the settings' ``unit``: the same
    seed gives the same scans and poses, bit for bit. ``settings`` are kept with every camera's name and model written
    out, and make the same bench again. Raises ``SimError`` for an unknown route or camera, a route that is no polyline
    and a seed below 0, ``RobotsError`` for a unit below 0, ``RendererError`` where the renderer's driver is missing.
    """

    def __init__(
        self,
        world: World,
        robot: Robot,
        *,
        route: str | NDArray[np.float64] = "forward",
        seed: int = 0,
        settings: BenchSettings | None = None,
    ) -> None:
        self.world, self.robot, self.settings = world, robot, resolved(settings or BenchSettings(), robot)
        self.route = route_named(world, route) if isinstance(route, str) else polyline(route)
        self.cameras: tuple[str, ...] = self.settings.cameras or ()
        """The cameras that take images."""
        self._prefix = prefix_of(robot)
        self.individual = built(robot.drive, robot.cameras, self.settings.spread, self.settings.unit)
        """Differences of the robot from its drawing."""
        self.camera_models = own_cameras(self.settings, self.individual)
        """The cameras by name, as this robot's own lenses make them."""
        self.model = compile_model(world, robot, self.camera_models)
        shift_mounts(self.model, robot, self.individual)
        self.data = mujoco.MjData(self.model)
        self._crowd = Crowd(self.model, world.plan)
        base = self.data.body(self.named(robot.base))
        self._base_position, self._base_axes = base.xpos, base.xmat  # views: to look them up costs as much as a tick
        self._stand_at(start_of(self.route))
        self._physics = Physics(self.model, self.data)
        self._add_electronics()
        self._add_sensors(streams_of(seed, robot))
        self._due = Due(self._physics, _whole(self.control.period, self.model.opt.timestep, "physics step"))
        self._ticks = _whole(CONTROL_PERIOD, self.control.period, "tick")
        self.renderer = self._opened(self.settings.renderer)

    def draw_by(self, kind: RendererKind) -> None:
        """Draw by a renderer of another kind from now on, in the light of the same world; see ``Bench`` for errors."""
        before, self.renderer = self.renderer, self._opened(kind)
        before.close()

    def _opened(self, kind: RendererKind) -> Renderer:
        """A renderer of the model in the light of its world, which is worked out once for all benches."""
        world = self.world
        if kind is not RendererKind.NONE and not world.pictured:
            raise SimError(f"world {world.name!r} was built without pictures; valid is the renderer 'none'")

        def light(shell: Shell, others: Cards) -> Baked:
            shining = world_light(world.plan, world.photometry)
            return kept(partial(bake, shining), user_cache() / "light", shining)(shell, others)

        return open_renderer(kind, self.model, light)

    def _add_electronics(self) -> None:
        self.believed = self.individual.believed
        """The wheels' geometry that the robot believes in."""
        self.control: ControlLayer = self.robot.control(self.believed)
        self.tamper: Callable[[Signals], Signals] = _untouched
        """Applied to the signals on their way to the electronics: faults are put in here."""

    def _add_sensors(self, streams: SensorStreams) -> None:
        settings = self.settings
        scene = RayScene(self.model)
        self._laser = Laser(settings.laser, streams.laser, scene)
        self._cameras = {
            name: Camera(self.camera_models[name], stream)
            for name, stream in streams.cameras.items()
            if name in self.cameras
        }
        sonars, inertial = (settings.sonar, streams.sonar), (settings.inertial, streams.inertial)
        rolling = UnevenRolling(self.individual.walk, self.robot.drive, streams.rolling)
        self._hardware = Hardware(self.model, self.data, self.robot, self._prefix, sonars, inertial, rolling, scene)
        self.covered: frozenset[str] = frozenset()
        """Cameras into which no light falls."""
        self._scanned: tuple[float, Scan] | None = None
        self._last_view: Pose | None = None
        self._last_look = 0.0
        self._stood = MocapPoses.of(self.data)  # a control period ago

    def place(self, pose: Pose) -> None:
        """Carry the robot to ``pose``, where it stands still: its odometer does not notice, its cameras adapt."""
        self._stand_at(pose)
        self._physics.forgive()
        self._scanned = None
        self.control.rest()
        for camera in self._cameras.values():
            camera.forget()

    def _stand_at(self, pose: Pose) -> None:
        half = pose.heading / 2
        joint = self.data.joint(self.named(self.robot.base))
        height = self.model.joint(self.named(self.robot.base)).qpos0[2]
        joint.qpos = (pose.x, pose.y, height, math.cos(half), 0.0, 0.0, math.sin(half))
        self.data.qvel[:], self.data.act[:], self.data.qacc_warmstart[:] = 0.0, 0.0, 0.0
        mujoco.mj_forward(self.model, self.data)

    def named(self, part: str) -> str:
        """The name in the model of a part of the robot, as the robot's own model has it."""
        return self._prefix + part

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return float(self.data.time)

    @property
    def pose(self) -> Pose:
        """The true pose: where the middle of the axle is, and which way the robot looks.

        A machine that balances leans about its axle, so that its base's origin, on the floor, swings to and fro.
        """
        (x, y, _), axes, up = self._base_position.tolist(), self._base_axes.tolist(), self.robot.drive.wheel_radius
        return Pose(x + up * axes[2], y + up * axes[5], math.atan2(axes[3], axes[0]))

    @property
    def odometry(self) -> Pose:
        """The pose that the odometer shows, from the start of the drive."""
        shown = self.control.odometry
        return Pose(shown.x, shown.y, shown.heading)

    @property
    def state(self) -> RobotState:
        """The state that the robot told of itself last."""
        return self.control.state

    @property
    def fault(self) -> str | None:
        """The failure of the physics, None while all is well; from then on the robot hears no sensor."""
        return self._physics.fault

    def drive(self, twist: Twist) -> None:
        """Go on for one control period under a command."""
        self.control.command(twist)
        self.wait()

    def driving(self, twist: Twist) -> Generator[Due]:
        """Do as ``drive`` does, but leave the steps of the physics to the caller: it takes each that is due."""
        self.control.command(twist)
        yield from self._waiting()

    def dazzle(self, arcs: Sequence[tuple[float, float]]) -> None:
        """Blind the laser's beams in some arcs, each from a bearing counter-clockwise to another [rad]."""
        self._laser.dazzled = tuple(arcs)
        self._scanned = None

    def grip(self, wheel: str, friction: float | None) -> None:
        """Give a wheel, left or right, a coefficient of friction, or None for that of its tyre."""
        self._hardware.grip(wheel, friction)

    def wait(self) -> None:
        """Go on for one control period without any command."""
        alone(self._waiting())

    def _waiting(self) -> Generator[Due]:
        self._stood = MocapPoses.of(self.data)
        self._crowd.at(self.data, self.time + CONTROL_PERIOD)
        for _ in range(self._ticks):
            self._physics.look()
            self._hardware.apply(self.control.tick(self.tamper(self._signals())))
            yield self._due
        self._physics.update_frames()

    def _signals(self) -> Signals:
        signals = self._hardware.signals(self.scan() if self.control.needs_scan else None)
        return signals if self.fault is None else replace(signals, inertial=NO_READING)

    @property
    def scan_due(self) -> bool:
        """True where ``scan`` turns the laser."""
        return self._scanned is None or self.time - self._scanned[0] > SCAN_PERIOD - 1e-9

    def scan(self) -> Scan:
        """The newest turn of the laser for steering, at most ``SCAN_PERIOD`` old."""
        if self._scanned is None or self.scan_due:
            self._scanned = self.time, self.new_scan()
        return self._scanned[1]

    def new_scan(self) -> Scan:
        """A turn of the laser that ends at this moment, as views have it; ``scan`` does not return it."""
        return self._laser.scan(self.model, self.data, self.named(self.robot.laser), self.named(self.robot.base))

    def sense(self) -> View:
        """All sensors at this moment; distance and turn count from the last view."""
        images = self.photograph()
        scan = self.new_scan()
        now = self.odometry
        distance, turn = motion_between(self._last_view, now) if self._last_view else (0.0, 0.0)
        self._last_view = now
        return View(self.time, MappingProxyType(images), scan, distance, turn, self.pose)

    def photograph(self) -> dict[str, NDArray[np.uint8]]:
        """The cameras' images at this moment by their names, none without a renderer; nothing else notices."""
        if self.renderer.kind is RendererKind.NONE:
            return {}
        elapsed, self._last_look = self.time - self._last_look, self.time
        tell_velocities(self.model, self.data, self._stood, CONTROL_PERIOD)
        images = {}
        for name, camera in self._cameras.items():
            optics, mounted = camera.optics, self.named(name)
            sharp = np.zeros(optics.size[::-1], np.float32) if name in self.covered else self._drawn(mounted, optics)
            camera.adapt(sharp, min(elapsed, ADAPTATION))
            run = paths(self.model, self.data, mounted, optics, camera.exposure.shutter)
            images[name] = camera.expose(smeared(sharp, run))
        return images

    def _drawn(self, mounted: str, optics: Optics) -> NDArray[np.float32]:
        """Picture of what a camera of the model sees through its lens, (height, width) [cd/m²]."""
        self.renderer.light_around(partial(self.world.ambient.at, self.data.camera(mounted).xpos))
        pinhole = optics.pinhole
        return optics.draw(self.renderer.radiance(self.data, mounted, pinhole.width, pinhole.height))

    def close(self) -> None:
        """Give the renderer's device back."""
        self.renderer.close()


def _untouched(signals: Signals) -> Signals:
    return signals


def _whole(period: float, part: float, name: str) -> int:
    """Number of parts that make a period; raises ``SimError`` where that is no whole number."""
    count = round(period / part)
    if count < 1 or not math.isclose(count * part, period):
        raise SimError(f"a {name} of {part} s does not divide {period} s: valid is a whole part of it")
    return count
