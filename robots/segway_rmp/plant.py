"""Model of the machine for its controllers: its masses as the compiled model has them, and linear models of its motion.

Wheeled inverted pendulum, linearised about upright: x [m] is the way of the axle, θ [rad] the pitch, nose down, u
[N·m] the torque of both motors on their wheels, which pushes back on the body. m, l and I are the body's mass, its
centre's height above the axle and its inertia about that centre; M, J and r the wheels' mass, inertia and radius; R and
d the rotors' inertia and the damping, both on the angle x/r − θ between wheel and body:

    (m + M + J/r² + R/r²) ẍ + (m l − R/r) θ̈           = (u − d (ẋ/r − θ̇)) / r
    (m l − R/r) ẍ           + (I + m l² + R) θ̈ − m g l θ = −(u − d (ẋ/r − θ̇))
"""

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

GRAVITY = 9.81

Matrix = NDArray[np.float64]


class Linear(NamedTuple):
    """``state' = a @ state + b @ effort``: from tick to tick where it is discrete, a rate where it is continuous."""

    a: Matrix
    b: Matrix

    def sampled(self, period: float) -> "Linear":
        """Return the discrete system of an effort that is held for ``period`` [s]."""
        return _sampled(self.a.tobytes(), self.b.tobytes(), self.b.shape, period)


@lru_cache(maxsize=64)  # of few machines, each met again whenever one of its kind wakes up
def _sampled(a: bytes, b: bytes, shape: tuple[int, int], period: float) -> Linear:
    from scipy.linalg import expm  # a tenth of a second to import, which only a machine that balances waits for

    states, efforts = shape
    both = np.zeros((states + efforts, states + efforts))  # an effort that is held is a state that does not change
    both[:states, :states] = np.frombuffer(a).reshape(states, states)
    both[:states, states:] = np.frombuffer(b).reshape(shape)
    held = expm(period * both)
    held.setflags(write=False)
    return Linear(held[:states, :states], held[:states, states:])


class Course(NamedTuple):
    """Where a point of the machine is to be and how that changes: place [m], and its rates up to the fourth."""

    place: float
    speed: float
    acceleration: float
    jerk: float
    snap: float


class Posture(NamedTuple):
    """Posture and torque that a course asks of the machine: states x, ẋ, θ, θ̇ and the torque of both motors [N·m]."""

    place: float
    speed: float
    pitch: float
    rate: float
    torque: float


@dataclass(frozen=True, slots=True)
class Flatness:
    """The point of the body that moves as gravity alone makes it: y = x + ``arm`` θ, ÿ = θ / ``tilt``.

    It is the pendulum's flat output (``arm`` [m] is where the torque of the motors cancels out of its motion): from its
    course all else follows, so a machine that is to follow one knows beforehand how to lean, and that its wheels have
    to go back before it can go forward. ``tilt`` [rad·s²/m]; ``push`` [kg·m] and ``swing`` [kg·m²] give the torque.
    """

    arm: float
    tilt: float
    push: float
    swing: float

    def posture(self, course: Course) -> Posture:
        """Return what ``course`` of that point asks for; damping left out."""
        rate, turning = self.tilt * course.jerk, self.tilt * course.snap
        return Posture(
            place=course.place - self.arm * self.tilt * course.acceleration,
            speed=course.speed - self.arm * rate,
            pitch=self.tilt * course.acceleration,
            rate=rate,
            torque=self.push * (course.acceleration - self.arm * turning) + self.swing * turning,
        )


@dataclass(frozen=True, slots=True)
class Plant:
    """Masses [kg], lengths [m] and inertias [kg·m²]; what there are two of (wheels, rotors) is taken together.

    ``height`` is that of the body's centre above the axle, ``pitch_inertia`` about that centre, ``yaw_inertia`` that of
    the whole machine about the vertical with its wheels rolling; ``damping`` [N·m·s/rad].
    """

    body_mass: float
    height: float
    pitch_inertia: float
    wheel_mass: float
    wheel_inertia: float
    wheel_radius: float
    rotor_inertia: float
    damping: float
    yaw_inertia: float
    track: float

    def loaded(self, mass: float, height: float) -> "Plant":
        """Return the machine with a point of ``mass`` [kg] ``height`` [m] above the axle; negative takes it away."""
        total = self.body_mass + mass
        centre = (self.body_mass * self.height + mass * height) / total
        apart = self.body_mass * (self.height - centre) ** 2 + mass * (height - centre) ** 2
        return replace(self, body_mass=total, height=centre, pitch_inertia=self.pitch_inertia + apart)

    @property
    def rolling_mass(self) -> float:
        """Mass that the wheels' rim has to push along [kg]."""
        return self.body_mass + self.wheel_mass + self.wheel_inertia / self.wheel_radius**2

    def _masses(self) -> Matrix:
        """Mass matrix (2, 2) of (x, θ)."""
        radius, rotor = self.wheel_radius, self.rotor_inertia
        coupled = self.body_mass * self.height - rotor / radius
        upright = self.pitch_inertia + self.body_mass * self.height**2 + rotor
        return np.array([[self.rolling_mass + rotor / radius**2, coupled], [coupled, upright]])

    @property
    def _moment(self) -> float:
        """Gravity's moment on the body for each radian of pitch [N·m]."""
        return self.body_mass * GRAVITY * self.height

    def pitching(self) -> Linear:
        """The pendulum: states x, ẋ, θ, θ̇; one effort, the torque of both motors."""
        mass, push = self._masses(), np.array([1 / self.wheel_radius, -1.0])  # of a torque on (x, θ)
        drag = -self.damping * np.outer(push, push)
        a, b = np.zeros((4, 4)), np.zeros((4, 1))
        a[0, 1] = a[2, 3] = 1.0
        a[np.ix_([1, 3], [0, 2])] = np.linalg.solve(mass, np.diag([0.0, self._moment]))
        a[np.ix_([1, 3], [1, 3])] = np.linalg.solve(mass, drag)
        b[[1, 3], 0] = np.linalg.solve(mass, push)
        return Linear(a, b)

    def standing(self) -> Linear:
        """The same states as ``pitching`` where a third support holds the body: nothing moves its pitch."""
        rolling = self.rolling()
        a, b = np.zeros((4, 4)), np.zeros((4, 1))
        a[2, 3] = 1.0
        a[:2, :2], b[:2] = rolling
        return Linear(a, b)

    def flatness(self) -> Flatness:
        """Return the flat output: the first line of the model, taken r times, plus the second has no torque in it."""
        (rolling, coupled), (_, upright) = self._masses().tolist()
        radius = self.wheel_radius
        along = radius * rolling + coupled
        arm, tilt = (radius * coupled + upright) / along, along / self._moment
        return Flatness(arm, tilt, push=radius * rolling, swing=radius * coupled)

    def yawing(self) -> Linear:
        """Turning on the spot: states ψ, ψ̇; the effort is the right motor's torque less the left one's."""
        return _pushed(self.yaw_inertia, self.track / 2 / self.wheel_radius)

    def rolling(self) -> Linear:
        """Driving with a third support: states x, ẋ; the effort is the torque of both motors."""
        return _pushed(self.rolling_mass + self.rotor_inertia / self.wheel_radius**2, 1 / self.wheel_radius)


def _pushed(inertia: float, arm: float) -> Linear:
    return Linear(np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [arm / inertia]]))


def plant_of(model: mujoco.MjModel, joints: tuple[str, str]) -> Plant:
    """Read the machine from its compiled model, of which ``joints`` turn the wheels."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    wheels = [int(model.joint(name).bodyid[0]) for name in joints]
    dofs = [int(model.joint(name).dofadr[0]) for name in joints]
    body = [index for index in range(1, model.nbody) if index not in wheels]
    mass, centre, inertia = _together(model, data, body)
    axle = data.xpos[wheels].mean(axis=0)
    radius = float(axle[2])
    track = float(np.ptp(data.xpos[wheels, 1]))
    wheel_mass = float(model.body_mass[wheels].sum())
    spin = float(sum(_inertia(model, data, wheel)[1, 1] for wheel in wheels))
    across = float(sum(_inertia(model, data, wheel)[2, 2] for wheel in wheels))
    rotors = float(model.dof_armature[dofs].sum())
    rim = wheel_mass + (spin + rotors) / radius**2
    return Plant(
        body_mass=mass,
        height=float(centre[2]) - radius,
        pitch_inertia=float(inertia[1, 1]),
        wheel_mass=wheel_mass,
        wheel_inertia=spin,
        wheel_radius=radius,
        rotor_inertia=rotors,
        damping=float(model.dof_damping[dofs].sum()),
        yaw_inertia=float(inertia[2, 2]) + across + rim * (track / 2) ** 2 + mass * float(centre[0] - axle[0]) ** 2,
        track=track,
    )


def _together(model: mujoco.MjModel, data: mujoco.MjData, bodies: list[int]) -> tuple[float, Matrix, Matrix]:
    """Mass, centre (3,) and inertia about it (3, 3) of some bodies taken as one."""
    mass = float(model.body_mass[bodies].sum())
    centre = model.body_mass[bodies] @ data.xipos[bodies] / mass
    inertia = np.zeros((3, 3))
    for body in bodies:
        off = data.xipos[body] - centre
        inertia += _inertia(model, data, body) + model.body_mass[body] * (off @ off * np.eye(3) - np.outer(off, off))
    return mass, centre, inertia


def _inertia(model: mujoco.MjModel, data: mujoco.MjData, body: int) -> Matrix:
    turn = data.ximat[body].reshape(3, 3)
    inertia: Matrix = turn @ np.diag(model.body_inertia[body]) @ turn.T
    return inertia
