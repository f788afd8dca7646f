"""A scene's file: the same again; and each way to damage it is told in one line."""

import hashlib
import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from refseq.errors import SceneError
from refseq.limits import Limit
from refseq.scenes import load_scene, save_scene
from tests.refseq.scenes.drawn import scene


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "poster.scene"
    save_scene(path, scene())
    return path


def test_it_comes_back_as_it_was(file: Path) -> None:
    one, other = scene(), load_scene(file)
    assert (one.patch == other.patch).all()
    for name in ("camera", "box", "width", "height", "drive", "along"):
        assert getattr(one, name) == getattr(other, name)


def rewritten(file: Path, picture: bytes | None = None, **changed: object) -> None:
    """Write the file anew, with other values and a checksum that is right."""
    magic, line, own = file.read_bytes().split(b"\n", 2)
    picture = own if picture is None else picture
    table = json.loads(line) | {"sha256": hashlib.sha256(picture).hexdigest()} | changed
    file.write_bytes(b"\n".join((magic, json.dumps(table).encode(), picture)))


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"box": [600, 0, 200, 180]}, "is damaged: box 600,0,200,180 is not in a picture of 640 × 480 pixels"),
        ({"box": [0, 0, 100, 100]}, "is damaged: it holds no PNG of 100 × 100 pixels"),
        ({"box": [0, 0, 1.5, 9]}, r"is damaged: box = \[0, 0, 1.5, 9\] is not 4 numbers of pixels"),
        ({"size": [10**6, 10**6]}, "is damaged: box 220,140,200,180 is not in a picture of 1000000 × 1000000"),
        ({"size": [True, 480]}, r"is damaged: size = \[True, 480\] is not 2 numbers"),
        ({"camera": "a\nb"}, "is damaged: camera = 'a.nb' is no name"),
        ({"camera": 3}, "is damaged: camera = 3 is no name"),
        ({"along": float("nan")}, "is damaged: along = nan is no number of metres from 0 to 1e.06"),
        ({"more": 1}, "is damaged: its second line is no table of camera, box, size, drive, along and sha256"),
        ({"sha256": "0"}, "is damaged: its picture does not match its checksum"),
    ],
)
def test_a_value_that_is_not_valid_is_told(file: Path, changed: dict[str, object], told: str) -> None:
    rewritten(file, **changed)
    with pytest.raises(SceneError, match=rf"^{file}: {told}"):
        load_scene(file)


def test_a_picture_of_another_kind_or_half_of_one_is_told(file: Path) -> None:
    rewritten(file, cv2.imencode(".jpg", np.zeros((180, 200), np.uint8))[1].tobytes())
    with pytest.raises(SceneError, match=r"it holds no PNG of 200 × 180 pixels$"):
        load_scene(file)
    rewritten(file, cv2.imencode(".png", scene().patch)[1].tobytes()[:400])
    with pytest.raises(SceneError, match="an image cannot be decoded"):
        load_scene(file)


def test_what_is_no_scene_is_told(file: Path, tmp_path: Path) -> None:
    file.write_bytes(b"PK\3\4")
    with pytest.raises(SceneError, match=r"is no scene; valid is a file that `refseq mission scene` has written$"):
        load_scene(file)
    with pytest.raises(SceneError, match="cannot be read: is a folder; valid is a file"):
        load_scene(tmp_path)


def test_more_than_the_limit_is_not_read(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("refseq.scenes.file.SCENE_BYTES", Limit(100, "bytes of a scene", ""))
    with pytest.raises(SceneError, match=r"has 101 bytes of a scene; valid are at most 100$"):
        load_scene(file)
