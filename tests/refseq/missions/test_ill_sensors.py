"""A mission in a corridor whose only sensor dies half-way: the robot stands, as it does whenever it is lost."""

from collections.abc import Iterator
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from refseq.belief import Belief
from refseq.map.learning import learn
from refseq.map.localiser import Localiser
from refseq.map.map import Map
from refseq.missions.executor import Executor, ExecutorSettings, Status
from refseq.missions.path import MissionPath, path_along
from refseq.missions.plan import as_learnt
from refseq.planar import Pose
from refseq.view import Scan, View
from tests.refseq.health.drives import WALLS
from tests.refseq.missions.on_a_line import VIEW, Line
from tests.refseq.rooms import cast

SPACING = 0.5


def seen_from(x: float, rng: np.random.Generator) -> Scan:
    return cast(WALLS, Pose(x, 0.0, 0.0), rng=rng)


def reference() -> Iterator[View]:
    rng = np.random.default_rng(1)
    for number in range(51):
        x = SPACING * number
        yield View(number * 1.0, scan=seen_from(x, rng), distance=SPACING if number else 0.0, truth=Pose(x, 0.0, 0.0))


@cache
def learnt() -> Map:
    return learn(list(reference()), profile="best")


@cache
def way() -> MissionPath:
    path = path_along(learnt())
    return replace(path, behaviours=(f"MN:{path.length:.2f}", *path.behaviours[1:]))


DIES = 12.0
"""From here on the laser is ill [m]."""
SETTINGS = ExecutorSettings()


class Corridor:
    """The made-up corridor through a laser that falls ill at ``DIES``, and for so many seconds; a localiser answers."""

    def __init__(self, ill: str, seconds: float = np.inf) -> None:
        self._localiser, self._ill, self._seconds = Localiser(learnt()), ill, seconds
        self._rng = np.random.default_rng(5)
        self._last: tuple[float, Scan] | None = None
        self._fell: float | None = None
        self.told: list[Belief] = []
        self.line: Line

    def __call__(self, number: int, x: float) -> Belief:
        time = self.line.time
        if self._fell is None and x >= DIES:
            self._fell = time
        ill = self._fell is not None and self._ill != "" and time - self._fell < self._seconds
        before, last = self._last if self._last is not None else (x, None)
        scan = seen_from(x, self._rng)
        if ill and self._ill == "blind":
            scan = replace(scan, ranges=np.full_like(scan.ranges, np.inf))
        elif ill and last is not None:
            scan = last
        self._last = x, scan
        belief = self._localiser.update(View(time, scan=scan, distance=x - before))
        self.told.append(belief)
        return belief


def mission(corridor: Corridor) -> Line:
    corridor.line = Line(Executor(as_learnt(way()), settings=SETTINGS), corridor)
    return corridor.line.run()


def test_with_a_laser_that_is_well_it_arrives():
    line = mission(corridor := Corridor(""))
    assert line.executor.status is Status.COMPLETED
    assert line.x == pytest.approx(way().length, abs=1.0)
    assert not any(belief.faults for belief in corridor.told)


@pytest.mark.parametrize("ill", ["blind", "stuck"])
def test_it_stands_soon_after_its_only_sensor_has_died_and_gives_up(ill):
    line = mission(corridor := Corridor(ill))
    assert line.executor.status is Status.FAILED
    assert line.executor.why == f"lost for {SETTINGS.patience:g} s"
    # Two views declare the fault, three that say lost make it stand.
    assert DIES < line.x <= DIES + (2 + SETTINGS.progress.lost) * VIEW
    assert all(belief.lost == 1.0 for belief in corridor.told if belief.faults)
    assert line.halted >= SETTINGS.patience - 1.0


def test_it_goes_on_when_the_laser_sees_again():
    line = mission(Corridor("blind", seconds=20.0))
    assert line.executor.status is Status.COMPLETED
    assert line.x == pytest.approx(way().length, abs=1.0)
    assert line.halted > 1.0
