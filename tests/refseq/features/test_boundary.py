import math

import numpy as np
import pytest

from refseq.features.boundary import ScanBoundary, boundary_of
from refseq.planar import Pose
from refseq.view import Scan, View
from tests.refseq.rooms import cast, rectangle


@pytest.mark.parametrize("beams", [181, 361])
@pytest.mark.parametrize(("width", "depth"), [(3.0, 3.0), (2.4, 12.0), (6.0, 2.0)])
def test_a_rectangle_seen_from_its_back_wall(width: float, depth: float, beams: int) -> None:
    """The whole room is seen: area and sides are its own, but for corners that fall between two beams."""
    boundary = boundary_of(cast(rectangle(0, -width / 2, depth, width / 2), Pose(0.0, 0.0, 0.0), beams))
    assert boundary.area == pytest.approx(width * depth, rel=0.02)
    assert boundary.longest == pytest.approx(max(width, depth), rel=0.02)
    assert boundary.shortest == pytest.approx(min(width, depth), rel=0.02)
    assert boundary.ratio == pytest.approx(max(width, depth) / min(width, depth), rel=0.04)


def test_a_half_disc() -> None:
    boundary = boundary_of(Scan(np.full(361, 5.0, np.float32)))
    assert boundary.area == pytest.approx(math.pi * 25 / 2, rel=1e-3)
    assert (boundary.longest, boundary.shortest) == pytest.approx((10.0, 5.0), rel=1e-3)


@pytest.mark.parametrize("heading", [0.0, 0.3, np.pi / 4, 1.2, np.pi / 2])
def test_area_does_not_depend_on_the_heading(heading: float) -> None:
    """From a corner all of the room is seen at any of these headings."""
    assert boundary_of(cast(rectangle(0, 0, 8, 2), Pose(0.001, 0.001, heading))).area == pytest.approx(16.0, rel=0.03)


@pytest.mark.parametrize("heading", [0.0, 0.1])
def test_a_corridor_is_long_and_as_narrow_as_it_is(heading: float) -> None:
    """The dimensions are principal extents: a robot that is a little turned does not see a wider corridor."""
    boundary = boundary_of(cast(rectangle(-30, -1.2, 30, 1.2), Pose(0, 0, heading)))
    assert boundary.shortest == pytest.approx(2.4, rel=0.1)
    assert boundary.longest > 8 * boundary.shortest


def test_beams_without_return_are_left_out() -> None:
    room = rectangle(0, -2, 4, 2)
    scan = cast(room, Pose(0, 0, 0))
    holes = scan.ranges.copy()
    holes[180:184] = np.inf
    boundary = boundary_of(Scan(holes))
    # The chord across the hole bends nothing, for the wall behind it is straight.
    assert boundary.area == pytest.approx(16.0, rel=0.02)


@pytest.mark.parametrize("ranges", [np.full(361, np.inf), np.zeros(361)])
def test_nothing_seen_measures_nothing(ranges: np.ndarray) -> None:
    boundary = boundary_of(Scan(ranges.astype(np.float32)))
    assert (boundary.area, boundary.longest) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("width", "depth", "expected"),
    [
        # bits: area ≥ 2, 4, 8 m²; longest ≥ 4, 8, 16 m; ratio ≥ 1, 4, 8
        (1.5, 1.0, {6}),
        (2.2, 1.5, {0, 6}),
        (2.2, 3.0, {0, 1, 6}),
        (3.0, 5.0, {0, 1, 2, 3, 6}),
        (2.0, 9.0, {0, 1, 2, 3, 4, 6, 7}),
        (2.0, 17.0, {0, 1, 2, 3, 4, 5, 6, 7, 8}),
    ],
)
def test_table_b3(width: float, depth: float, expected: set[int]) -> None:
    scan = cast(rectangle(0, -width / 2, depth, width / 2), Pose(0.0, 0.0, 0.0))
    extractor = ScanBoundary()
    assert set(extractor.observe(View(0.0, scan=scan)).ids.tolist()) == expected
    assert set(extractor.learn(View(0.0, scan=scan)).tolist()) == expected
    assert extractor.size == 9
