"""Relations made from a way, with loops, noise and holes, and those of a real log against poses found by others."""

import os
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from refseq.errors import LogError
from refseq.logs import open_log
from refseq.logs.trajectories import read_trajectory
from refseq.planar import Pose, relative_pose

DATA = Path(os.environ.get("REFSEQ_RECORDINGS") or Path(__file__).resolve().parents[5] / "shared" / "data")
COUNT = 40
LOOP = [Pose(5 * np.cos(a) - 5, 5 * np.sin(a), a) for a in np.linspace(0, 2.2 * np.pi, COUNT)]
PAIRS = [*((k, k + 1) for k in range(COUNT - 1)), (0, 36), (36, 2), (5, 20)]


def file_of(path: Path, pairs: list[tuple[int, int]], noise: np.ndarray | None = None) -> Path:
    lines = []
    for number, (start, end) in enumerate(pairs):
        motion = relative_pose(LOOP[end], LOOP[start])
        x, y, yaw = np.array([motion.x, motion.y, motion.heading]) + (0 if noise is None else noise[number])
        lines.append(
            f"{10 + start} {10 + end} {x:.9f} {y:.9f} 0 0 0 {np.remainder(yaw + np.pi, 2 * np.pi) - np.pi:.9f}"
        )
    path.write_text("\n".join(lines) + "\n")
    return path


def way_from_origin() -> np.ndarray:
    return np.array([[p.x, p.y, p.heading] for p in (relative_pose(pose, LOOP[0]) for pose in LOOP)])


def test_relations_without_noise_give_the_way_that_they_were_made_from(tmp_path: Path) -> None:
    found = read_trajectory(file_of(tmp_path / "a.relations", PAIRS))
    assert_allclose(found.keys, 10 + np.arange(COUNT))
    assert_allclose(found.poses[:, :2], way_from_origin()[:, :2], atol=1e-6)
    assert_allclose(np.exp(1j * found.poses[:, 2]), np.exp(1j * way_from_origin()[:, 2]), atol=1e-6)


def test_loops_take_back_drift(tmp_path: Path) -> None:
    noise = np.random.default_rng(3).normal(0, [0.02, 0.02, 0.02], (len(PAIRS), 3))
    noise[-3:] = 0
    chain = read_trajectory(file_of(tmp_path / "chain.relations", PAIRS[:-3], noise))
    loops = read_trajectory(file_of(tmp_path / "loops.relations", PAIRS, noise))
    errors = [np.hypot(*(found.poses - way_from_origin())[:, :2].T).mean() for found in (chain, loops)]
    assert errors[1] < errors[0] / 2


def test_the_largest_group_of_related_times_has_poses(tmp_path: Path) -> None:
    found = read_trajectory(file_of(tmp_path / "holes.relations", [pair for pair in PAIRS if 30 not in pair][:-3]))
    assert_allclose(found.keys, 10 + np.arange(30))
    assert "join 30 of 39 times" in found.notes[1]


@pytest.mark.parametrize(
    ("rows", "told"),
    [
        ("1 1 0 0 0 0 0 0", "relates no two times"),
        ("1 2 0 0 0 0 0", "line 1: has 7 fields"),
        ("1 2 0 0 0 0 0 nan", "line 1: 'nan' is no finite number"),
    ],
)
def test_rows_that_are_no_relations(tmp_path: Path, rows: str, told: str) -> None:
    path = tmp_path / "bad.relations"
    path.write_text(rows + "\n")
    with pytest.raises(LogError, match=told):
        read_trajectory(path)


@pytest.mark.slow
@pytest.mark.skipif(not (DATA / "radish").is_dir(), reason=f"no recordings in {DATA}")
def test_relations_of_a_real_log_lie_as_its_corrected_poses_do() -> None:
    related = read_trajectory(DATA / "radish" / "aces.relations")
    scans = [s.time for s in open_log(DATA / "radish" / "aces.clf.bz2").samples(["/laser"])]
    corrected = read_trajectory(DATA / "radish" / "aces.truth.csv").timed(scans)
    others = corrected.at(related.keys)[:, :2]
    both = np.isfinite(others[:, 0])
    ours, others = (points[both] - points[both].mean(axis=0) for points in (related.poses[:, :2], others))
    left, _, right = np.linalg.svd(ours.T @ others)
    apart = np.hypot(*(ours @ left @ right - others).T)
    assert both.sum() > 100
    assert np.median(apart) < 0.5  # raw odometry is 18 m off; the two were found by different people
    assert apart.max() < 1.5
