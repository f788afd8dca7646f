"""The monitor of all sensors: takes views in their order, declares faults, and tells what can still be used."""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from refseq.fault import CLOCK, ODOMETRY, DeclaredFault, FaultKind
from refseq.health.change import CERTAIN, MOST, ChangeTest, Moment, bounded
from refseq.health.pictures import PictureWatch
from refseq.health.scan_motion import STILL, MotionRatios, MotionWatch
from refseq.health.scans import ScanWatch
from refseq.health.stamps import StampWatch
from refseq.health.standing import Sight, StandWatch, Step
from refseq.view import LASER, View, measures

OF_CAMERA = (FaultKind.BLANK, FaultKind.FROZEN, FaultKind.EXCHANGED)
OF_LASER = (FaultKind.BLIND, FaultKind.FROZEN, FaultKind.MIRRORED)
OF_ODOMETRY = (FaultKind.LOST, FaultKind.FROZEN, FaultKind.DOUBLED, FaultKind.REVERSED, FaultKind.SLIPPING)


class SensorTests:
    """The tests of one sensor for its faults: one stands at a time, the one that explains most."""

    def __init__(self, sensor: str, kinds: Iterable[FaultKind]) -> None:
        self._sensor = sensor
        self._tests = {kind: ChangeTest() for kind in kinds}
        self.fault: DeclaredFault | None = None

    def update(self, now: Moment, kind: FaultKind, ratio: float, change: float | None = None) -> None:
        """Take the view of a moment for one of the tests; while another fault stands it is not asked."""
        if self.fault is None or self.fault.kind is kind:
            self._tests[kind].update(now, ratio, change)

    def suspected(self, kind: FaultKind) -> bool:
        """True while more speaks for this fault than for health, and while it stands."""
        test = self._tests.get(kind)
        return test is not None and (test.declared or test.score > 0)

    @property
    def doubted(self) -> bool:
        """True while the sensor may show nothing, or the same again and again."""
        return any(self.suspected(kind) for kind in (FaultKind.BLANK, FaultKind.BLIND, FaultKind.FROZEN))

    def conclude(self) -> None:
        """Declare what is due, or take it back."""
        if self.fault is not None:
            test = self._tests[self.fault.kind]
            if test.due:
                test.turn_over()
                self.fault = None
            return
        kind, test = max(self._tests.items(), key=lambda pair: pair[1].score)
        if test.due:
            since = test.since
            test.turn_over()
            self.fault = DeclaredFault(self._sensor, kind, *since, test.evidence)
            for other in self._tests.values():
                other.restart()


@dataclass(frozen=True, slots=True)
class Health:
    """Faults that stand at a view, the view without the sensors that they make useless, and how the robot moved.

    ``carried`` is the log-likelihood ratio of a robot that was carried, by its scans (``MotionRatios``) [nats].
    """

    faults: tuple[DeclaredFault, ...]
    usable: View
    step: Step
    carried: float = 0.0


class HealthMonitor:
    """Tests every sensor of a robot by itself, and laser and cameras against the odometer.

    Neither truth nor map is asked. A view without a sensor says nothing of it. Robots of any speed and spacing of views
    fit, as all is measured per way and against the drive's own past.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget all views seen: all sensors are well."""
        self._now = Moment(-1, 0.0)
        self._tests: dict[str, SensorTests] = {
            LASER: SensorTests(LASER, OF_LASER),
            ODOMETRY: SensorTests(ODOMETRY, OF_ODOMETRY),
            CLOCK: SensorTests(CLOCK, (FaultKind.JUMPING,)),
        }
        self._cameras: dict[str, SensorTests] = {}
        self._pictures: dict[str, PictureWatch] = {}
        self._scans, self._stamps = ScanWatch(), StampWatch()
        self._motion, self._stand = MotionWatch(), StandWatch()
        self._had_odometry = False

    @property
    def faults(self) -> tuple[DeclaredFault, ...]:
        """Faults that stand."""
        return tuple(tests.fault for tests in self._all if tests.fault is not None)

    @property
    def _all(self) -> tuple[SensorTests, ...]:
        return *self._tests.values(), *self._cameras.values()

    def update(self, view: View) -> Health:
        """Take the next view."""
        self._now = Moment(self._now.view + 1, view.time)
        way = abs(view.distance) if view.has_odometry and np.isfinite(view.distance) else 0.0
        self._tests[CLOCK].update(self._now, FaultKind.JUMPING, self._stamps.update(view.time, way))
        moved = self._look_at_pictures(view, way)
        motion = self._look_at_scan(view, way)
        self._look_at_odometry(view, motion, moved)
        for tests in self._all:
            tests.conclude()
        faults = self.faults
        usable = usable_view(view, faults)
        trusted = self._tests[ODOMETRY].fault is None
        step = self._stand.update(view, self._sight(usable), trusted=trusted)
        return Health(faults, usable, step, 0.0 if self._tests[LASER].doubted else motion.carried)

    def _sight(self, view: View) -> Sight:
        """The sensors that can tell of motion: those of which nothing is suspected."""
        images = {name: one for name, one in view.images.items() if not self._cameras[name].doubted}
        return Sight(images, None if self._tests[LASER].doubted else view.scan)

    def compare(self, exchanged: Mapping[str, float]) -> tuple[DeclaredFault, ...]:
        """Take the ratios of cameras at the last view whose pictures may be another's [nats]; returns all faults."""
        for name, ratio in exchanged.items():
            self._cameras[name].update(self._now, FaultKind.EXCHANGED, bounded(ratio))
            self._cameras[name].conclude()
        return self.faults

    def _look_at_pictures(self, view: View, way: float) -> float:
        """Test the cameras; returns by how much their pictures say that the robot has moved [nats]."""
        moved = 0.0
        for name, image in view.images.items():
            tests = self._cameras.setdefault(name, SensorTests(name, OF_CAMERA))
            ratios = self._pictures.setdefault(name, PictureWatch()).update(image, way)
            tests.update(self._now, FaultKind.BLANK, ratios.blank)
            tests.update(self._now, FaultKind.FROZEN, ratios.frozen)
            moved += 0.0 if tests.doubted else ratios.moved
        return moved

    def _look_at_scan(self, view: View, way: float) -> MotionRatios:
        """Test the laser, and compare its motion with the odometer's."""
        scan = view.scan
        if scan is None:
            return self._motion.update(None, view)
        tests = self._tests[LASER]
        ratios = self._scans.update(scan, way, suspected=tests.suspected(FaultKind.BLIND))
        tests.update(self._now, FaultKind.BLIND, ratios.blind)
        tests.update(self._now, FaultKind.FROZEN, ratios.frozen)
        return self._motion.update(None if ratios.repeated else scan, view)

    def _look_at_odometry(self, view: View, motion: MotionRatios, moved: float) -> None:
        """Test the odometer against the laser, or the laser against the odometer where that is ill."""
        odometry, laser = self._tests[ODOMETRY], self._tests[LASER]
        # The first view has no motion yet, so that only the second tells whether there is an odometer at all.
        lost = (self._had_odometry or self._now.view > 0) and not measures(view)
        self._had_odometry = self._had_odometry or measures(view)
        odometry.update(self._now, FaultKind.LOST, CERTAIN if lost else -CERTAIN)
        if lost or not self._now.view or not measures(view):
            return
        stands = abs(view.distance) < STILL and abs(view.turn) < STILL
        seen = motion.odometry.get(FaultKind.FROZEN, 0.0)
        odometry.update(self._now, FaultKind.FROZEN, bounded(seen + moved) if stands else -MOST)
        if laser.fault is None:
            for kind in (FaultKind.DOUBLED, FaultKind.REVERSED, FaultKind.SLIPPING):
                odometry.update(self._now, kind, motion.odometry.get(kind, 0.0))
        if odometry.fault is None:
            laser.update(self._now, FaultKind.MIRRORED, motion.mirrored, motion.flipped)


def usable_view(view: View, faults: Collection[DeclaredFault]) -> View:
    """A view without what declared faults make useless; stamps that jump cost nothing."""
    if not faults:
        return view
    ill = {fault.sensor for fault in faults}
    if ODOMETRY in ill:
        view = replace(view, distance=0.0, turn=0.0, has_odometry=False)
    images = {name: image for name, image in view.images.items() if name not in ill}
    return replace(view, images=images, scan=None if LASER in ill else view.scan)
