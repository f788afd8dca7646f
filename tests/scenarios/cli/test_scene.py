"""``refseq mission scene | look`` on drawn drives past a plane: what is cut is found where the camera was."""

import re
from pathlib import Path

import numpy as np
import pytest

from refseq.logs import RecordingWriter
from refseq.planar import Pose
from refseq.scenes import load_scene
from refseq.view import View
from tests.refseq.scenes.drawn import BOX, CAMERA, moved, picture, scene, shown
from tests.scenarios.conftest import Refseq

AHEAD = (0.0, 0.0, 1.0)
CUT, STEP, PLANE = 1.5, 0.5, 4.0
"""The scene is cut so far along the drive, views are so far apart, and the plane is so far ahead of the cut [m]."""


def write(path: Path, images: list[np.ndarray], start: float) -> None:
    """A drive of ``STEP`` a view whose odometer begins at ``start`` [m]."""
    with RecordingWriter(path, {}) as writer:
        for number, image in enumerate(images):
            view = View(float(number), {CAMERA: image}, distance=STEP if number else 0.0)
            writer.write(view, Pose(start + STEP * number, 0.0, 0.0))


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A day's drive towards the plane, an evening's that begins 0.5 m later, and one without it."""
    folder = tmp_path_factory.mktemp("desk")
    day = [shown(scene(), moved((0, 0, STEP * n - CUT), AHEAD, PLANE), 7, n) for n in range(5)]
    day[3] = picture(1)  # the picture that the scene is of
    write(folder / "day.mcap", day, 0.0)
    evening = [shown(scene(), moved((0, 0, STEP * n + 0.5 - CUT), AHEAD, PLANE), 70, 9 + n) for n in range(4)]
    write(folder / "evening.mcap", evening, 0.0)
    write(folder / "elsewhere.mcap", [picture(100 + n) for n in range(3)], 0.0)
    return folder


@pytest.fixture
def here(desk: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(desk)
    return desk


def cut(refseq: Refseq) -> None:
    box = ",".join(map(str, BOX))
    answer = refseq("mission", "scene", "day.mcap", "--along", str(CUT), "--box", box, "-o", "poster.scene")
    assert (answer.code, answer.err) == (0, "")
    assert answer.out == "poster.scene: 200 × 180 pixels of camera-1 at 1.5 m of day.mcap\n"


def test_a_scene_is_the_patch_of_the_nearest_view(refseq: Refseq, here: Path) -> None:
    cut(refseq)
    made = load_scene(here / "poster.scene")
    assert np.array_equal(made.patch, scene().patch)
    assert (made.box, made.camera, made.drive, made.along) == (BOX, CAMERA, "day.mcap", CUT)


def test_it_is_found_where_the_camera_is_as_far_from_it(refseq: Refseq, here: Path) -> None:
    cut(refseq)
    answer = refseq("mission", "look", "poster.scene", "evening.mcap")
    assert (answer.code, answer.err) == (0, "")
    told = re.search(r"at poster\.scene after ([\d.]+) m; seen in \d+ views", answer.out)
    assert told is not None
    assert float(told[1]) == pytest.approx(CUT - 0.5, abs=0.15)


def test_where_it_is_not_it_is_not_found(refseq: Refseq, here: Path) -> None:
    cut(refseq)
    answer = refseq("mission", "look", "poster.scene", "elsewhere.mcap")
    assert (answer.code, answer.out) == (1, "elsewhere.mcap: poster.scene is not found; seen in 0 of 3 views\n")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--along", "9"), "day.mcap: --along 9 m is not on the drive; valid is 0 to 2.0 m"),
        (("--along", "nan"), "day.mcap: --along nan m is not on the drive; valid is 0 to 2.0 m"),
        (("--along", "1", "--box", "a,b"), "box 'a,b' is not valid; it should be X,Y,WIDTH,HEIGHT in pixels"),
        (("--along", "1", "--box", "600,0,100,100"), "box 600,0,100,100 is not in the picture; valid is"),
        (("--along", "1", "--box", "0,0,4,4"), "the scene has 0 keys to know it by; valid are 40 or more"),
        (("--along", "1", "--seen-by", "rear"), "camera 'rear' is not in the view; valid are camera-1"),
    ],
)
def test_what_cannot_be_cut_is_told_in_one_line(
    refseq: Refseq, here: Path, options: tuple[str, ...], said: str
) -> None:
    answer = refseq("mission", "scene", "day.mcap", *options, "-o", "none.scene")
    assert (answer.code, answer.out) == (2, "")
    assert answer.err.startswith(f"error: {said}")
    assert answer.err.count("\n") == 1
    assert not (here / "none.scene").exists()


def test_a_scene_that_is_none(refseq: Refseq, here: Path) -> None:
    (here / "spoilt.scene").write_bytes(b"no scene")
    answer = refseq("mission", "look", "spoilt.scene", "day.mcap")
    assert answer.code == 2
    assert answer.err.startswith("error: spoilt.scene: ")
