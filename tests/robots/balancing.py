"""The RMP under its Control layer on a flat floor, with what a test puts there, and what a test wants to know of it."""

import math
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np

from refseq_bench import robots
from refseq_bench.robots import Signals, Twist
from refseq_bench.robots.odometry import true_geometry
from refseq_bench.robots.rolling import UnevenRolling
from refseq_bench.sim.bench.hardware import Hardware
from refseq_bench.sim.sensors.inertial import InertialModel, tilt
from refseq_bench.sim.sensors.laser import Laser
from refseq_bench.sim.sensors.laser_model import LaserModel
from refseq_bench.sim.sensors.sonar import SonarModel

COMMAND_PERIOD = 0.04
SCAN_PERIOD = 0.2
PERFECT = InertialModel(0.0, 0.0, 0.0, 0.0)

Boxes = tuple[tuple[tuple[float, float, float], tuple[float, float, float]], ...]
"""Centres and half sizes [m]."""


class Machine:
    """One RMP at the origin, heading along x. ``scans`` tells whether its laser turns: that costs most of the time."""

    def __init__(
        self,
        name: str = "segway_rmp",
        *,
        timestep: float | None = None,
        inertial: InertialModel = PERFECT,
        seed: int = 0,
        boxes: Boxes = (),
        scans: bool = False,
        change: Callable[[mujoco.MjSpec], None] = lambda _: None,
    ) -> None:
        self.robot = robots.load(name)
        change(self.robot.spec)
        self.model = _on_a_floor(self.robot, timestep, boxes)
        self.data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, self.data)
        noise = np.random.SeedSequence(seed).spawn(3)
        sonar, inner, light = (np.random.default_rng(one) for one in noise)
        self._hardware = Hardware(
            self.model,
            self.data,
            self.robot,
            "r/",
            sonars=(SonarModel(), sonar),
            inertial=(inertial, inner),
            rolling=UnevenRolling(0.0, self.robot.drive, inner),
        )
        self._laser = Laser(LaserModel(), light) if scans else None
        self._scan: Any = None
        self._ticks = 0
        self.control: Any = self.robot.control(true_geometry(self.robot.drive))
        self.tamper: Callable[[Signals], Signals] = lambda signals: signals
        self.push = 0.0, 0.0, 0.0
        """Force on the mast, 1.2 m above the floor, along x, y, z [N]."""
        self.track: list[tuple[float, ...]] = []
        """Time [s], x, y [m], speed [m/s], pitch [rad], turn counted on [rad], for each tick."""
        self.turned = 0.0
        self._heading = 0.0

    def go(self, seconds: float, twist: Twist | Callable[[float], Twist] | None = None) -> "Machine":
        """Drive on under a command, or without one."""
        ticks_a_command = round(COMMAND_PERIOD / self.control.period)
        start = self.data.time
        for tick in range(round(seconds / self.control.period)):
            if twist is not None and tick % ticks_a_command == 0:
                self.control.command(twist(self.data.time - start) if callable(twist) else twist)
            self._tick()
        return self

    def _tick(self) -> None:
        if self._laser and self._ticks % round(SCAN_PERIOD / self.control.period) == 0:
            self._scan = self._laser.scan(self.model, self.data, "r/" + self.robot.laser, "r/base")
        self._ticks += 1
        self._hardware.apply(self.control.tick(self.tamper(self._hardware.signals(self._scan))))
        base = self.data.body("r/base")
        at = base.xpos + base.xmat.reshape(3, 3) @ (0.0, 0.0, 1.2)
        self.data.qfrc_applied[:] = 0.0
        if any(self.push):
            mujoco.mj_applyFT(
                self.model, self.data, np.array(self.push), np.zeros(3), at, base.id, self.data.qfrc_applied
            )
        mujoco.mj_step(self.model, self.data, nstep=round(self.control.period / self.model.opt.timestep))
        self._note()

    def _note(self) -> None:
        self.turned += math.remainder(self.heading - self._heading, 2 * math.pi)
        self._heading = self.heading
        x, y, _ = self.axle
        self.track.append((self.data.time, x, y, self.speed, self.pitch, self.turned))

    @property
    def axle(self) -> tuple[float, float, float]:
        """Middle of the axle [m]."""
        middle = (self.data.body("r/wheel-left").xpos + self.data.body("r/wheel-right").xpos) / 2
        return tuple(middle.tolist())

    @property
    def speed(self) -> float:
        """Speed of the axle along the heading, as the wheels roll [m/s]."""
        spin = sum(float(self.data.joint("r/" + name).qvel[0]) for name in self.robot.wheel_joints) / 2
        return (spin + float(self.data.joint("r/base").qvel[4])) * self.robot.drive.wheel_radius

    @property
    def pitch(self) -> float:
        """Pitch, nose down [rad]."""
        return tilt(self.data.joint("r/base").qpos[3:])[0]

    @property
    def heading(self) -> float:
        """Heading [rad]."""
        matrix = self.data.body("r/base").xmat
        return math.atan2(matrix[3], matrix[0])

    @property
    def causes(self) -> set[robots.Cause]:
        """Causes of the stops that hold."""
        return {stop.cause for stop in self.control.state.stops}

    def since(self, time: float) -> "np.ndarray[Any, np.dtype[np.float64]]":
        """The track (n, 6) from a time on."""
        track = np.array(self.track)
        return track[track[:, 0] >= time - 1e-9]


def _on_a_floor(robot: robots.Robot, timestep: float | None, boxes: Boxes) -> mujoco.MjModel:
    world, wanted = mujoco.MjSpec(), robot.spec.option
    wanted.timestep = timestep or wanted.timestep
    for key in ("timestep", "integrator", "cone", "impratio"):
        setattr(world.option, key, getattr(wanted, key))
    world.option.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    world.worldbody.add_geom(name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=(0, 0, 1), group=3)
    for centre, half in boxes:
        world.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, pos=centre, size=half, group=3)
    world.attach(robot.spec, frame=world.worldbody.add_frame(), prefix="r/")
    return world.compile()
