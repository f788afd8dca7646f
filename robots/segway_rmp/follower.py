"""Where a command of speed leads: a course without steps."""

from collections import deque

from refseq_bench.robots.segway_rmp.plant import Course


class Follower:
    """A ramp up to ``acceleration``, averaged twice over ``smoothing`` [s] each so that its jerk has no steps.

    It is asked every ``period`` [s].
    """

    def __init__(self, acceleration: float, smoothing: float, period: float) -> None:
        self.course = Course(0.0, 0.0, 0.0, 0.0, 0.0)
        ticks = max(1, round(smoothing / period))
        self._period, self._step = period, acceleration * period
        self._ramp, self._once = deque([0.0] * ticks, maxlen=ticks), deque([0.0] * ticks, maxlen=ticks)

    def follow(self, wanted: float) -> None:
        """Go on by a tick towards a speed."""
        last, ramp, period = self.course, self._ramp[-1], self._period
        self._ramp.append(ramp + min(max(wanted - ramp, -self._step), self._step))
        self._once.append(sum(self._ramp) / len(self._ramp))
        speed = sum(self._once) / len(self._once)
        acceleration = (speed - last.speed) / period
        jerk = (acceleration - last.acceleration) / period
        snap = (jerk - last.jerk) / period
        self.course = Course(last.place + (last.speed + speed) / 2 * period, speed, acceleration, jerk, snap)

    def start(self, place: float, speed: float) -> None:
        """Go on from another place at another speed."""
        self.course = Course(place, speed, 0.0, 0.0, 0.0)
        for speeds in (self._ramp, self._once):
            speeds.extend([speed] * len(speeds))
