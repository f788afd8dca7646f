"""A robot's compiled model at rest on the floor, and what can be measured of it there."""

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from refseq_bench.robots import Robot
from refseq_bench.worlds.arrays import Floats
from refseq_bench.worlds.check import geom_boxes

HEAD = ("mast-", "laser-")
"""Prefixes of the materials of ``refseq_bench.robots.sensor_mast``: geoms with them are no part of the bare vehicle."""
CHASSIS = "body"
"""Name of the geom that is the chassis' body, where a model has one."""


@dataclass(frozen=True, slots=True)
class BodyBox:
    """Corners along x, y, z, (3,) each [m]."""

    low: Floats
    high: Floats

    @property
    def size(self) -> Floats:
        """Lengths of the sides, (3,) [m]."""
        return self.high - self.low

    @property
    def middle(self) -> Floats:
        """Its centre, (3,) [m]."""
        return (self.low + self.high) / 2


class Body:
    """Compiles ``robot`` and puts it on the floor: origin midway between its drive wheels, x ahead, y left, z up."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.model = robot.spec.compile()
        self.data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, self.data)
        self._low, self._high = geom_boxes(self.model, self.data)
        self.seen = np.flatnonzero(self.model.geom_group <= 2)
        """Numbers of the geoms that cameras see."""
        self.touched = np.flatnonzero((self.model.geom_contype | self.model.geom_conaffinity) != 0)
        """Numbers of the geoms that are touched."""

    @property
    def mass(self) -> float:
        """Mass of all [kg]."""
        return float(self.model.body_mass.sum())

    @property
    def centre(self) -> Floats:
        """Centre of the mass, (3,) [m]."""
        return self.model.body_mass @ self.data.xipos / self.mass

    @property
    def inertia(self) -> Floats:
        """Inertia about that centre, (3, 3) [kg m²]: each body's own, and its mass times distance² (Steiner)."""
        total, centre = np.zeros((3, 3)), self.centre
        for body in range(1, self.model.nbody):
            axes, arm = self.data.ximat[body].reshape(3, 3), self.data.xipos[body] - centre
            total += axes @ np.diag(self.model.body_inertia[body]) @ axes.T
            total += self.model.body_mass[body] * (arm @ arm * np.eye(3) - np.outer(arm, arm))
        return total

    @property
    def whole(self) -> BodyBox:
        """The box around all that is seen or touched."""
        return self._around(np.union1d(self.seen, self.touched))

    @property
    def vehicle(self) -> BodyBox:
        """The box around all that is seen of the vehicle without what it carries to see with."""
        return self._around(np.array([g for g in self.seen if not self._material(int(g)).startswith(HEAD)]))

    @property
    def chassis(self) -> BodyBox | None:
        """The box around the chassis' body, None where the model names none."""
        if mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_GEOM, CHASSIS) < 0:
            return None
        return self._around(np.array([self.model.geom(CHASSIS).id]))

    @property
    def wheel(self) -> BodyBox:
        """The box around the tyre of the left drive wheel: the tallest of the wheel's geoms."""
        body = self.model.joint(self.robot.wheel_joints[0]).bodyid[0]
        own = [geom for geom in self.seen if self.model.geom_bodyid[geom] == body]
        return self._around(np.array([max(own, key=lambda geom: self._high[geom, 2])]))

    @property
    def wheel_mass(self) -> float:
        """Mass of one drive wheel [kg]."""
        return float(self.model.body_mass[self.model.joint(self.robot.wheel_joints[0]).bodyid[0]])

    @property
    def hubs(self) -> Floats:
        """Middles of the drive wheels, (left and right, 3) [m]."""
        return np.array([self.data.joint(name).xanchor for name in self.robot.wheel_joints])

    @property
    def track(self) -> float:
        """Distance between the drive wheels [m]."""
        left, right = self.hubs
        return float(np.linalg.norm(left - right))

    @property
    def torque(self) -> float:
        """Greatest torque of a motor on its wheel [N·m]: the limit of its force, or of its control."""
        motor = self.model.actuator(self.robot.wheel_actuators[0])
        limit = motor.forcerange if motor.forcelimited[0] else motor.ctrlrange
        return float(limit.max())

    def _material(self, geom: int) -> str:
        number = int(self.model.geom_matid[geom])
        return self.model.mat(number).name if number >= 0 else ""

    def _around(self, geoms: NDArray[np.intp]) -> BodyBox:
        return BodyBox(self._low[geoms].min(axis=0), self._high[geoms].max(axis=0))
