"""Folders of pictures of which some are damaged or of another size: the checkup and learning say the same."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from refseq.errors import RefseqError
from refseq_bench.scenarios.drives.inputs import DriveSelection, read_drive
from refseq_bench.scenarios.drives.left_out import check_all_views
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.log_tools.checkup import check_log
from refseq_bench.scenarios.log_tools.verdicts import Usability
from tests.support import texture

COUNT = 24
ODD = 5
"""A picture that is none of the eight that are decoded."""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder of pictures, one for each metre."""
    for number in range(COUNT):
        cv2.imwrite(str(tmp_path / f"{number:02d}.jpg"), texture(number, 48, 1.0, 0))
    return tmp_path


@pytest.mark.parametrize("number", [0, ODD])
@pytest.mark.parametrize("share", [0.0, 0.5])
def test_a_damaged_picture_is_told_and_left_out(folder: Path, number: int, share: float) -> None:
    hurt = folder / f"{number:02d}.jpg"
    data = hurt.read_bytes()
    hurt.write_bytes(data[: int(share * len(data))])
    checkup, drive = check_log(folder, DriveSelection()), read_drive(folder)
    assert checkup.verdicts[0].usability is Usability.WORKS
    assert list(checkup.warnings) == [f"camera-1: the picture {hurt.name} is damaged and left out"]
    assert checkup.taken["/camera-1"] == "camera camera-1, 640 × 480"
    assert checkup.views == len(drive.views) == COUNT - 1
    assert all(len(view.images["camera-1"]) for view in drive.views)
    with pytest.raises(ScenarioError) as caught:
        check_all_views(drive.metadata, folder)
    assert str(caught.value) == (
        f"{folder}: damaged pictures are left out (camera-1: 1, the first {hurt.name}), and the ground truth counts "
        "all; valid are whole ones"
    )


def told_by_learning(folder: Path, caplog: pytest.LogCaptureFixture) -> list[str]:
    read_drive(folder)
    return [one.getMessage().removeprefix(f"{folder}: ").partition(";")[0] for one in caplog.records[1:]]


def test_pictures_that_are_all_the_same_are_told(folder: Path, caplog: pytest.LogCaptureFixture) -> None:
    assert told_by_learning(folder, caplog) == []
    caplog.clear()
    for number in range(1, COUNT):
        (folder / f"{number:02d}.jpg").write_bytes((folder / "00.jpg").read_bytes())
    told = "camera-1: its pictures are all the same: they show nothing of the way"
    assert [one.reason for one in check_log(folder, DriveSelection()).verdicts[:2]] == 2 * [told]
    assert told_by_learning(folder, caplog) == [told]


def test_a_camera_that_stands_may_show_the_same(folder: Path) -> None:
    for number in range(1, COUNT):
        (folder / f"{number:02d}.jpg").write_bytes((folder / "00.jpg").read_bytes())
    table = folder / "odometry.csv"
    table.write_text("time,x,y,heading\n" + "".join(f"{k},{k % 2 / 1000},0,0\n" for k in range(COUNT)))
    localise = check_log(folder, DriveSelection(odometry=str(table))).verdicts[1]
    assert localise.reason.startswith("in a map of another drive; the robot hardly moves")


@pytest.mark.parametrize(("height", "told"), [(15, "20 × 15"), (16, "")])
def test_pictures_that_are_too_small_are_told(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, height: int, told: str
) -> None:
    for number in range(COUNT):
        cv2.imwrite(str(tmp_path / f"{number:02d}.png"), texture(number, height, 1.0, 0))
    wanted = [f"camera-1: its pictures are of {told} pixels: too few to tell places apart"] if told else []
    assert list(check_log(tmp_path, DriveSelection()).warnings) == wanted
    assert told_by_learning(tmp_path, caplog) == wanted


@pytest.mark.parametrize(
    ("numbers", "told"),
    [
        ([4], "the picture 04.jpg is of 16 bits, as distances are, and left out"),
        ([4, 7], "2 pictures are of 16 bits, as distances are, and left out, the first 04.jpg"),
    ],
)
def test_a_picture_of_sixteen_bits_is_not_called_damaged(folder: Path, numbers: list[int], told: str) -> None:
    for number in numbers:
        deep = cv2.imencode(".png", texture(number, 48, 1.0, 0).astype(np.uint16) * 256)[1]
        (folder / f"{number:02d}.jpg").write_bytes(deep.tobytes())
    (folder / "10.jpg").write_bytes(b"")
    checkup = check_log(folder, DriveSelection())
    assert checkup.warnings == ("camera-1: the picture 10.jpg is damaged and left out", f"camera-1: {told}")
    assert len(read_drive(folder).views) == COUNT - 1 - len(numbers)


def test_a_log_of_one_picture_is_told_all_of_as_any_other(folder: Path) -> None:
    for number in range(1, COUNT):
        (folder / f"{number:02d}.jpg").unlink()
    checkup = check_log(folder, DriveSelection())
    assert checkup.verdicts[0].usability is Usability.FAILS
    assert checkup.verdicts[0].reason.startswith("the robot hardly moves: 0.00 m by the poses of topic ")
    assert checkup.taken["/camera-1"] == "camera camera-1, 640 × 480"
    assert checkup.cost is not None


def test_pictures_that_nothing_is_found_in_keep_nobody_from_the_checkup(tmp_path: Path) -> None:
    ramp = np.tile(np.linspace(100, 108, 64).astype(np.uint8), (48, 1))
    for number in range(COUNT):
        cv2.imwrite(str(tmp_path / f"{number:02d}.png"), ramp)
    assert check_log(tmp_path, DriveSelection()).taken["/camera-1"] == "camera camera-1, 640 × 480"


def test_a_picture_of_another_size_is_refused_by_the_checkup_and_by_reading(folder: Path) -> None:
    cv2.imwrite(str(folder / f"{ODD:02d}.jpg"), texture(ODD, 36, 1.0, 0))
    checkup = check_log(folder, DriveSelection())
    told = (
        f"{COUNT - 1} of its pictures are 64 × 48 pixels, 1 is not, the first 05.jpg: 48 × 36; valid is one size a "
        "camera"
    )
    assert [(one.usability, one.reason) for one in checkup.verdicts[:2]] == 2 * [(Usability.FAILS, f"camera-1: {told}")]
    with pytest.raises(RefseqError) as caught:
        read_drive(folder)
    assert str(caught.value) == f"{folder}: topic /camera-1: {told}"
    check_all_views(read_drive(folder, DriveSelection(views="6:24")).metadata, folder)
