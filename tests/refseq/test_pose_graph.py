"""Pose graphs against poses that are known, and a scale that can be counted out."""

import numpy as np
import pytest

from refseq.planar import wrapped
from refseq.pose_graph import Relations, best_fit, motions_between, moved

SQUARE = np.array([[0, 0, 0], [4, 0, np.pi / 2], [4, 4, np.pi], [0, 4, -np.pi / 2]], float)


def test_a_motion_between_poses_leads_from_one_to_the_other() -> None:
    rng = np.random.default_rng(1)
    one, other = rng.normal(size=(2, 20, 3))
    assert moved(one, motions_between(one, other)) == pytest.approx(other)


def test_relations_without_errors_are_met_exactly() -> None:
    pairs = [(0, 1), (1, 2), (2, 3), (3, 0)]
    motions = [motions_between(SQUARE[a], SQUARE[b]) for a, b in pairs]
    start = SQUARE + np.random.default_rng(2).normal(scale=0.2, size=SQUARE.shape) * (np.arange(4) > 0)[:, None]
    fit = best_fit(Relations.of(pairs, motions, (0.1, 0.1, 0.05)), start)
    difference = fit.poses - SQUARE
    difference[:, 2] = wrapped(difference[:, 2])
    assert np.abs(difference).max() < 1e-6
    assert fit.squares == pytest.approx(np.zeros(4), abs=1e-9)


def test_what_does_not_close_is_shared_by_how_sure_each_is() -> None:
    """Two measures of one way, 1 m with sigma 0.1 and 2 m with sigma 0.3: the mean weighted by 1/sigma² is 1.1 m."""
    fit = best_fit(Relations.of([(0, 1), (0, 1)], [(1, 0, 0), (2, 0, 0)], [(0.1,) * 3, (0.3,) * 3]), np.zeros((2, 3)))
    assert fit.poses[1] == pytest.approx([1.1, 0, 0])
    assert fit.squares == pytest.approx([1.0, 9.0])


def test_an_odometer_that_counts_a_tenth_too_much_is_found_out() -> None:
    """Ten metres by the odometer, nine by something sure: the scale is −0.1 less what its own sigma holds back."""
    ways = Relations.of([(0, 1)], [(10, 0, 0)], 0.01, 0).beside(Relations.of([(0, 1)], [(9, 0, 0)], 0.01))
    fit = best_fit(ways, np.zeros((2, 3)), scale_sigma=0.05)
    assert fit.scales[0] == pytest.approx(-0.1, abs=0.001)
    assert fit.poses[1, 0] == pytest.approx(9.0, abs=0.001)
