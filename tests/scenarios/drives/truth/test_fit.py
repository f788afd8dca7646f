"""Truth beside a drive: what fits it, and what is of another drive, another time, other columns or other units."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from refseq.logs import RecordingWriter
from refseq.planar import Pose, after_motion
from refseq.view import Scan, View
from refseq_bench.scenarios.campaign.declare.real_recordings import DATA, read_real
from refseq_bench.scenarios.campaign.declare.sources import Log
from refseq_bench.scenarios.drives.truth.fit import DOUBTED, REFUSED, fit_of, truth_doubt, truth_fit
from refseq_bench.scenarios.errors import ScenarioError
from tests.scenarios.conftest import Refseq

Poses = NDArray[np.float64]


def drive(seed: int = 1, count: int = 120, bend: float = 0.0, scale: float = 1.0) -> list[View]:
    """Corridors with corners, a view every 0.5 m, led by a person; the odometer's heading bends [rad/m], its metres are
    ``scale``."""
    rng, pose, views = np.random.default_rng(seed), Pose(3.0, -2.0, 0.4), list[View]()
    corners = set(rng.choice(np.arange(5, count - 5), 8, replace=False).tolist())
    for k in range(count):
        turn = float(rng.choice([-1, 1])) * np.pi / 2 if k in corners else float(rng.normal(0, 0.03))
        pose = after_motion(pose, 0.5, turn) if k else pose
        moved = {"distance": 0.5 * scale, "turn": turn + 0.5 * bend} if k else {"distance": 0.0, "turn": 0.0}
        views.append(View(float(k), scan=scan(rng), truth=pose, **moved))
    return views


def scan(rng: np.random.Generator) -> Scan:
    return Scan(rng.uniform(1.0, 5.0, 181).astype(np.float32), start=-np.pi / 2, step=np.pi / 180)


def poses(views: Sequence[View]) -> Poses:
    return np.array([(view.truth.x, view.truth.y, view.truth.heading) for view in views if view.truth])


def with_truth(views: Sequence[View], truth: Poses) -> list[View]:
    return [replace(view, truth=Pose(*map(float, pose))) for view, pose in zip(views, truth, strict=True)]


@given(st.integers(0, 50), st.floats(-0.03, 0.03), st.floats(0.95, 1.05))
def test_odometry_that_drifts_as_real_ones_do_fits(seed: int, bend: float, scale: float) -> None:
    """MIT CSAIL, the worst of the raw logs, drifts by 15° in 5 m at one piece of five."""
    fit = truth_fit(drive(seed, bend=bend, scale=scale))
    assert fit is not None
    assert fit.share >= DOUBTED
    assert fit.length == pytest.approx(scale, abs=0.03)


@given(st.integers(0, 50), st.floats(-np.pi, np.pi), st.floats(-50, 50))
def test_the_frame_of_the_truth_does_not_matter(seed: int, turn: float, east: float) -> None:
    views = drive(seed)
    true = poses(views)
    axes = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    moved = np.column_stack([true[:, :2] @ axes + [east, -east], true[:, 2] + turn])
    fit, same = truth_fit(with_truth(views, moved)), truth_fit(views)
    assert fit is not None
    assert same is not None
    assert (fit.share, fit.aside, fit.length) == pytest.approx((same.share, same.aside, same.length))


def of_another(views: Sequence[View]) -> Poses:
    return poses(drive(77, len(views)))


WRONG: dict[str, Callable[[Sequence[View]], Poses]] = {
    "another drive": of_another,
    "backwards": lambda views: poses(views)[::-1],
    "degrees": lambda views: poses(views) * [1, 1, 180 / np.pi],
    "millimetres": lambda views: poses(views) * [1000, 1000, 1],
    "no headings": lambda views: poses(views) * [1, 1, 0],
    "stands still": lambda views: poses(views) * 0,
    "swapped": lambda views: poses(views)[:, [1, 0, 2]],
    "x for heading": lambda views: poses(views)[:, [2, 1, 0]],
}


@pytest.mark.parametrize("wrong", [wrong for wrong in WRONG if wrong != "swapped"])
@pytest.mark.parametrize("seed", range(6))
def test_a_truth_of_another_drive_or_with_other_columns_does_not(wrong: str, seed: int) -> None:
    views = drive(seed)
    fit = truth_fit(with_truth(views, WRONG[wrong](views)))
    assert fit is not None
    assert fit.share < REFUSED


@pytest.mark.quick_cases("0", "1")
@pytest.mark.parametrize("seed", range(20))
def test_a_mirrored_way_is_told_of_at_least(seed: int) -> None:
    """It goes as the right one between corners, and where x and y are swapped, along corridors of one direction."""
    views = drive(seed)
    for wrong in (poses(views)[:, [1, 0, 2]], poses(views) * [1, -1, -1]):
        assert truth_doubt(with_truth(views, wrong), "t.csv", "drive.mcap") is not None
    assert truth_doubt(views, "t.csv", "drive.mcap") is None


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    ("scale", "asked", "ratio"),
    [
        (3.28, "is the odometry in feet?", "3.28"),
        (100.0, "is the odometry in centimetres?", "100"),
        (0.001, "is the truth in millimetres?", "0.001"),
        (2.5, "one of both is not in metres", "2.5"),
    ],
)
def test_odometry_in_another_unit_is_told_by_its_ratio(seed: int, scale: float, asked: str, ratio: str) -> None:
    views = drive(seed, scale=max(1.0, scale))
    truth = poses(views) / np.array([min(1.0, scale), min(1.0, scale), 1.0])
    doubt = truth_doubt(with_truth(views, truth), "t.csv", "drive.mcap")
    assert doubt is not None
    assert doubt.refused
    told = f"the odometry of drive.mcap goes {ratio} m for each metre of it, and fits but for that: {asked}"
    assert doubt.told.startswith(f"t.csv: tells another way: {told}; valid are ")


def test_a_sensor_that_looks_aside_fits_and_its_angle_is_told() -> None:
    views = drive()
    fit = truth_fit(with_truth(views, poses(views) + np.array([0, 0, np.pi / 2])))
    assert fit is not None
    assert fit.share == 1
    assert fit.aside == pytest.approx(-np.pi / 2)


def test_a_few_metres_tell_nothing() -> None:
    assert fit_of(poses(drive())[:40], poses(drive(2))[:40]) is None
    assert truth_fit([replace(view, truth=None) for view in drive()]) is None


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A drive whose file has no truth, and files of poses beside it."""
    monkeypatch.chdir(tmp_path)
    views, at = drive(bend=0.005), Pose(0.0, 0.0, 0.0)
    with RecordingWriter(tmp_path / "drive.mcap", {}) as writer:
        for view in views:
            at = after_motion(at, view.distance, view.turn)
            writer.write(replace(view, truth=None), at)
    true = {
        "right": poses(views),
        "longer": poses(views) * [1.1, 1.1, 1],
        "half": poses(views)[:60],
        "beyond": np.concatenate([poses(views), poses(views)]),
        **{wrong.replace(" ", "-"): make(views) for wrong, make in WRONG.items()},
    }
    for name, rows in true.items():
        lines = [f"{k},{x},{y},{heading}" for k, (x, y, heading) in enumerate(rows.tolist())]
        (tmp_path / f"{name}.csv").write_text("\n".join(["index,x,y,heading", *lines]))
    return tmp_path


LEARN = ("learn", "drive.mcap", "--features", "boundary,sectors", "-o", "map.refseq", "--truth")


@pytest.mark.parametrize("wrong", [wrong.replace(" ", "-") for wrong in WRONG])
@pytest.mark.parametrize("command", [LEARN, ("log", "check", "drive.mcap", "--truth")])
def test_it_is_refused_in_one_line(refseq: Refseq, here: Path, wrong: str, command: Sequence[str]) -> None:
    answer = refseq(*command, f"{wrong}.csv")
    assert (answer.code, answer.out, len(answer.err.splitlines())) == (2, "", 1)
    told = "its headings, up to 217.224, go along its way as degrees" if wrong == "degrees" else "tells another way: "
    assert answer.err.startswith(f"error: {wrong}.csv: {told}")
    assert not (here / "map.refseq").exists()


def test_what_is_doubtful_is_told_once(refseq: Refseq, here: Path) -> None:
    assert refseq(*LEARN, "right.csv").err == ""
    told = "the odometry of drive.mcap shows 0.91 m for each metre of it"
    assert refseq(*LEARN, "longer.csv").err == f"note: longer.csv: {told}\n"
    assert f"longer.csv: {told}" in refseq("log", "check", "drive.mcap", "--truth", "longer.csv").out.replace("\n", " ")
    told = "half.csv: has true poses of 60 of the 120 views of drive.mcap; the others are not scored"
    assert refseq(*LEARN, "half.csv").err == f"note: {told}\n"


@pytest.mark.quick_cases("2.0-0", "-3.0-2")
@pytest.mark.parametrize(("late", "code"), [(2.0, 0), (-1.5, 0), (-3.0, 2)])
def test_a_truth_of_another_clock_is_told_with_what_sets_it_right(
    refseq: Refseq, here: Path, late: float, code: int
) -> None:
    """Refused or not, as it tells another way where there are many corners."""
    rows = [f"{k + late},{x},{y},{heading}" for k, (x, y, heading) in enumerate(poses(drive()).tolist())]
    (here / "late.csv").write_text("\n".join(["time,x,y,heading", *rows]))
    answer = refseq(*LEARN, "late.csv")
    option = answer.err.split("; ")[-1].removesuffix(" sets it right\n")
    assert answer.code == code
    assert float(option.removeprefix("--late truth=")) == pytest.approx(late, abs=0.1)
    right = refseq(*LEARN, "late.csv", *option.split())
    assert (right.code, right.err) == (0, "")


def test_a_truth_of_another_clock_scores_with_less(refseq: Refseq, here: Path) -> None:
    rows = [f"{k + 2},{x},{y},{heading}" for k, (x, y, heading) in enumerate(poses(drive()).tolist())]
    (here / "late.csv").write_text("\n".join(["time,x,y,heading", *rows]))
    for option, score in (
        ("truth=0", "works, with less: true poses from late.csv, of which there is a doubt to look at"),
        ("truth=2", "works: true poses from late.csv"),
    ):
        checked = refseq("log", "check", "drive.mcap", "--truth", "late.csv", "--late", option).out
        assert f"score      {score}" in checked


def test_a_scenarios_log_is_refused_alike(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(DATA, str(here))
    assert len(read_real(Log("drive.mcap", truth="right.csv")).views) == 120
    with pytest.raises(
        ScenarioError, match=r"another-drive\.csv: tells another way: .* of drive\.mcap does; valid are"
    ):
        read_real(Log("drive.mcap", truth="another-drive.csv"))


def test_more_poses_than_the_log_has_scans_are_refused(refseq: Refseq, here: Path) -> None:
    answer = refseq(*LEARN, "beyond.csv")
    assert (answer.code, len(answer.err.splitlines())) == (2, 1)
    assert "holds a pose for picture or scan 239; valid are 0 to 119" in answer.err
