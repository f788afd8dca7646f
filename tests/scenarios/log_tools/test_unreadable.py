"""Messages that are not what their type says, as ``refseq log check`` and the commands that read a drive tell them."""

import logging
from pathlib import Path

import pytest

from refseq.errors import LogError
from refseq.logs import Recording
from refseq.logs.findings import Findings
from refseq.logs.unreadable import Unreadable, UnreadableMessageError
from refseq_bench.scenarios.drives.inputs import DriveSelection, read_drive
from refseq_bench.scenarios.drives.left_out import LEFT_OUT, views_left_out
from refseq_bench.scenarios.log_tools.checkup import check_log
from refseq_bench.scenarios.log_tools.plain import check_record
from refseq_bench.scenarios.log_tools.verdicts import Usability
from tests.refseq.logs.json_drive import START, VIEWS, every, write_json

REASON = "its frame_id is 3; valid is a text"


def test_one_message_among_others_is_told_once_and_nothing_else_changes(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = write_json(tmp_path / "a.mcap", scan={4: {"frame_id": 3}})
    line = f"topic /scan: the message logged at {START + 4}.000000 s is not readable and left out: {REASON}"
    checkup = check_log(path, DriveSelection())
    assert checkup.warnings == (line,)
    assert checkup.usable
    assert check_record(checkup)["unreadable"] == {"/scan": line}
    with caplog.at_level(logging.WARNING):
        drive = read_drive(path, DriveSelection())
    assert len(drive.views) == VIEWS - 1
    assert drive.complete
    assert [record.getMessage() for record in caplog.records] == [f"{path}: {line}; `refseq log check` tells more"]


@pytest.mark.parametrize("topic", ["/scan", "/odom"])
def test_a_topic_of_which_none_can_be_read_is_told_in_the_table_and_ends_what_needs_it(
    tmp_path: Path, topic: str
) -> None:
    changed = {"scan" if topic == "/scan" else "odometry": every(lambda _: {"frame_id": 3})}
    path = write_json(tmp_path / "a.mcap", **changed)
    checkup = check_log(path, DriveSelection())
    assert checkup.taken[topic] == "ignored: none of its messages can be read"
    place = f"the message logged at {START}.000000 s"
    line = f"topic {topic}: {place} is not readable, nor are the other {VIEWS - 1}: {REASON}"
    assert checkup.warnings == (line,)
    assert {(one.usability, one.reason) for one in checkup.verdicts} == {(Usability.FAILS, line)}
    with pytest.raises(LogError) as caught:
        read_drive(path, DriveSelection())
    assert str(caught.value) == f"{path}: {line}"


def test_lost_pictures_of_a_ground_truth_are_noted_whatever_is_wrong_with_them() -> None:
    """The ground truth counts pictures: of a damaged one and of an unreadable message either is missing."""
    lost = Unreadable(2, 9, UnreadableMessageError("/cam", 7.0, "no", "any"))
    findings = Findings(sensors={"/cam": "camera-1"}, damaged={"camera-1": ()}, unreadable={"/cam": lost})
    told = views_left_out(Recording((), findings=findings))
    assert told == {LEFT_OUT: "camera-1: 2, the first the message logged at 7.000000 s"}
    both = Findings(sensors={"/cam": "camera-1"}, damaged={"camera-1": ("3.png",)}, unreadable={"/cam": lost})
    assert views_left_out(Recording((), findings=both)) == {LEFT_OUT: "camera-1: 3, the first 3.png"}
    other = Findings(sensors={"/cam": "camera-1"}, damaged={"camera-1": ()}, unreadable={"/imu": lost})
    assert views_left_out(Recording((), findings=other)) == {}
