"""Messages that are not what their schema says: left out and told, and what lies behind them is read."""

from pathlib import Path

import pytest
from foxglove import messages
from mcap.writer import Writer

from refseq.errors import LogError
from refseq.logs import open_log, plan_views
from refseq.logs.foxglove.json_messages import STAMP
from refseq.planar import Pose
from tests.refseq.logs.foxglove_drive import pose_message
from tests.refseq.logs.json_drive import START, VIEWS, every, write_json


@pytest.mark.parametrize(
    ("bad", "reason"),
    [
        (b"{not json", "its bytes are no JSON from character 2 on; valid is foxglove.LaserScan as json"),
        (b"\xff", "its bytes are no JSON; valid is foxglove.LaserScan as json"),
        (b"[" * 100_000, "its bytes are no JSON; valid is foxglove.LaserScan as json"),
        ([1, 2], "its JSON is [1, 2] and no object; valid is foxglove.LaserScan as json"),
        ("text", 'its JSON is "text" and no object; valid is foxglove.LaserScan as json'),
        ({"timestamp": 1.7e9}, f"its timestamp is 1700000000.0; valid is {STAMP}"),
        ({"timestamp": {"sec": 1, "nanosec": 2}}, f'its timestamp is {{"sec": 1, "nanosec": 2}}; valid is {STAMP}'),
        ({"timestamp": {"sec": 10**30, "nsec": 0}}, f'its timestamp is {{"sec": 1{"0" * 30}, "nsec": 0}}; valid is '),
        ({"frame_id": 3}, "its frame_id is 3; valid is a text"),
        ({"start_angle": [1]}, "its start_angle is [1]; valid is a number"),
        ({"startAngle": "wide"}, 'its startAngle is "wide"; valid is a number'),
        ({"ranges": "hello"}, 'its ranges is "hello"; valid is a list, of which each is a number'),
        ({"ranges": [1.0] * 5000 + ["far", {}]}, 'its ranges[5000] is "far"; valid is a number'),
        ({"pose": 3}, "its pose is 3; valid is an object"),
        ({"pose": {"position": {"x": "east"}}}, 'its pose.position.x is "east"; valid is a number'),
        ({"ranges": ["x" * 1000]}, f'its ranges[0] is "{"x" * 58}…; valid is a number'),
        ({"ranges": [1.0, 2.0]}, "its start_angle and its end_angle are 0; valid are the bearings of the first beam"),
    ],
)
def test_one_message_among_others_is_left_out_and_told(tmp_path: Path, bad: object, reason: str) -> None:
    source = open_log(write_json(tmp_path / "a.mcap", scan={7: bad}))
    plan = plan_views(source)
    assert len(plan) == VIEWS - 1
    assert len(list(plan.read())) == VIEWS - 1
    assert source.complete
    (told,) = plan.findings.losses()
    assert told.startswith(
        f"topic /scan: the message logged at {START + 7}.000000 s is not readable and left out: {reason}"
    )
    assert told.count("; valid ") == 1


def test_several_are_counted_and_counted_anew_when_the_log_is_read_again(tmp_path: Path) -> None:
    source = open_log(write_json(tmp_path / "a.mcap", scan={2: b"{", 5: {"frame_id": 3}, 6: []}))
    for _ in range(2):
        plan = plan_views(source)
        assert len(plan) == VIEWS - 3
        (told,) = plan.findings.losses()
        assert told == (
            f"topic /scan: the message logged at {START + 2}.000000 s and 2 more of {VIEWS} are not readable and left "
            "out: its bytes are no JSON from character 2 on; valid is foxglove.LaserScan as json"
        )
    list(source.samples(["/odom"]))
    assert source.unreadable["/scan"].count == 3, "of a topic that was not read again"


@pytest.mark.parametrize("topic", ["/scan", "/odom"])
def test_a_topic_of_which_none_can_be_read_is_refused_with_its_reason(tmp_path: Path, topic: str) -> None:
    changed = {"scan" if topic == "/scan" else "odometry": every(lambda second: {"timestamp": float(second)})}
    path = write_json(tmp_path / "a.mcap", **changed)  # type: ignore[arg-type]
    with pytest.raises(LogError) as caught:
        plan_views(open_log(path))
    assert str(caught.value) == (
        f"{path}: topic {topic}: the message logged at {START}.000000 s is not readable, nor are the other "
        f"{VIEWS - 1}: its timestamp is 0.0; valid is {STAMP}"
    )


def test_a_cut_file_is_cut_off_whatever_its_messages_are(tmp_path: Path) -> None:
    path = write_json(tmp_path / "a.mcap")
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 4])
    source = open_log(path)
    list(source.samples())
    assert not source.complete
    assert not source.unreadable


@pytest.mark.parametrize(
    ("bad", "reason"),
    [
        (b"\x0a\xff\xff", "its bytes are no Protobuf; valid is foxglove.LaserScan as protobuf"),
        (b'{"ranges": [1]}', "its bytes are no Protobuf, but look like JSON; valid is foxglove.LaserScan as protobuf"),
    ],
)
def test_protobuf_that_is_none_is_left_out_as_well(tmp_path: Path, bad: bytes, reason: str) -> None:
    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="", library="")
        scan, odometry = messages.LaserScan, messages.Odometry
        ids = {
            kind: writer.register_channel(
                topic, "protobuf", writer.register_schema(f"foxglove.{kind.__name__}", "protobuf", b"")
            )
            for kind, topic in ((scan, "/scan"), (odometry, "/odom"))
        }
        for second in range(VIEWS):
            time = (START + second) * 1_000_000_000
            whole = scan(start_angle=-1, end_angle=1, ranges=[2.0, 3.0, 4.0]).encode()
            writer.add_message(ids[scan], time, bad if second == 3 else whole, time)
            pose = odometry(pose=pose_message(Pose(0.5 * second, 0.0, 0.0))).encode()
            writer.add_message(ids[odometry], time, pose, time)
        writer.finish()
    plan = plan_views(open_log(path))
    assert len(plan) == VIEWS - 1
    (told,) = plan.findings.losses()
    assert told == f"topic /scan: the message logged at {START + 3}.000000 s is not readable and left out: {reason}"
