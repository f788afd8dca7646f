"""The body of a robot as its electronics know it: readings of encoders, motors, bumpers and sensors; motors, brakes."""

import mujoco
import numpy as np

from refseq.view import Scan
from robots import Actuation, Robot, Signals
from robots.odometry import Encoders
from sim.inertial import InertialModel, InertialSensors
from sim.sonar import SonarModel, SonarRing

BRAKE_TORQUE = 60.0
"""What a brake holds a wheel with [N·m]; a choice, more than any motor gives."""


class Hardware:
    """Reads and moves ``robot`` in ``data``, where its names begin with ``prefix``.

    Sensors come as a model and the generator of their noise.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        robot: Robot,
        prefix: str,
        sonars: tuple[SonarModel, np.random.Generator],
        inertial: tuple[InertialModel, np.random.Generator],
    ) -> None:
        self._model, self._data = model, data
        self._wheels = [data.joint(prefix + name) for name in robot.wheel_joints]
        self._motors = [data.actuator(prefix + name) for name in robot.wheel_actuators]
        self._base = data.joint(prefix + robot.base)
        self._encoders = Encoders(robot.pulses_per_turn)
        self._bumpers = {name: model.geom(prefix + geom).id for name, geom in robot.bumpers.items()}
        self._dofs = [int(model.joint(prefix + name).dofadr[0]) for name in robot.wheel_joints]
        self._friction = model.dof_frictionloss[self._dofs].copy()
        sites = tuple(prefix + name for name in robot.sonars)
        self._sonars = SonarRing(sonars[0], sonars[1], model, sites, prefix + robot.base) if sites else None
        self._inertial = InertialSensors(*inertial)

    def signals(self, scan: Scan | None) -> Signals:
        """All readings at this moment, with the newest scan where there is one."""
        left, right = self._wheels
        return Signals(
            time=float(self._data.time),
            pulses=self._encoders.read(float(left.qpos[0]), float(right.qpos[0])),
            torques=(float(self._motors[0].force[0]), float(self._motors[1].force[0])),
            inertial=self._inertial.read(self._base.qpos[3:], self._base.qvel[3:]),
            bumpers=self._pressed(),
            sonar=self._sonars.read(self._data) if self._sonars else None,
            scan=scan,
        )

    def apply(self, actuation: Actuation) -> None:
        """Tell motors and brakes what to do."""
        for motor, value in zip(self._motors, (actuation.left, actuation.right), strict=True):
            motor.ctrl = value
        self._model.dof_frictionloss[self._dofs] = BRAKE_TORQUE if actuation.braked else self._friction

    def _pressed(self) -> frozenset[str]:
        touched = self._data.contact.geom
        return frozenset(name for name, geom in self._bumpers.items() if (touched == geom).any())
