"""A flat floor, walls where asked, and a robot on it that does what a test says."""

import math
from collections.abc import Callable, Sequence

import mujoco
import numpy as np

from refseq.planar import Pose
from refseq_bench import robots
from refseq_bench.robots import Twist
from refseq_bench.robots.robuter.firmware import PERIOD

PREFIX = "robuter/"


def flat_world(timestep: float | None = None) -> mujoco.MjSpec:
    """A floor and the options that the robot asks for."""
    wanted = robots.load("robuter").spec.option
    world = mujoco.MjSpec()
    for key in ("integrator", "cone", "impratio"):
        setattr(world.option, key, getattr(wanted, key))
    world.option.timestep = timestep or wanted.timestep
    world.worldbody.add_geom(name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=(0, 0, 1))
    return world


def add_wall(world: mujoco.MjSpec, centre: Sequence[float], half: Sequence[float], **how: float) -> None:
    """A box from the floor to 2 m."""
    world.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, pos=(*centre, 1.0), size=(*half, 1.0), **how)


class Driven:
    """The robot in a world: it starts at the origin and heads along x."""

    def __init__(self, world: mujoco.MjSpec | None = None) -> None:
        world = flat_world() if world is None else world
        self.robot = robots.load("robuter")
        self.robot.spec.option.timestep = world.option.timestep
        world.attach(self.robot.spec, frame=world.worldbody.add_frame(), prefix=PREFIX)
        self.model = world.compile()
        self.data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, self.data)
        self.turned = 0.0

    @property
    def pose(self) -> Pose:
        body = self.data.body(PREFIX + self.robot.base)
        return Pose(float(body.xpos[0]), float(body.xpos[1]), math.atan2(body.xmat[3], body.xmat[0]))

    @property
    def wheel_angles(self) -> tuple[float, float]:
        left, right = (float(self.data.joint(PREFIX + name).qpos[0]) for name in self.robot.wheel_joints)
        return left, right

    def place(self, x: float, y: float, heading: float) -> None:
        joint = self.data.joint(PREFIX + self.robot.base)
        joint.qpos = (x, y, 0, math.cos(heading / 2), 0, 0, math.sin(heading / 2))
        mujoco.mj_forward(self.model, self.data)

    def drive(self, duration: float, command: Callable[[float], Twist], each: Callable[[], None] | None = None) -> None:
        """Drive by ``command(time since the start)``; ``turned`` counts the heading on, without wrapping."""
        steps = max(1, round(PERIOD / self.model.opt.timestep))
        left, right = (self.data.actuator(PREFIX + name) for name in self.robot.wheel_actuators)
        start, heading = self.data.time, self.pose.heading
        while self.data.time - start < duration - 1e-9:
            speeds = self.robot.drive.wheel_speeds(command(self.data.time - start))
            left.ctrl, right.ctrl = speeds.left, speeds.right
            mujoco.mj_step(self.model, self.data, nstep=steps)
            self.turned += math.remainder(self.pose.heading - heading, 2 * math.pi)
            heading = self.pose.heading
            if each is not None:
                each()


def ramped(twist: Twist, duration: float, ramp: float = 1.0) -> Callable[[float], Twist]:
    """``twist`` with a linear start and stop; it covers ``duration - ramp`` seconds at full speed."""

    def command(time: float) -> Twist:
        part = float(np.clip(min(time, duration - time) / ramp, 0, 1))
        return Twist(twist.linear * part, twist.angular * part)

    return command
