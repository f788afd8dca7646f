"""Headings against a trajectory's own path: each fault told as that, and drives of honest robots as none."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from refseq.logs.trajectories.course import HeadingFault, heading_doubt
from refseq.logs.trajectory import Trajectory

Poses = NDArray[np.float64]
QUARTER = math.pi / 2


def corner(step: float = 0.05, radius: float = 1.2) -> Poses:
    """Poses along 12 m, a quarter circle to the left, and 6 m more, (n, 3)."""
    along = np.arange(0.0, 12.0 + radius * QUARTER + 6.0, step)
    turned = ((along - 12.0) / radius).clip(0.0, QUARTER)
    x = np.minimum(along, 12.0) + radius * np.sin(turned)
    y = radius * (1 - np.cos(turned)) + (along - 12.0 - radius * QUARTER).clip(0.0)
    return np.column_stack([x, y, turned])


def fault_of(poses: Poses) -> HeadingFault | None:
    found = heading_doubt(Trajectory(0.1 * np.arange(len(poses)), poses))
    return found.fault if found else None


def turned(poses: Poses, angle: float) -> Poses:
    return poses + np.array([0.0, 0.0, angle])


FAULTY = {
    "clockwise": (corner() * [1, 1, -1], HeadingFault.MIRRORED),
    "one axis mirrored": (corner() * [1, -1, 1], HeadingFault.MIRRORED),
    "x and y swapped": (corner()[:, [1, 0, 2]], HeadingFault.MIRRORED),
    "bearings from north": (turned(corner() * [1, 1, -1], QUARTER), HeadingFault.MIRRORED),
    "a frame to the left": (turned(corner(), QUARTER), HeadingFault.TURNED),
    "a frame to the right": (turned(corner(), -QUARTER), HeadingFault.TURNED),
    "180 degrees off": (turned(corner(), math.pi), HeadingFault.BACKWARD),
    "no heading": (corner() * [1, 1, 0], HeadingFault.CONSTANT),
    "that drift": (corner() + np.linspace([0, 0, 0.4], [0, 0, 2.7], len(corner())), HeadingFault.ASIDE),
}


@pytest.mark.parametrize(("poses", "fault"), FAULTY.values(), ids=FAULTY)
@pytest.mark.parametrize("frame", [0.0, 2.5])
def test_headings_that_contradict_the_path_are_told(poses: Poses, fault: HeadingFault, frame: float) -> None:
    """In whatever frame: an odometer may begin anywhere, and its way is turned with its headings."""
    cos, sin = math.cos(frame), math.sin(frame)
    assert fault_of(np.column_stack([poses[:, :2] @ np.array([[cos, sin], [-sin, cos]]), poses[:, 2] + frame])) is fault


@pytest.mark.parametrize(("angle", "to_left"), [(QUARTER, -90.0), (-QUARTER, 90.0), (2.0, -114.6)])
def test_a_turned_frame_tells_to_which_side_the_way_lies(angle: float, to_left: float) -> None:
    poses = turned(corner(), angle)
    found = heading_doubt(Trajectory(0.1 * np.arange(len(poses)), poses))
    assert found is not None
    assert math.degrees(found.angle) == pytest.approx(to_left, abs=0.5)


def back_and_forth() -> Poses:
    """Ahead along x, a turn on the spot, back along y: legs alone would go by mirrored headings as well."""
    ahead = np.column_stack([np.arange(0.0, 12.0, 0.05), np.zeros(240), np.zeros(240)])
    spot = np.column_stack([np.full(30, 12.0), np.zeros(30), np.linspace(0.0, QUARTER, 30)])
    back = np.column_stack([np.full(120, 12.0), -np.arange(0.0, 6.0, 0.05), np.full(120, QUARTER)])
    return np.concatenate([ahead, spot, back])


def trembling() -> Poses:
    rng = np.random.default_rng(1)
    stand = np.repeat(corner()[:1], 400, axis=0)  # at which the way goes nowhere for long
    poses = np.concatenate([stand, corner()])
    return poses + rng.normal(0.0, [0.02, 0.02, 0.02], poses.shape)


HONEST = {
    "ahead": corner(),
    "ahead and back": back_and_forth(),
    "trembling": trembling(),
    "views 0.85 m apart": corner(0.85),
    "three steps of a log": corner(2.0)[:4],
    "clockwise, but straight": (corner() * [1, 1, -1])[:200],
    "short": turned(corner()[:50], QUARTER),
    "standing": np.zeros((50, 3)),
    "none": np.zeros((0, 3)),
    "in millimetres": corner() * [1000, 1000, 1],
}


@pytest.mark.parametrize("poses", HONEST.values(), ids=HONEST)
def test_drives_of_honest_robots_are_left_alone(poses: Poses) -> None:
    assert fault_of(poses) is None


def test_a_robot_that_drives_sideways_now_and_then_is_left_alone() -> None:
    """Its heading turns as well: only headings that never do are no headings."""
    aside = corner()[:240]
    aside[:, 2] += np.where(np.arange(240) < 60, QUARTER, 0.0)  # 3 of 12 m
    assert fault_of(aside) is None
