"""Drift of odometers whose errors are known."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from refseq.planar import Pose, after_motion
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.log_tools.drift import odometry_drift


def driven(steps: NDArray[np.float64]) -> NDArray[np.float64]:
    """Poses (n + 1, 3) of motions (n, 2): way [m] and turn [rad]."""
    pose, poses = Pose(2.0, 1.0, 0.5), []
    for way, turn in steps.tolist():
        poses.append(pose)
        pose = after_motion(pose, way, turn)
    return np.array([(one.x, one.y, one.heading) for one in (*poses, pose)])


def winding(rng: np.random.Generator, count: int = 800) -> NDArray[np.float64]:
    return np.stack([np.full(count, 0.25), 0.08 * np.cumsum(rng.normal(size=count) * 0.3) % 0.2 - 0.1], axis=1)


def test_errors_that_were_put_in_are_found() -> None:
    rng = np.random.default_rng(3)
    true = winding(rng)
    walk = 0.01
    seen = true.copy()
    seen[:, 1] += 0.004 * true[:, 0] + 0.03 * true[:, 1] + walk * math.sqrt(0.25) * rng.normal(size=len(true))
    seen[:, 0] *= 1.02
    found = odometry_drift(driven(true), driven(seen), "made")
    assert found.way == pytest.approx(200.0, rel=0.01)
    assert found.bend == pytest.approx(0.004, abs=3 * walk / math.sqrt(200))
    assert found.turn == pytest.approx(0.03, abs=0.01)
    assert found.walk == pytest.approx(walk, rel=0.3)
    assert found.length == pytest.approx(0.02, abs=0.002)


def test_a_perfect_odometer_in_a_frame_of_its_own_does_not_drift() -> None:
    true = driven(winding(np.random.default_rng(1)))
    turn = 2.0
    axes = np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
    own = np.column_stack([true[:, :2] @ axes + (7.0, -2.0), true[:, 2] + turn])
    found = odometry_drift(true, own, "made")
    assert (found.bend, found.turn, found.walk, found.length, found.off) == pytest.approx((0, 0, 0, 0, 0), abs=1e-9)


def test_too_short_a_way_is_told() -> None:
    with pytest.raises(ScenarioError, match=r"^made: 4.5 m of true poses tell no drift; valid are 33 m and more$"):
        odometry_drift(driven(np.tile([0.25, 0.0], (20, 1))), driven(np.tile([0.25, 0.0], (20, 1))), "made")
