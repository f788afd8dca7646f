import sys
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

import av
import foxglove
import numpy as np
import pytest
from foxglove import channels, messages
from numpy.typing import NDArray

from refseq.errors import LogError
from refseq.logs import read_recording
from refseq.logs.decoding.video import VideoStream
from refseq.planar import Pose
from tests.refseq.logs.foxglove_drive import ns, pose_message
from tests.refseq.logs.robot_drive import RobotDrive

DRIVE = RobotDrive(seconds=6.0)
TIMES = [DRIVE.start + k / 10 for k in range(50)]


def encoded(pictures: Sequence[NDArray[np.uint8]], codec: str = "libx264", every: int = 12) -> list[bytes]:
    """One packet a picture, a key frame ``every`` so many, as robots' encoders are set: no B-frames."""
    height, width = pictures[0].shape
    encoder = av.CodecContext.create(codec, "w")
    encoder.width, encoder.height, encoder.pix_fmt = width, height, "yuv420p"
    encoder.time_base, encoder.gop_size = Fraction(1, 10), every
    encoder.options = {
        "tune": "zerolatency",
        "bf": "0",
        "crf": "10",
        "x265-params": f"keyint={every}:bframes=0:log-level=none",
    }
    packets: list[bytes] = []
    for picture in pictures:
        packets += [bytes(packet) for packet in encoder.encode(av.VideoFrame.from_ndarray(picture, format="gray"))]
    packets += [bytes(packet) for packet in encoder.encode(None)]
    assert len(packets) == len(pictures)
    return packets


def write(path: Path, packets: Sequence[bytes], form: str = "h264") -> Path:
    context = foxglove.Context()
    with foxglove.open_mcap(str(path), allow_overwrite=True, context=context):
        video = channels.CompressedVideoChannel("/cam/video", context=context)
        odometry = channels.OdometryChannel("/odom", context=context)
        for time, data in zip(TIMES, packets, strict=False):
            stamp = messages.Timestamp(sec=ns(time) // 10**9, nsec=ns(time) % 10**9)
            pose = pose_message(Pose(0.8 * (time - DRIVE.start), 0, 0))
            odometry.log(messages.Odometry(timestamp=stamp, pose=pose), log_time=ns(time))
            video.log(messages.CompressedVideo(timestamp=stamp, data=data, format=form), log_time=ns(time))
    return path


def error_of(seen: NDArray[np.uint8], shown: NDArray[np.uint8]) -> float:
    """Mean difference in grey levels, but for what lossy coding and the range of video take."""
    return float(np.abs(seen.astype(float) - shown).mean())


@pytest.mark.parametrize(("codec", "form"), [("libx264", "h264"), ("libx265", "h265")])
def test_each_view_shows_the_picture_of_its_time(tmp_path: Path, codec: str, form: str) -> None:
    path = write(tmp_path / "video.mcap", encoded([DRIVE.picture(time) for time in TIMES], codec), form)
    for thin in (None, 0.7):
        recording = read_recording(path, thin=thin)
        assert len(recording.views) == pytest.approx(50 if thin is None else 6, abs=1)
        for view in recording.views:
            assert error_of(view.images["cam"], DRIVE.picture(view.time)) < 4
            assert error_of(view.images["cam"], DRIVE.picture(view.time + 0.3)) > 8


def test_pictures_may_be_asked_for_in_any_order() -> None:
    pictures = [DRIVE.picture(time) for time in TIMES[:24]]
    stream = VideoStream()
    found = [stream.picture(data, "h264") for data in encoded(pictures)]
    for number in (23, 3, 4, 15, 0, 11, 12):
        picture = found[number]
        assert picture
        assert error_of(picture.decode(), pictures[number]) < 4


def test_a_video_that_begins_in_the_middle_is_seen_from_its_next_key_frame(tmp_path: Path) -> None:
    packets = encoded([DRIVE.picture(time) for time in TIMES])
    recording = read_recording(write(tmp_path / "late.mcap", packets[5:]))
    assert len(recording.views) == 50 - 12
    assert recording.skipped == {"foxglove.CompressedVideo without a value": 7}


def test_what_is_no_video_is_named(tmp_path: Path) -> None:
    path = write(tmp_path / "odd.mcap", [b"\x00\x00\x00\x01\x65 no picture"] * 5)
    with pytest.raises(LogError, match=r"odd\.mcap: topic /cam/video: a picture of the video cannot be decoded"):
        read_recording(path)
    path = write(tmp_path / "odd.mcap", [b"\x00"] * 5, "vp9")
    with pytest.raises(LogError) as caught:
        read_recording(path)
    assert str(caught.value) == (
        f"{path}: topic /cam/video: the message logged at 1700000000.250000 s is not readable, nor are the other 4: "
        "video format 'vp9' is not read; valid are h264 and h265"
    )


def test_without_the_extra_it_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(tmp_path / "video.mcap", encoded([DRIVE.picture(time) for time in TIMES[:4]]))
    monkeypatch.setitem(sys.modules, "av", None)
    with pytest.raises(LogError) as caught:
        read_recording(path)
    assert str(caught.value) == (
        f"{path}: topic /cam/video: CompressedVideo needs PyAV; valid is the extra: pip install '.[video]' in a clone"
    )
