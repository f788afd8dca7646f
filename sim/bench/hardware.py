"""The body of a robot as its electronics know it: readings of encoders, motors, bumpers and sensors; motors, brakes."""

import mujoco
import numpy as np

from refseq.view import Scan
from refseq_bench.robots import Actuation, Robot, Signals
from refseq_bench.robots.motion import WHEELS
from refseq_bench.robots.odometry import Encoders
from refseq_bench.robots.rolling import UnevenRolling
from refseq_bench.sim.sensors.inertial import InertialModel, InertialSensors
from refseq_bench.sim.sensors.ray_scene import RayScene
from refseq_bench.sim.sensors.sonar import SonarModel, SonarRing

BRAKE_TORQUE = 60.0
"""Torque of a brake on its wheel [N·m]; a choice, more than any motor gives."""
NOTHING: frozenset[str] = frozenset()


class Hardware:
    """Reads and moves ``robot`` in ``data``, where its names begin with ``prefix``.

    Sensors come as a model and the generator of their noise; ``rolling`` stands between wheels and encoders; a
    ``scene`` may be shared with others that cast rays.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        robot: Robot,
        prefix: str,
        sonars: tuple[SonarModel, np.random.Generator],
        inertial: tuple[InertialModel, np.random.Generator],
        rolling: UnevenRolling,
        scene: RayScene | None = None,
    ) -> None:
        self._model, self._data = model, data
        # Addresses are looked up once and views kept: by name it would cost as much in each tick as the physics.
        wheels = [model.joint(prefix + name) for name in robot.wheel_joints]
        self._angles = [int(joint.qposadr[0]) for joint in wheels]
        self._dofs = [int(joint.dofadr[0]) for joint in wheels]
        self._motors = [model.actuator(prefix + name).id for name in robot.wheel_actuators]
        base = model.joint(prefix + robot.base)
        self._rotation = data.qpos[base.qposadr[0] + 3 : base.qposadr[0] + 7]
        self._rates = data.qvel[base.dofadr[0] + 3 : base.dofadr[0] + 6]
        self._qpos, self._torques, self._told = data.qpos, data.actuator_force, data.ctrl
        self._encoders, self._rolling = Encoders(robot.pulses_per_turn), rolling
        self._bumpers = {name: model.geom(prefix + geom).id for name, geom in robot.bumpers.items()}
        self._friction = model.dof_frictionloss[self._dofs].copy()
        self._tyres = {side: _tyre(model, int(joint.bodyid[0])) for side, joint in zip(WHEELS, wheels, strict=True)}
        self._tyre_friction = model.geom_friction[:, 0].copy(), model.geom_priority.copy()
        self._braked = False
        sites = tuple(prefix + name for name in robot.sonars)
        self._sonars = SonarRing(*sonars, model, sites, prefix + robot.base, scene) if sites else None
        self._inertial = InertialSensors(*inertial)

    def signals(self, scan: Scan | None) -> Signals:
        """All readings at this moment, with the newest scan where there is one."""
        left, right = self._angles
        return Signals(
            time=float(self._data.time),
            pulses=self._encoders.read(*self._rolling.seen(float(self._qpos[left]), float(self._qpos[right]))),
            torques=(float(self._torques[self._motors[0]]), float(self._torques[self._motors[1]])),
            inertial=self._inertial.read(self._rotation, self._rates),
            bumpers=self._pressed(),
            sonar=self._sonars.read(self._data) if self._sonars else None,
            scan=scan,
        )

    def apply(self, actuation: Actuation) -> None:
        """Tell motors and brakes what to do."""
        self._told[self._motors[0]], self._told[self._motors[1]] = actuation.left, actuation.right
        if actuation.braked is not self._braked:
            self._braked = actuation.braked
            self._model.dof_frictionloss[self._dofs] = BRAKE_TORQUE if self._braked else self._friction

    def grip(self, wheel: str, friction: float | None) -> None:
        """Give a tyre, left or right, a coefficient of friction, or None for its own."""
        for geom in self._tyres[wheel]:
            own, priority = self._tyre_friction
            self._model.geom_friction[geom, 0] = own[geom] if friction is None else friction
            # Of two that touch the greater friction counts, unless one has priority: a slick rules over the floor.
            self._model.geom_priority[geom] = priority[geom] if friction is None else priority.max() + 1

    def _pressed(self) -> frozenset[str]:
        if not self._bumpers:
            return NOTHING
        touched = set(self._data.contact.geom.ravel().tolist())
        return frozenset(name for name, geom in self._bumpers.items() if geom in touched)


def _tyre(model: mujoco.MjModel, body: int) -> list[int]:
    """Geoms of a wheel's body that touch the floor."""
    geoms = range(model.body_geomadr[body], model.body_geomadr[body] + model.body_geomnum[body])
    return [geom for geom in geoms if model.geom_contype[geom] or model.geom_conaffinity[geom]]
