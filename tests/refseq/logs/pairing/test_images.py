from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from refseq.errors import LogError
from refseq.logs import open_log, plan_views, read_recording
from refseq.logs.decoding.picture import CompressedPicture
from refseq.logs.pairing import images
from refseq.logs.pairing.images import PictureStore
from tests.refseq.logs.foxglove_drive import FoxgloveSetup, write_foxglove
from tests.refseq.logs.robot_drive import RobotDrive

DRIVE = RobotDrive(seconds=6.0)


def png(height: int, width: int) -> CompressedPicture:
    return CompressedPicture(cv2.imencode(".png", np.full((height, width), 7, np.uint8))[1].tobytes())


def test_pictures_beyond_the_bound_are_decoded_when_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_foxglove(tmp_path / "drive.mcap", DRIVE)
    at_once = read_recording(path).views
    decoded = []
    plain = CompressedPicture.decode
    monkeypatch.setattr(CompressedPicture, "decode", lambda picture: decoded.append(picture) or plain(picture))
    monkeypatch.setattr(images, "HELD", 4 * 48 * 64)
    later = read_recording(path).views
    assert len(decoded) == 5
    for one, other in zip(at_once, later, strict=True):
        assert dict(one.images).keys() == dict(other.images).keys()
        np.testing.assert_array_equal(one.images["cam0"], other.images["cam0"])
        before = len(decoded)
        np.testing.assert_array_equal(one.images["cam0"], other.images["cam0"])
        assert len(decoded) == before  # of a view that is asked twice the pixels are still there
    assert len(decoded) == len(later)


def test_raw_pictures_are_smaller_decoded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(images, "HELD", 0)
    path = write_foxglove(tmp_path / "drive.mcap", DRIVE, FoxgloveSetup(raw="mono8"))
    for view in plan_views(open_log(path)).thinned(1.0).read():
        np.testing.assert_array_equal(view.images["cam0"], DRIVE.picture(view.time))


@pytest.mark.parametrize("held", [0, 1 << 20])
def test_sizes_that_change_on_a_topic_are_refused(monkeypatch: pytest.MonkeyPatch, held: int) -> None:
    monkeypatch.setattr(images, "HELD", held)
    store = PictureStore(Path("a.mcap"))
    for _ in range(3):
        store.taken("/cam", png(4, 6))
    store.taken("/other", png(6, 4))
    with pytest.raises(LogError) as caught:
        store.taken("/cam", png(6, 4))
    assert str(caught.value) == (
        "a.mcap: topic /cam: an image is 4 × 6 pixels, the first 6 × 4; valid is one size a topic"
    )


@pytest.mark.parametrize("held", [-1, 1 << 20])
def test_a_damaged_picture_is_named_with_its_topic(monkeypatch: pytest.MonkeyPatch, held: int) -> None:
    monkeypatch.setattr(images, "HELD", held)
    store = PictureStore(Path("a.mcap"))
    with pytest.raises(LogError, match=r"a\.mcap: topic /cam: an image cannot be decoded; valid are PNG and JPEG"):
        store.taken("/cam", CompressedPicture(b"no picture"))


def test_depth_pictures_are_told_and_not_used(tmp_path: Path) -> None:
    path = write_foxglove(tmp_path / "depth.mcap", DRIVE, FoxgloveSetup(raw="16UC1"))
    recording = read_recording(path)
    assert recording.sensors == {"laser"}
    assert recording.findings
    assert "topic /cam0/image_raw/compressed: depth (16UC1), not used" in recording.findings.notes


def test_a_drive_with_another_encoding_is_refused_by_name(tmp_path: Path) -> None:
    path = write_foxglove(tmp_path / "odd.mcap", replace(DRIVE, seconds=2.0), FoxgloveSetup(raw="nv21"))
    with pytest.raises(LogError, match=r"odd\.mcap: topic /cam0/\S+: encoding 'nv21' is not read; valid are mono8, "):
        read_recording(path)
