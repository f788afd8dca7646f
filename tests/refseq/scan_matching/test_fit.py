"""Scans laid on each other in rooms of known geometry: the exact pose, and how far off it may be."""

import numpy as np
import pytest
from numpy.typing import NDArray

from refseq.planar import Pose
from refseq.scan_matching import lines
from refseq.scan_matching.fit import ASSUMED, BUNCH, LaidScan, ScanFit, fitted, shares
from refseq.scan_matching.panorama import panorama
from refseq.view import Scan
from tests.refseq.rooms import Wall, cast, rectangle

ROOM: list[Wall] = [*rectangle(-3, -2, 5, 3), (2, 3, 2, 2.2), (1, -2, 1.4, -1.5)]
CORRIDOR: list[Wall] = [(-200, -1.2, 200, -1.2), (-200, 1.2, 200, 1.2)]
HERE = Pose(0.0, 0.0, 0.0)
BOARDS = 26
"""So many boards stand about the robot in a crowded room."""


def seen(walls: list[Wall], pose: Pose, rng: np.random.Generator | None = None, noise: float = 0.0) -> LaidScan:
    return LaidScan(panorama(cast(walls, pose, rng=rng, noise=noise)) / 100.0)


def between(walls: list[Wall], motion: tuple[float, float, float]) -> ScanFit:
    [found] = fitted([(seen(walls, HERE), seen(walls, Pose(*motion)))])
    assert found is not None
    return found


@pytest.mark.parametrize("along", [-0.65, 0.0, 0.65])
@pytest.mark.parametrize("aside", [-0.65, 0.2])
@pytest.mark.parametrize("turned", [-0.4, 0.1])
def test_shift_and_heading_are_found_anywhere_in_reach(along: float, aside: float, turned: float) -> None:
    found = between(ROOM, (along, aside, turned))
    assert found.motion == pytest.approx([along, aside, turned], abs=0.005)
    assert found.share > 0.99


def test_a_scan_is_found_where_it_is_sought() -> None:
    """Two metres on, about where the odometer has it; sought about the first one it lies badly, if at all."""
    motion, pair = np.array([2.0, 0.3, 0.5]), (seen(ROOM, HERE), seen(ROOM, Pose(2.0, 0.3, 0.5)))
    there, nowhere = fitted([pair, pair], np.stack([motion + np.array([0.4, -0.3, 0.2]), np.zeros(3)]))
    assert there is not None
    assert there.motion == pytest.approx(motion, abs=0.005)
    assert nowhere is None or nowhere.score < there.score / 3


def test_the_way_back_is_the_other_scans() -> None:
    one, other = seen(ROOM, HERE), seen(ROOM, Pose(0.4, -0.2, 0.2))
    there, back = fitted([(one, other), (other, one)])
    assert there is not None
    assert back is not None
    cos, sin = np.cos(0.2), np.sin(0.2)
    assert back.motion[:2] == pytest.approx([-0.4 * cos + 0.2 * sin, 0.4 * sin + 0.2 * cos], abs=0.005)
    assert back.motion[2] == pytest.approx(-there.motion[2], abs=0.005)


def test_no_pose_of_a_fine_grid_lies_better_on_the_room() -> None:
    """Brute force over the true walls: the mean distance of the beams' ends to the nearest of them."""
    rng = np.random.default_rng(3)
    other = seen(ROOM, Pose(0.31, -0.22, 0.17), rng, noise=0.01)
    [found] = fitted([(seen(ROOM, HERE, rng, noise=0.01), other)])
    assert found is not None
    steps = [np.arange(-5, 6) * 0.02] * 2 + [np.arange(-5, 6) * np.radians(0.5)]
    grid = found.motion + np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 3)
    off = [away(other.walls.points, pose) for pose in grid]
    best = grid[np.argmin(off)]
    assert np.abs(best[:2] - found.motion[:2]).max() <= 0.02
    assert abs(best[2] - found.motion[2]) <= np.radians(0.5)


def crowded(seed: int) -> list[Wall]:
    """A room of 8 m in which boards of 0.2 to 0.32 m stand all about the robot, and hide most of its walls."""
    rng, walls = np.random.default_rng(seed), rectangle(-4, -4, 4, 4)
    for bearing in np.linspace(0, 2 * np.pi, BOARDS, endpoint=False):
        distance, angle, half = rng.uniform(1.3, 2.6), rng.uniform(0, np.pi), rng.uniform(0.1, 0.16)
        x, y, dx, dy = (
            distance * np.cos(bearing),
            distance * np.sin(bearing),
            half * np.cos(angle),
            half * np.sin(angle),
        )
        walls.append((x - dx, y - dy, x + dx, y + dy))
    return walls


def squared(found: ScanFit, motion: NDArray[np.float64]) -> float:
    """Squared error in units of the covariance: 3 on the mean where that is honest."""
    error = found.motion - motion
    return float(error @ np.linalg.solve(found.covariance, error))


def laid_in_crowds() -> list[tuple[ScanFit, NDArray[np.float64]]]:
    """Of twelve pairs of scans in each of three crowded rooms those that lie on each other, with the true motion."""
    laid = []
    for room in range(3):
        rng, walls = np.random.default_rng(room), crowded(room)
        for _ in range(12):
            motion = rng.uniform((-0.4, -0.3, -0.25), (0.4, 0.3, 0.25))
            [found] = fitted([(seen(walls, HERE, rng, 0.01), seen(walls, Pose(*motion.tolist()), rng, 0.01))])
            laid += [(found, motion)] if found is not None else []
    return laid


def test_scans_lie_on_each_other_in_a_crowded_room() -> None:
    laid = laid_in_crowds()
    assert len(laid) >= 34
    assert all(np.hypot(*(found.motion - motion)[:2]) < 0.05 for found, motion in laid)
    assert 0.5 < np.mean([squared(*one) for one in laid]) < 5.0


def test_by_pieces_as_long_as_elsewhere_half_of_them_lie_nowhere(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lines, "SHORTER", lines.LENGTH)
    assert len(laid_in_crowds()) < 24


def away(points: NDArray[np.float64], pose: NDArray[np.float64]) -> float:
    """Mean distance of points, seen from a pose, to the walls of the room [m]."""
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    placed = points @ np.array([[cos, sin], [-sin, cos]]) + pose[:2]
    distances = []
    for x0, y0, x1, y1 in ROOM:
        start, way = np.array([x0, y0]), np.array([x1 - x0, y1 - y0])
        share = np.clip((placed - start) @ way / (way @ way), 0, 1)
        distances.append(np.hypot(*(placed - start - share[:, None] * way).T))
    return float(np.min(distances, axis=0).mean())


def test_errors_are_as_large_as_the_covariance_says() -> None:
    """Mean squared error in units of the covariance, of three degrees of freedom: 3 where it is honest."""
    rng = np.random.default_rng(1)
    squares = []
    for _ in range(60):
        motion = rng.uniform((-0.4, -0.3, -0.25), (0.4, 0.3, 0.25))
        [found] = fitted([(seen(ROOM, HERE, rng, 0.02), seen(ROOM, Pose(*motion.tolist()), rng, 0.02))])
        assert found is not None
        squares.append(squared(found, motion))
    assert 1.0 < np.mean(squares) < 5.0
    assert np.max(squares) < 25.0


def test_along_a_bare_corridor_nothing_tells_how_far() -> None:
    found = between(CORRIDOR, (0.4, 0.2, 0.1))
    sigmas = np.sqrt(np.diag(found.covariance))
    assert found.motion[1:] == pytest.approx([0.2, 0.1], abs=0.005)
    assert sigmas[0] > 0.9 * ASSUMED[0]  # nothing but what was assumed
    assert (sigmas[1:] < 0.02).all()


def test_a_door_frame_tells_how_far() -> None:
    walls = [*CORRIDOR, (3, 1.2, 3, 0.7), (3, 0.7, 3.2, 0.7)]
    found = between(walls, (0.4, 0.2, 0.1))
    assert found.motion == pytest.approx([0.4, 0.2, 0.1], abs=0.02)
    assert found.covariance[0, 0] < 0.1**2


def test_two_corridors_at_an_angle_are_alike_in_few_beams() -> None:
    """A corridor that ends, and one that does not: one scan sees through the other's wall."""
    ended = [*CORRIDOR, (2.0, -1.2, 2.0, 1.2)]
    [found] = fitted([(seen(CORRIDOR, HERE), seen(ended, HERE))])
    assert found is not None
    assert found.share < 0.87


def test_nothing_is_found_where_nothing_came_back() -> None:
    blind = LaidScan(panorama(Scan(np.full(361, np.inf, np.float32))) / 100.0)
    assert fitted([(seen(ROOM, HERE), blind), (blind, blind), (blind, seen(ROOM, HERE))]) == [None] * 3


def test_a_pair_is_laid_among_others_as_it_is_alone() -> None:
    """Scans of the room, of the corridor, and of nothing, each on each, in one go and pair by pair."""
    rng = np.random.default_rng(5)
    blind = LaidScan(panorama(Scan(np.full(361, np.inf, np.float32))) / 100.0)
    motions = rng.uniform([-0.9, -0.9, -0.5], [0.9, 0.9, 0.5], (4, 3)).tolist()
    scans = [blind, *(seen(walls, Pose(*motion), rng, 0.02) for walls in (ROOM, CORRIDOR) for motion in motions)]
    pairs = [(one, other) for one in scans for other in scans]
    assert len(pairs) > BUNCH
    alone = [found for pair in pairs for found in fitted([pair])]
    among = fitted(pairs)
    assert [found is None for found in among] == [found is None for found in alone]
    told = [(one, other) for one, other in zip(among, alone, strict=True) if one is not None and other is not None]
    assert 40 < len(told) < len(pairs) - 17  # what is blind fits nothing, and some rooms lie out of reach
    for one, other in told:
        np.testing.assert_allclose(one.motion, other.motion, rtol=0, atol=1e-12)
        np.testing.assert_allclose(one.covariance, other.covariance, rtol=1e-9)
        assert (one.share, one.score) == pytest.approx((other.share, other.score), abs=1e-12)
    assert fitted([]) == []


def test_shares_count_what_both_can_see() -> None:
    half = np.full(360, 2.0)
    farther = half.copy()
    farther[:90] = 3.0  # a quarter is seen through by the other scan, which alone tells: its ends lie behind walls
    share = shares(LaidScan(half), LaidScan(farther), np.zeros((1, 3)))
    assert share == pytest.approx(0.857, abs=0.01)  # 540 met, 90 seen through
