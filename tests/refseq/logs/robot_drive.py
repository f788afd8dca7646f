"""A robot that drives down a winding corridor with a camera, a laser, odometry and truth, each at its own rate.

No bag, no file: moments of sensing in order of logging, which ``foreign`` writes with other projects' writers. All is a
function of time, so that a view's truth, motion, picture and scan can be asked for at any moment.
"""

import math
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from refseq.planar import Pose
from tests.refseq.rooms import Wall, rays

PIXELS_PER_METRE = 24
HEIGHT, WIDTH = 48, 64
HERE = Pose(0.0, 0.0, 0.0)
ODOMETER_START = Pose(-3.0, 7.0, 2.5)


class Sense(StrEnum):
    """Kinds of moments."""

    PICTURE = "picture"
    SCAN = "scan"
    ODOMETRY = "odometry"
    TRUTH = "truth"


@dataclass(frozen=True)
class Moment:
    """Something sensed at ``time`` and logged at ``logged``, both [s] on the robot's clock."""

    sense: Sense
    time: float
    logged: float


@dataclass(frozen=True)
class RobotDrive:
    """A drive of ``seconds`` at ``speed`` [m/s], its sensors' rates [Hz] and what is wrong with them.

    ``jitter`` [s] is the standard deviation of a sensor's period, ``gap`` [s since the start] a stretch without
    pictures, ``camera_delay`` [s] by how much the camera's stamps are late. ``origin`` is where the odometer starts,
    ``drift`` [rad/m] how it goes wrong.
    """

    seconds: float = 20.0
    speed: float = 0.8
    start: float = 1_700_000_000.25
    camera_rate: float = 10.0
    laser_rate: float = 10.0
    laser_phase: float = 0.037
    odometry_rate: float = 20.0
    truth_rate: float = 5.0
    jitter: float = 0.002
    latency: float = 0.004
    gap: tuple[float, float] | None = None
    camera_delay: float = 0.0
    origin: Pose = ODOMETER_START
    drift: float = 0.0
    brightness: float = 1.0
    seed: int = 7

    def pose(self, time: float) -> Pose:
        """True pose: the way winds by 0.3 m about the corridor's middle."""
        x = 1.0 + self.speed * (time - self.start)
        return Pose(x, 0.3 * math.sin(x / 3), math.atan(0.1 * math.cos(x / 3)))

    def odometry(self, time: float) -> Pose:
        """Pose in the odometer's frame, which lies elsewhere and turns with the drift."""
        first, now = self.pose(self.start), self.pose(time)
        bend = self.drift * (now.x - first.x)
        angle = self.origin.heading - first.heading + bend / 2
        dx, dy = now.x - first.x, now.y - first.y
        cos, sin = math.cos(angle), math.sin(angle)
        return Pose(
            self.origin.x + cos * dx - sin * dy,
            self.origin.y + sin * dx + cos * dy,
            self.origin.heading + now.heading - first.heading + bend,
        )

    @cached_property
    def _panorama(self) -> NDArray[np.uint8]:
        rng = np.random.default_rng(3)  # the place, the same in every drive
        metres = int(self.speed * self.seconds) + 8
        coarse = rng.random((HEIGHT // 6, metres * PIXELS_PER_METRE // 6))
        fine = cv2.resize(coarse, (metres * PIXELS_PER_METRE, HEIGHT), interpolation=cv2.INTER_CUBIC)
        return np.clip(fine * 200 * self.brightness, 0, 255).astype(np.uint8)

    def picture(self, time: float) -> NDArray[np.uint8]:
        """The wall beside the robot, (48, 64) uint8; it goes by with the way."""
        left = round(self.pose(time).x * PIXELS_PER_METRE)
        return self._panorama[:, left : left + WIDTH]

    @cached_property
    def walls(self) -> list[Wall]:
        """Two walls with niches at irregular places."""
        length, rng = self.speed * self.seconds + 12.0, np.random.default_rng(4)
        walls: list[Wall] = [(-4.0, -1.5, -4.0, 1.5), (length, -1.5, length, 1.5)]
        for side in (-1.5, 1.5):
            at = -4.0
            while at < length:
                wall, niche = rng.uniform(1.0, 4.0), rng.uniform(0.6, 1.4)
                deep = side * 1.4
                walls += [(at, side, at + wall, side), (at + wall, side, at + wall, deep)]
                walls += [
                    (at + wall, deep, at + wall + niche, deep),
                    (at + wall + niche, deep, at + wall + niche, side),
                ]
                at += wall + niche
        return walls

    def ranges(self, time: float, bearings: NDArray[np.float64], mount: Pose = HERE) -> NDArray[np.float32]:
        """Ranges of a laser mounted at ``mount`` on the robot, in directions of its own frame, (n,) [m]."""
        robot = self.pose(time)
        cos, sin = math.cos(robot.heading), math.sin(robot.heading)
        at = Pose(robot.x + cos * mount.x - sin * mount.y, robot.y + sin * mount.x + cos * mount.y, 0.0)
        return rays(self.walls, at, robot.heading + mount.heading + bearings).astype(np.float32)

    @cached_property
    def moments(self) -> tuple[Moment, ...]:
        """All that is sensed, in order of logging."""
        rng = np.random.default_rng(self.seed)
        rates = {
            Sense.PICTURE: (self.camera_rate, 0.0),
            Sense.SCAN: (self.laser_rate, self.laser_phase),
            Sense.ODOMETRY: (self.odometry_rate, 0.011),
            Sense.TRUTH: (self.truth_rate, 0.019),
        }
        found = []
        for sense, (rate, phase) in rates.items():
            ticks = np.arange(int(self.seconds * rate)) / rate + phase if rate else np.zeros(0)
            for since in ticks + self.jitter * rng.standard_normal(len(ticks)).clip(-2, 2):
                if sense is Sense.PICTURE and self.gap and self.gap[0] <= since < self.gap[1]:
                    continue
                time = self.start + float(since)
                found.append(Moment(sense, time, time + self.latency * float(rng.uniform(0.2, 1))))
        return tuple(sorted(found, key=lambda moment: moment.logged))
