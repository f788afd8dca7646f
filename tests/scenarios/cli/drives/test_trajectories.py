"""Trajectories and pictures on the command line: beside a log, out of a localised drive, and judged by evo."""

import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from evo.core import metrics, sync
from evo.tools import file_interface

from refseq.belief import LOST_ABOVE
from refseq.logs import read_recording, write_carmen
from refseq.logs.beliefs import read_beliefs
from refseq.logs.trajectories import read_trajectory, write_trajectory
from refseq.map.map import Map
from refseq.planar import Pose
from tests.scenarios.conftest import Refseq
from tests.support import corridor_drive

FEATURES = "walls,boundary,sectors"
VIEWS = 24


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two logs of scans with truth, and one of the same drive whose truth stands in a file beside it."""
    folder = tmp_path_factory.mktemp("desk")
    for name, seed in (("first", 1), ("later", 2)):
        views = corridor_drive(np.random.default_rng(seed), VIEWS, size=24)
        write_carmen(folder / f"{name}.log", views)
        write_trajectory(folder / f"{name}.tum", [(view.time, view.truth) for view in views if view.truth], "tum")
    moved = [replace(view, truth=Pose(0.0, 0.0, 0.0)) for view in views]
    write_carmen(folder / "moved.log", moved)
    return folder


@pytest.fixture
def learnt(desk: Path, refseq: Refseq) -> Path:
    if not (desk / "map.refseq").exists():
        assert refseq("learn", desk / "first.log", "-o", desk / "map.refseq", "--features", FEATURES).code == 0
    return desk / "map.refseq"


def test_evo_finds_the_error_that_we_find(desk: Path, learnt: Path, refseq: Refseq) -> None:
    said = refseq("localise", learnt, desk / "later.log", "-o", desk / "run.parquet", "--trajectory", "tum")
    assert said.code == 0, said.err
    found = {what: read_trajectory(desk / f"run-{what}.tum") for what in ("estimate", "odometry", "truth")}
    assert len(found["odometry"]) == len(found["truth"]) == VIEWS
    assert re.search(rf"run-estimate.tum: poses of {len(found['estimate'])} of {VIEWS} views", said.out)

    # ours: the pose that the belief stands for against the view's, wherever the robot is not lost
    map_, beliefs = Map.load(learnt), read_beliefs(desk / "run.parquet")["chain"]
    truth = [pose for _, pose in found["truth"]]
    pairs = [(map_.pose(b), true) for b, true in zip(beliefs, truth, strict=True) if b.lost <= LOST_ABOVE]
    squares = [(a.x - b.x) ** 2 + (a.y - b.y) ** 2 for a, b in pairs if a is not None]
    ours = float(np.sqrt(np.mean(squares)))

    files = [file_interface.read_tum_trajectory_file(desk / f"run-{what}.tum") for what in ("truth", "estimate")]
    ape = metrics.APE(metrics.PoseRelation.translation_part)
    ape.process_data(sync.associate_trajectories(*files))
    assert ape.get_statistic(metrics.StatisticsType.rmse) == pytest.approx(ours, abs=1e-6)


@pytest.mark.slow
def test_the_programs_of_evo_run_on_our_files(desk: Path, learnt: Path, refseq: Refseq) -> None:
    for form in ("tum", "kitti"):
        assert refseq("localise", learnt, desk / "later.log", "-o", desk / "e.parquet", "--trajectory", form).code == 0
    bin_ = Path(sys.executable).parent
    quiet = {**os.environ, "MPLBACKEND": "Agg", "HOME": str(desk)}
    for words, told in (
        (["evo_ape", "tum", "e-truth.tum", "e-estimate.tum"], r"rmse\s+\d"),
        (["evo_traj", "kitti", "e-estimate.kitti", "e-odometry.kitti", "--ref", "e-truth.kitti"], r"\b24 poses"),
    ):
        done = subprocess.run([bin_ / words[0], *words[1:]], cwd=desk, env=quiet, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
        assert re.search(told, done.stdout), done.stdout


def test_truth_beside_a_log(desk: Path, learnt: Path, refseq: Refseq) -> None:
    """The same drive with its truth in the log, and with a wrong one there and the right one in a file."""
    inside = refseq("localise", learnt, desk / "later.log", "--json")
    beside = refseq("localise", learnt, desk / "moved.log", "--truth", desk / "later.tum", "--json")
    wrong = refseq("localise", learnt, desk / "moved.log", "--json")
    assert inside.code == beside.code == wrong.code == 0
    assert inside.out.replace("later.log", "moved.log") == beside.out != wrong.out


def test_odometry_beside_a_log(desk: Path, refseq: Refseq) -> None:
    rows = [f"{2.0 * k} {0.5 * k} 0 0 0 0 0 1" for k in range(VIEWS)]
    (desk / "half.txt").write_text("\n".join(rows))
    said = refseq(
        "learn", desk / "first.log", "-o", desk / "half.refseq", "--features", FEATURES, "--odometry", desk / "half.txt"
    )
    assert said.code == 0, said.err
    assert f"over {0.5 * (VIEWS - 1):.1f} m" in said.out
    assert Map.load(desk / "half.refseq").metadata["odometry"] == "half.txt"


@pytest.fixture(scope="module")
def pictures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A data set in VPR-Bench's layout: textures by place, the query two pictures later."""
    home = tmp_path_factory.mktemp("pictures")
    for folder, first in (("ref", 0), ("query", 2)):
        (home / folder).mkdir()
        for k in range(8):
            noise = np.random.default_rng(k + first).integers(0, 256, (12, 16), dtype=np.uint8)
            cv2.imwrite(str(home / folder / f"{k:07}.jpg"), cv2.resize(noise, (320, 240)))
    (home / "ground_truth.csv").write_text("query,reference\n" + "\n".join(f"{k},{k + 2}" for k in range(6)))
    return home


def test_a_data_set_by_one_command(pictures: Path, refseq: Refseq) -> None:
    said = refseq("compare", pictures, "--methods", "best/uniform", "--report", pictures / "page.html", "--json")
    assert said.code == 0, said.err
    assert '"within_1_frames_right_views": 6' in said.out
    assert '"off_map_views": 2' in said.out
    assert "no odometry: assumed: 1 m a picture" in " ".join(said.err.split())
    assert "success within 1 frame" in (pictures / "page.html").read_text()


def test_pictures_by_hand(pictures: Path, refseq: Refseq) -> None:
    assert refseq("learn", pictures / "ref", "-o", pictures / "map.refseq", "--profile", "best").code == 0
    asked = ("localise", pictures / "map.refseq", pictures / "query")
    said = refseq(*asked, "--stage", "uniform", "--ground-truth", "frame+2±1", "--at-least", "90")
    assert said.code == 0, said.out + said.err
    assert "within 1 frame" in said.out
    assert "100.0 % [61, 100] of 6" in said.out
    given = refseq(*asked, "-o", pictures / "b.parquet", "--trajectory", "tum")
    assert given.code == 2
    assert "knows no poses of its places, so that a belief has none" in " ".join(given.err.split())
    assert not (pictures / "b.parquet").exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--truth", "none.tum"], "--truth none.tum: is no file; valid is a trajectory's file, or a topic as /truth"),
        (["--odometry", "a,b,c"], "--odometry a: is no file; valid is a trajectory's file, or a topic as /odometry"),
        (
            ["--truth", "late.tum"],
            "late.tum: runs from 1000.000 to 1001.000 s, later.log from 0.000 to 46.000 s",
        ),
        (["--trajectory", "tum"], "--trajectory tum: its files are named after those of -o; valid is together with -o"),
        (["--ground-truth", "frame±2", "--thin", "1"], "--thin 1 and --ground-truth exclude each other"),
    ],
)
def test_mistakes(
    desk: Path, learnt: Path, refseq: Refseq, monkeypatch: pytest.MonkeyPatch, words: list[str], message: str
) -> None:
    monkeypatch.chdir(desk)
    (desk / "late.tum").write_text("1000 0 0 0 0 0 0 1\n1001 0 0 0 0 0 0 1\n")
    said = refseq("localise", learnt, "later.log", *words)
    assert said.code == 2
    assert message in " ".join(said.err.split())


def test_given_odometry_and_an_estimated_truth_are_noted(refseq: Refseq, tmp_path: Path) -> None:
    """The odometry of a folder of pictures is assumed, until one is given."""
    (tmp_path / "pictures").mkdir()
    for k in range(6):
        cv2.imwrite(str(tmp_path / "pictures" / f"{k}.png"), np.full((48, 64), 40 * k, np.uint8))
    for name in ("wheels.csv", "station.csv"):
        (tmp_path / name).write_text("index,x,y,heading\n" + "".join(f"{k},{0.5 * k},0,0\n" for k in range(6)))
    given = ("--odometry", tmp_path / "wheels.csv", "--truth", tmp_path / "station.csv")
    for out, options in (("plain.mcap", ()), ("given.mcap", given)):
        assert refseq("log", "convert", tmp_path / "pictures", *options, "-o", tmp_path / out).code == 0
    plain, noted = (read_recording(tmp_path / out).metadata for out in ("plain.mcap", "given.mcap"))
    assert plain["odometry"] == "assumed: 1 m a picture"
    assert (noted["odometry"], noted["truth"]) == ("wheels.csv", "station.csv")
    checked = refseq("learn", tmp_path / "given.mcap", "--features", "dense", "-o", tmp_path / "map.refseq")
    assert "has no odometry" not in checked.err
