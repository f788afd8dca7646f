"""Folders of pictures as drives: order, times, what is assumed, and folders that are none."""

import os
from pathlib import Path

import cv2
import numpy as np
import pytest

from refseq.errors import LogError
from refseq.logs import read_recording
from refseq.logs.kinds import open_log
from refseq.logs.pairing.options import PairingOptions
from refseq.logs.pairing.plan import plan_views
from refseq.logs.pictures.source import PictureFolder
from refseq.logs.trajectories import read_trajectory

STAMPS = [1_403_636_579_763_555_584, 1_403_636_579_813_555_456, 1_403_636_579_863_555_584]


def write(folder: Path, *names: str, size: tuple[int, int] = (6, 8)) -> Path:
    """Pictures whose grey value tells their number."""
    folder.mkdir(exist_ok=True)
    for number, name in enumerate(names):
        cv2.imwrite(str(folder / name), np.full(size, 10 * (number + 1) % 256, np.uint8))
    return folder


def test_pictures_come_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    folder = write(tmp_path / "drive", "image1.png", "image2.png", "image10.png")
    (folder / "notes.txt").write_text("no picture")
    (folder / "._image3.png").write_text("left behind by a file manager")
    (folder / "depth").mkdir()
    recording = read_recording(folder)
    assert [int(view.images["camera-1"].mean()) for view in recording.views] == [10, 20, 30]
    assert [view.time for view in recording.views] == [0, 1, 2]
    assert [view.distance for view in recording.views] == [0, 1, 1]
    assert {view.truth for view in recording.views} == {None}
    assert recording.skipped == {".txt": 1}
    assert recording.metadata["odometry"] == "assumed: 1 m a picture"
    assert recording.metadata["times"] == "assumed: one picture a second"
    assert recording.metadata["images"] == "8 × 6 pixels, made 640 wide"
    assert recording.views[0].images["camera-1"].shape == (480, 640)


@pytest.mark.parametrize(
    ("stems", "times"),
    [
        ([str(stamp) for stamp in STAMPS], [stamp / 1e9 for stamp in STAMPS]),
        (["1305031102.175304", "1305031102.21", "1305031102.3"], [1305031102.175304, 1305031102.21, 1305031102.3]),
        (["0000000007", "0000000008", "0000000020"], [0, 1, 2]),
        (["1700000000", "1600000000", "x"], [0, 1, 2]),
        (["cam_1760000001522", "cam_1760000000001"], [1760000000.001, 1760000001.522]),
        (["left-1760000000.25-grey", "left-1760000001.5-grey"], [1760000000.25, 1760000001.5]),
        (["1760000000_901", "1760000001_022", "1760000001_123"], [1760000000.901, 1760000001.022, 1760000001.123]),
        (["1760000000_001", "1760000000_002", "1760000001_003"], [0, 1, 2]),
        (["cam0_1760000000001", "cam1_1760000000002"], [0, 1]),
        (["20260131120000", "20260131120100"], [0, 1]),
    ],
    ids=["EuRoC", "TUM", "numbers", "no times", "prefix", "around", "split", "counted", "two cameras", "dates"],
)  # fmt: skip
def test_times_by_the_names(tmp_path: Path, stems: list[str], times: list[float]) -> None:
    recording = read_recording(write(tmp_path / "drive", *(f"{stem}.png" for stem in stems)))
    assert [view.time for view in recording.views] == pytest.approx(times, abs=1e-6)


def test_a_few_pictures_of_other_names_are_told_and_left_out(tmp_path: Path) -> None:
    """With more of them nobody knows which are the drive's: one a second is taken, which is told as well."""
    names = [f"{1_760_000_000_000 + 700 * k}.png" for k in range(20)]
    folder = write(tmp_path / "drive", *names, "preview.png")
    recording = read_recording(folder)
    assert [view.time for view in recording.views] == pytest.approx([1_760_000_000 + 0.7 * k for k in range(20)])
    assert recording.findings is not None
    assert recording.findings.notes == ("times are by the pictures' names; left out, as they tell none: preview.png",)
    write(folder, "a.png", "b.png", "c.png")
    recording = read_recording(folder)
    assert [view.time for view in recording.views] == list(range(24))
    told = "assumed: one picture a second; no time is told by a.png, b.png, c.png, …"
    assert recording.metadata["times"] == told
    (tmp_path / "odometry.csv").write_text("time,x,y\n1760000000,0,0\n1760000010,9,0\n")
    with pytest.raises(LogError, match=f"; the log's times are {told}$"):
        read_recording(folder, odometry=read_trajectory(tmp_path / "odometry.csv"))


@pytest.mark.parametrize("ending", [".bmp", ".WEBP", ".jpeg"])
def test_pictures_of_other_formats_are_read_as_png_are(tmp_path: Path, ending: str) -> None:
    recording = read_recording(write(tmp_path / "drive", *(f"{k}{ending}" for k in range(3))))
    assert [round(float(view.images["camera-1"].mean())) for view in recording.views] == [10, 20, 30]
    assert recording.metadata["images"] == "8 × 6 pixels, made 640 wide"


def test_colour_is_made_grey_and_links_are_followed(tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    colour = np.zeros((6, 640, 3), np.uint8)
    colour[:, :, 1] = 100  # green
    cv2.imwrite(str(tmp_path / "other" / "a.png"), colour)
    (tmp_path / "drive").mkdir()
    (tmp_path / "drive" / "a.png").symlink_to(tmp_path / "other" / "a.png")
    (view,) = read_recording(tmp_path / "drive").views
    assert view.images["camera-1"].shape == (6, 640)
    assert view.images["camera-1"].mean() == pytest.approx(0.587 * 100, abs=1)


def test_as_a_scenario_asks_for_them(tmp_path: Path) -> None:
    folder = write(tmp_path / "drive", "1.png", "2.png")
    recording = plan_views(PictureFolder(folder, spacing=0.5, width=0)).recording()
    assert [view.distance for view in recording.views] == [0, 0.5]
    assert recording.views[0].images["camera-1"].shape == (6, 8)


def test_odometry_and_truth_beside_pictures(tmp_path: Path) -> None:
    folder = write(tmp_path / "drive", *(f"{stamp}.png" for stamp in STAMPS))
    (tmp_path / "odometry.csv").write_text("index,x,y,theta\n0,0,0,0\n1,0.3,0,0\n2,0.3,0.4,1.5\n")
    rows = [f"{stamp / 1e9:.9f} {k} 0 0 0 0 0 1" for k, stamp in enumerate(STAMPS)]
    (tmp_path / "truth.txt").write_text("\n".join(rows))
    tables = [read_trajectory(tmp_path / name) for name in ("odometry.csv", "truth.txt")]
    recording = read_recording(folder, odometry=tables[0], truth=tables[1])
    assert [view.distance for view in recording.views] == pytest.approx([0, 0.3, 0.4])
    assert [view.truth.x for view in recording.views if view.truth] == pytest.approx([0, 1, 2], abs=1e-4)
    assert recording.findings is not None
    assert "odometry.csv: its poses are numbered as the samples of /camera-1" in recording.findings.notes


@pytest.mark.parametrize("late", [0.75, -3600.0, 7200.0])
def test_a_late_camera_takes_odometry_and_truth_of_its_own_time(tmp_path: Path, late: float) -> None:
    """Where its clock is off by hours as well; views have the odometry's time."""
    folder = write(tmp_path / "drive", *(f"{1_760_000_000_000 + round(1000 * (k + late))}.png" for k in range(5)))
    rows = "".join(f"{1_760_000_000 + k},{k * k},0\n" for k in range(-2, 8))
    (tmp_path / "poses.csv").write_text(f"time,x,y\n{rows}")
    table = read_trajectory(tmp_path / "poses.csv")
    options = PairingOptions(odometry=table, truth=table, late={"camera-1": late})
    views = read_recording(folder, options).views
    assert [view.time for view in views] == pytest.approx([1_760_000_000 + k for k in range(5)])
    assert [view.distance for view in views] == pytest.approx([0, 1, 3, 5, 7], abs=1e-4)
    assert [view.truth.x for view in views if view.truth] == pytest.approx([0, 1, 4, 9, 16], abs=1e-4)


def test_a_late_camera_without_odometry_from_elsewhere_is_refused(tmp_path: Path) -> None:
    folder = write(tmp_path / "drive", "1.png", "2.png")
    told = "valid is a late sensor that is the only one, where odometry is given from elsewhere"
    with pytest.raises(LogError, match=told):
        read_recording(folder, PairingOptions(late={"camera-1": 3.0}))


def test_every_tenth_picture_alone_is_decoded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = write(tmp_path / "drive", *(f"{k}.png" for k in range(30)))
    decoded = []
    real = cv2.imdecode
    monkeypatch.setattr(cv2, "imdecode", lambda *args: decoded.append(1) or real(*args))
    views = read_recording(folder, thin=10).views
    assert decoded == []
    assert all(view.images["camera-1"].shape == (480, 640) for view in views)
    assert len(views) == len(decoded) == 3


def broken(folder: Path, how: str) -> None:
    match how:
        case "empty":
            (folder / "c.png").touch()
        case "cut":
            data = (folder / "a.png").read_bytes()
            (folder / "c.png").write_bytes(data[:48])
        case "column":
            write(folder, "c.png", size=(10_000, 1))
        case "no picture":
            (folder / "c.png").write_text("hello")
        case "16 bits":
            cv2.imwrite(str(folder / "c.png"), np.zeros((6, 8), np.uint16))
        case "huge":
            data = bytearray((folder / "a.png").read_bytes())
            data[16:24] = (100_000).to_bytes(4, "big") * 2
            (folder / "c.png").write_bytes(data)
        case "link":
            (folder / "c.png").symlink_to(folder / "gone.png")


DAMAGE = [
    ("no picture", r"c\.png: an image cannot be decoded; valid are PNG, JPEG, WebP and BMP"),
    ("empty", r"c\.png: an image cannot be decoded; valid are PNG, JPEG, WebP and BMP"),
    ("cut", r"c\.png: an image cannot be decoded: a part of it declares \d+ bytes, and \d+ are left"),
    ("16 bits", r"c\.png: is of 16 bits, as distances are; valid are pictures of 8 bits"),
    ("huge", r"c\.png: an image declares 100000 × 100000 pixels; valid are 1 to"),
    ("column", r"c\.png: an image declares 640 × 6400000 pixels; valid are 1 to"),
    ("link", r"c\.png: cannot be read: No such file"),
]


@pytest.mark.parametrize(("how", "message"), DAMAGE)
def test_a_folder_of_which_no_picture_is_whole_is_refused(tmp_path: Path, how: str, message: str) -> None:
    folder = write(tmp_path / "drive", "a.png")
    broken(folder, how)
    (folder / "a.png").unlink()
    with pytest.raises(LogError, match=message) as told:
        dict(read_recording(folder).views[0].images)
    assert str(told.value).startswith(str(folder))
    assert "\n" not in str(told.value)


@pytest.mark.parametrize("how", [how for how, _ in DAMAGE])
@pytest.mark.parametrize("name", ["0.png", "c.png"])
def test_one_damaged_picture_is_told_and_left_out(tmp_path: Path, how: str, name: str) -> None:
    """The first one as well, which tells the size; the odometer goes on over the gap."""
    folder = write(tmp_path / "drive", "a.png", "b.png", "d.png")
    broken(folder, how)
    (folder / "c.png").rename(folder / name)
    recording = read_recording(folder)
    assert [int(view.images["camera-1"].mean()) for view in recording.views] == [10, 20, 30]
    assert [view.distance for view in recording.views] == [0, 1, 1 if name == "0.png" else 2]
    assert recording.metadata["images"] == "8 × 6 pixels, made 640 wide"
    assert recording.findings is not None
    what = "of 16 bits, as distances are," if how == "16 bits" else "damaged"
    assert list(recording.findings.losses()) == [f"camera-1: the picture {name} is {what} and left out"]


def test_pictures_of_another_size_are_counted_before_any_is_decoded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = write(tmp_path / "drive", *(f"{k}.png" for k in range(30)))
    write(folder, "7.png", "12.png", size=(7, 8))
    write(folder, "20.png", size=(12, 16))
    monkeypatch.setattr(cv2, "imdecode", None)
    plan = plan_views(open_log(folder))
    told = "27 of its pictures are 8 × 6 pixels, 3 are not, the first 7.png: 8 × 7; valid is one size a camera"
    assert plan.other_sizes() == {"/camera-1": told}
    with pytest.raises(LogError) as caught:
        plan.read()
    assert str(caught.value) == f"{folder}: topic /camera-1: {told}"
    few = plan.between(slice(0, 8)).other_sizes()["/camera-1"]
    assert few.startswith("7 of its pictures are 8 × 6 pixels, 1 is not, the first 7.png: 8 × 7;")
    assert plan.between(slice(0, 7)).other_sizes() == {}, "those that are not asked for do not matter"


@pytest.mark.parametrize("head", [b"\0\0\0\x20ftypisom", b"\x1aE\xdf\xa3", b"RIFF\0\1\2\3AVI "])
def test_of_a_video_it_is_told_what_to_do(tmp_path: Path, head: bytes) -> None:
    (tmp_path / "drive.mp4").write_bytes(head + bytes(range(256)))
    with pytest.raises(LogError, match=r"drive\.mp4: is a video; valid is a folder of its pictures, as ffmpeg -i"):
        open_log(tmp_path / "drive.mp4")


def test_folders_that_are_none(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"is a folder that holds no log; valid are .* a folder of pictures"):
        open_log(tmp_path)
    (tmp_path / "a.txt").write_text("hello")
    with pytest.raises(LogError, match="is a folder that holds no log"):
        open_log(tmp_path)
    photos = tmp_path / "photos"
    photos.mkdir()
    with pytest.raises(LogError, match=r"it holds nothing; pictures end in \.png, \.jpg, \.jpeg, \.bmp, \.webp$"):
        open_log(photos)
    for name in ("1.GIF", "2.gif", "3.avif", "README"):
        (photos / name).write_bytes(b"BM")
    with pytest.raises(LogError, match=r"it holds 2 \.gif and 1 \.avif and 1 README; pictures end in \.png"):
        open_log(photos)
    write(photos / "day 1", "a.png")
    (photos / "night").mkdir()
    held = r"it holds 2 \.gif and .* and the folders day 1, night, and day 1 is a folder of pictures; pictures end in"
    with pytest.raises(LogError, match=held):
        open_log(photos)
    locked = tmp_path / "locked"
    locked.mkdir(mode=0)
    if os.access(locked, os.R_OK):
        pytest.skip("this user may read everything")
    with pytest.raises(LogError, match="cannot be read: Permission denied"):
        open_log(locked)
