"""Places screened for a scan, in rooms whose walls are known."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from refseq.planar import Pose
from refseq.scan_matching.fit import BEAMS, FARTHER, GRID, LaidScan, laid_scan, shares
from refseq.scan_matching.panorama import panorama
from refseq.scan_matching.screen import Screen
from tests.refseq.rooms import Wall, cast, rectangle

ROOM: list[Wall] = [*rectangle(0, -4, 30, 5), (6, -4, 6, 1), (11, 0, 11, 5), (17, -1, 17, 3), (22, -4, 24, -2)]
coordinates = st.tuples(st.floats(1, 29), st.floats(-3.5, 4.5), st.floats(-3, 3))


def seen_at(pose: Pose) -> LaidScan:
    scan = laid_scan(panorama(cast(ROOM, pose)))
    assert scan is not None
    return scan


@settings(max_examples=40)
@given(coordinates, coordinates)
def test_a_share_is_that_with_which_a_fit_begins_but_for_its_cells(
    one: tuple[float, float, float], other: tuple[float, float, float]
) -> None:
    place, scan = seen_at(Pose(*one)), seen_at(Pose(*other))
    exact = float((shares(place, scan, GRID, BEAMS) - FARTHER).max())
    assert Screen(scan).shares([None, place]).tolist() == [-np.inf, pytest.approx(exact, abs=0.15)]


def test_the_place_of_a_scan_is_among_the_first() -> None:
    """Or one beside it, every 1.5 m in a room of 30 m: a robot aside of its place, and turned, sees walls of there."""
    poses = [Pose(1.0 + 1.5 * n, 0.3, 0.0) for n in range(19)]
    places = [seen_at(pose) for pose in poses]
    for n, pose in enumerate(poses):
        seen = seen_at(Pose(pose.x + 0.3, pose.y - 0.25, 0.15))
        first = np.argsort(-Screen(seen).shares(places))[:3]
        assert {n - 1, n, n + 1} & set(first.tolist())


def test_a_scan_lies_best_where_it_was_taken() -> None:
    scan, others = seen_at(Pose(3.0, 0.0, 0.0)), [seen_at(Pose(x, 3.0, 2.0)) for x in (14.0, 25.0)]
    shares = Screen(scan).shares([*others, scan])
    assert shares[2] == pytest.approx(1.0, abs=0.03)
    assert shares.argmax() == 2
