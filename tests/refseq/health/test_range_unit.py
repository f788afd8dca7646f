"""Unit of a laser's ranges by the way that its scans show, in rooms of known geometry."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from refseq.health.range_unit import FEWEST, PAIRS, range_unit_doubt
from refseq.planar import Pose
from refseq.view import Scan, View
from tests.refseq.rooms import Wall, cast, rectangle

HALL: list[Wall] = [
    *rectangle(0, 0, 30, 5), *rectangle(4, 0, 5, 1.2), *rectangle(9, 4, 10.5, 5), *rectangle(14, 0, 15, 1),
    *rectangle(19, 4.2, 21, 5), *rectangle(24, 0, 25, 1.5),
]  # fmt: skip
BARE: list[Wall] = rectangle(-60, 0, 90, 2.4)


def drive(walls: list[Wall], unit: float, step: float = 0.85, count: int = 28, shown: float = 1.0) -> list[View]:
    """A drive straight on: ranges in ``unit`` of a metre, and an odometer that tells ``shown`` of the way."""
    rng, views = np.random.default_rng(1), []
    for number in range(count):
        scan = cast(walls, Pose(1.0 + abs(step) * number, 2.0, 0.0 if step > 0 else np.pi), rng=rng)
        scan = replace(scan, ranges=scan.ranges / np.float32(unit))
        views.append(View(float(number), {}, scan, step * shown if number else 0.0))
    return views


def told(views: Sequence[View]) -> str:
    return range_unit_doubt(views, lambda numbers: [views[number].scan for number in numbers])


@pytest.mark.parametrize(
    ("unit", "name"),
    [(0.3048, "feet"), (0.0254, "inches"), (0.01, "centimetres"), (0.001, "millimetres"), (1 / 7, "metres")],
)
def test_another_unit_is_told_by_its_name(unit: float, name: str) -> None:
    told_ = told(drive(HALL, unit))
    assert told_.startswith("its scans show a way ")
    assert told_.endswith(f" times as long as the odometry's: are its ranges in {name}?")
    assert float(told_.split()[5]) == pytest.approx(1 / unit, rel=0.15)


@pytest.mark.parametrize("step", [0.85, 0.3, -0.85], ids=["apart", "dense", "reversing"])
def test_metres_are_not_asked_about(step: float) -> None:
    assert told(drive(HALL, 1.0, step)) == ""
    assert told(drive(HALL, 0.01, step)) != ""


@pytest.mark.parametrize("shown", [0.5, 0.8, 1.3, 2.0])
def test_an_odometer_that_is_off_is_no_other_unit(shown: float) -> None:
    assert told(drive(HALL, 1.0, shown=shown)) == ""


def test_where_nothing_tells_the_way_nothing_is_said() -> None:
    assert told(drive(BARE, 0.01)) == "", "a bare corridor"
    assert told([replace(view, distance=0.0) for view in drive(HALL, 0.01)]) == "", "a robot that stands"
    assert told([replace(view, turn=0.3) for view in drive(HALL, 0.01)]) == "", "a robot that turns all the way"
    assert told([replace(view, scan=None) for view in drive(HALL, 0.01)]) == ""
    assert told(drive(HALL, 0.01, count=FEWEST)) == "", "too few pairs"
    blind = Scan(np.full(361, np.inf, np.float32))
    assert told([replace(view, scan=blind) for view in drive(HALL, 0.01)]) == ""
    assert told([]) == ""


def test_few_scans_are_asked_for() -> None:
    asked: list[int] = []
    views = drive(HALL, 0.01, step=0.03, count=800)

    def scans(numbers: Sequence[int]) -> list[Scan | None]:
        asked.extend(numbers)
        return [views[number].scan for number in numbers]

    assert range_unit_doubt(views, scans).endswith("centimetres?")
    assert asked == sorted(set(asked))
    assert len(asked) <= 2 * PAIRS
