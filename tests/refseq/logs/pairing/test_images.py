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


@pytest.fixture
def decoded(monkeypatch: pytest.MonkeyPatch) -> list[CompressedPicture]:
    """The pictures that were decoded, in order."""
    found: list[CompressedPicture] = []
    plain = CompressedPicture.decode
    monkeypatch.setattr(CompressedPicture, "decode", lambda picture: found.append(picture) or plain(picture))
    return found


def test_nothing_is_decoded_that_nobody_looks_at(tmp_path: Path, decoded: list[CompressedPicture]) -> None:
    views = read_recording(write_foxglove(tmp_path / "drive.mcap", DRIVE)).views
    assert all("cam0" in view.images and view.sensors for view in views)
    assert decoded == []
    np.testing.assert_array_equal(views[3].images["cam0"], DRIVE.picture(views[3].time))
    assert len(decoded) == 1


def test_pictures_are_decoded_once_while_there_is_room_for_their_pixels(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, decoded: list[CompressedPicture]
) -> None:
    path = write_foxglove(tmp_path / "drive.mcap", DRIVE)
    views = read_recording(path).views
    first = [view.images["cam0"] for view in views]
    assert all(view.images["cam0"] is picture for view, picture in zip(views, first, strict=True))
    assert len(decoded) == len(views) > 20
    decoded.clear()
    monkeypatch.setattr(images, "HELD", 4 * 48 * 64)
    later = read_recording(path).views
    for one, other in zip(first, later, strict=True):
        np.testing.assert_array_equal(one, other.images["cam0"])
        assert other.images["cam0"] is other.images["cam0"]  # of a view that is asked twice they are still there
    assert len(decoded) == len(later)
    assert all(view.images["cam0"] is view.images["cam0"] for view in later)
    assert len(decoded) == 2 * len(later) - 4  # four are held, the others were those of the latest long ago


def test_what_is_decoded_takes_the_place_of_what_was_encoded(tmp_path: Path) -> None:
    picture = png(480, 640)
    taken = PictureStore(Path("a.mcap")).taken("/cam", picture)
    assert isinstance(taken, images.EncodedPicture)
    taken.pixels()
    assert not any(one is picture for one in vars(taken).values())


def test_raw_pictures_are_smaller_decoded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(images, "HELD", 0)
    path = write_foxglove(tmp_path / "drive.mcap", DRIVE, FoxgloveSetup(raw="mono8"))
    for view in plan_views(open_log(path)).thinned(1.0).read():
        np.testing.assert_array_equal(view.images["cam0"], DRIVE.picture(view.time))


def test_sizes_that_change_on_a_topic_are_refused() -> None:
    store = PictureStore(Path("a.mcap"))
    for _ in range(3):
        store.taken("/cam", png(4, 6))
    store.taken("/other", png(6, 4))
    with pytest.raises(LogError) as caught:
        store.taken("/cam", png(6, 4))
    assert str(caught.value) == (
        "a.mcap: topic /cam: an image is 4 × 6 pixels, the first 6 × 4; valid is one size a topic"
    )


def test_a_picture_that_its_head_turns_is_refused_among_others() -> None:
    """A JPEG's head tells how it is turned: as it is seen it is of another size than the others."""
    _, jpeg = cv2.imencode(".jpg", np.full((8, 16), 7, np.uint8))
    plain = jpeg.tobytes()
    tag = b"II*\x00\x08\x00\x00\x00\x01\x00\x12\x01\x03\x00\x01\x00\x00\x00\x06\x00\x00\x00\x00\x00\x00\x00"
    head = b"Exif\x00\x00" + tag
    turned = plain[:2] + b"\xff\xe1" + (len(head) + 2).to_bytes(2, "big") + head + plain[2:]
    store = PictureStore(Path("a.mcap"))
    first = store.taken("/cam", CompressedPicture(plain))
    assert isinstance(first, images.EncodedPicture)
    assert first.pixels().shape == (8, 16)
    with pytest.raises(LogError, match=r"a\.mcap: topic /cam: an image is 8 × 16 pixels, the first 16 × 8; valid is"):
        store.taken("/cam", CompressedPicture(turned))
    alone = store.taken("/other", CompressedPicture(turned))
    assert isinstance(alone, images.EncodedPicture)
    assert alone.pixels().shape == (16, 8)


def test_a_picture_with_a_damaged_head_is_named_with_its_topic() -> None:
    store = PictureStore(Path("a.mcap"))
    with pytest.raises(LogError, match=r"a\.mcap: topic /cam: an image cannot be decoded; valid are PNG, JPEG"):
        store.taken("/cam", CompressedPicture(b"no picture"))


def test_a_picture_with_damaged_pixels_is_named_by_whoever_asks_for_them() -> None:
    whole = png(40, 60).data
    taken = PictureStore(Path("a.mcap")).taken("/cam", CompressedPicture(whole[:60] + b"\x00" * 20))
    assert isinstance(taken, images.EncodedPicture)
    for _ in range(2):
        with pytest.raises(LogError, match=r"a\.mcap: topic /cam: an image cannot be decoded"):
            taken.pixels()


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
