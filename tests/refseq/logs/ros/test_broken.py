"""Bags that are cut off, damaged or not what they say: one line each, with the place and what is valid."""

import re
import sqlite3
import struct
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zstandard
from hypothesis import given, settings
from hypothesis import strategies as st
from rosbags.rosbag1 import Writer as Rosbag1Writer
from rosbags.rosbag2 import CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Rosbag2Writer

from refseq.errors import LogError
from refseq.logs import plan_views, read_recording
from refseq.logs.decoding import unpacking
from refseq.logs.ros import storage
from refseq.logs.ros.bag import RosBag
from refseq.logs.ros.decoder import RosDecoder, Serialization, known_types
from refseq.logs.source import Role
from tests.refseq.logs.foreign import BagMessage, RosMessages, RosSetup, write_ros2_mcap, write_rosbag1, write_rosbag2
from tests.refseq.logs.robot_drive import RobotDrive, Sense

DRIVE = RobotDrive(seconds=1.0)
SMALL = RosSetup(image_format=None)


def refusal(path: Path) -> str:
    """The one line by which a log is refused, without its folder."""
    with pytest.raises(LogError) as caught:
        read_recording(path)
    assert "\n" not in str(caught.value)
    return str(caught.value).replace(f"{path.parent}/", "")


def refusal_of(asked: Callable[[], object]) -> str:
    """The poses that are read, as text, or the reason for refusing them."""
    try:
        return repr(asked())
    except LogError as error:
        return str(error)


def changed_by(change: Callable[[BagMessage], BagMessage | None]) -> type[RosMessages]:
    """Messages of which some are changed on their way to the writer, or left out."""

    class Changed(RosMessages):
        def __iter__(self) -> Iterator[BagMessage]:
            return (found for message in super().__iter__() if (found := change(message)) is not None)

    return Changed


def test_an_empty_file(tmp_path: Path) -> None:
    for name in ("a.bag", "a.db3", "a.mcap"):
        (tmp_path / name).touch()
        assert refusal(tmp_path / name).startswith(f"{name}: is empty")


def test_an_empty_bag(tmp_path: Path) -> None:
    for number, plugin in enumerate(StoragePlugin):
        path = tmp_path / f"bag{number}"
        with Rosbag2Writer(path, version=9, storage_plugin=plugin) as writer:
            writer.add_connection("/scan", "sensor_msgs/msg/LaserScan", typestore=known_types(Serialization.CDR))
        assert refusal(path) == f"{path.name}: is a bag without messages; valid is one with messages of sensors"
    with Rosbag1Writer(tmp_path / "a.bag"):
        pass
    assert refusal(tmp_path / "a.bag") == "a.bag: is a bag without messages; valid is one with messages of sensors"


def test_an_empty_folder(tmp_path: Path) -> None:
    (tmp_path / "bag").mkdir()
    assert refusal(tmp_path / "bag").startswith("bag: is a folder that holds no log; valid are ")


def test_a_folder_without_metadata_is_read_and_not_complete(tmp_path: Path) -> None:
    """The recorder writes them at its end, which a robot whose battery is empty does not reach."""
    whole = read_recording(write_rosbag2(tmp_path / "bag", DRIVE, SMALL))
    (tmp_path / "bag" / "metadata.yaml").unlink()
    rest = read_recording(tmp_path / "bag")
    assert not rest.complete
    assert [view.time for view in rest.views] == [view.time for view in whole.views]


def test_a_folder_of_recordings_is_no_bag(tmp_path: Path) -> None:
    """Drives that have nothing to do with each other are not joined, unless metadata say so."""
    folder = tmp_path / "recordings"
    folder.mkdir()
    for name in ("monday.mcap", "tuesday.mcap"):
        write_ros2_mcap(folder / name, DRIVE, SMALL)
    assert refusal(folder).startswith("recordings: is a folder that holds no log")
    (folder / "tuesday.mcap").rename(folder / "monday_10.mcap")
    (folder / "monday.mcap").rename(folder / "monday_9.mcap")
    assert len(read_recording(folder).views) == 10


def test_files_of_one_bag_follow_each_other_by_their_numbers(tmp_path: Path) -> None:
    """A recorder that begins a new file each minute has ten of them after ten; by letters the tenth would be early."""
    folder = tmp_path / "bag"
    folder.mkdir()
    for number in (2, 9, 10):
        minute = replace(DRIVE, start=DRIVE.start + 60.0 * number)
        write_ros2_mcap(folder / f"bag_{number}.mcap", minute, SMALL)
    recording = read_recording(folder)
    assert recording.findings
    assert recording.findings.notes == (), "no clock jumps back"
    minutes = [int((view.time - DRIVE.start) // 60) for view in recording.views]
    assert minutes == sorted(minutes)
    assert set(minutes) == {2, 9, 10}


@pytest.mark.parametrize("plugin", StoragePlugin)
def test_names_that_look_like_addresses(tmp_path: Path, plugin: StoragePlugin) -> None:
    path = write_rosbag2(tmp_path / "bag", DRIVE, SMALL, plugin).rename(tmp_path / "is it #1? 100%20")
    assert len(read_recording(path).views) == 10


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("a: [", "cannot be read: while parsing"),
        ("a: 1", "has no 'rosbag2_bagfile_information'; valid is"),
        ("rosbag2_bagfile_information: {}", "relative_file_paths is None; valid is a list of files"),
        ("rosbag2_bagfile_information: {relative_file_paths: [1]}", "relative_file_paths is [1]; valid is"),
        ("!!python/object/apply:os.system ['touch ran']", "cannot be read: could not determine a constructor"),
        ("\0", "cannot be read: "),
    ],
)
def test_metadata_that_is_none(tmp_path: Path, text: str, told: str) -> None:
    path = write_rosbag2(tmp_path / "bag", DRIVE, SMALL)
    (path / "metadata.yaml").write_text(text)
    assert refusal(path).startswith(f"bag/metadata.yaml: {told}")
    assert not Path("ran").exists()


def test_metadata_that_names_files_elsewhere(tmp_path: Path) -> None:
    """Only the last part of a name counts, so that a bag reaches into no other folder."""
    path = write_rosbag2(tmp_path / "bag", DRIVE, SMALL)
    text = (path / "metadata.yaml").read_text()
    (path / "metadata.yaml").write_text(text.replace("- bag.mcap", "- ../../etc/passwd"))
    assert refusal(path) == "bag: metadata.yaml names 'passwd', which is not there; valid is a whole folder"


def test_a_bag_of_two_files_of_which_the_last_is_cut_off(tmp_path: Path) -> None:
    path = write_rosbag2(tmp_path / "bag", DRIVE, SMALL)
    whole = (path / "bag.mcap").read_bytes()
    (path / "bag_1.mcap").write_bytes(whole[: len(whole) // 2])
    text = (path / "metadata.yaml").read_text()
    (path / "metadata.yaml").write_text(text.replace("- bag.mcap", "- bag.mcap\n  - bag_1.mcap"))
    assert not RosBag(path).complete
    (path / "bag_1.mcap").write_bytes(whole)
    bag = RosBag(path)
    assert bag.complete
    assert {channel.topic: channel.count for channel in bag.channels}["/scan"] == 20


@settings(max_examples=25, derandomize=True)
@given(share=st.floats(0, 0.99))
def test_a_cut_mcap_file_is_read_up_to_there(tmp_path_factory: pytest.TempPathFactory, share: float) -> None:
    path = tmp_path_factory.mktemp("cut") / "a.mcap"
    write_ros2_mcap(path, RobotDrive(seconds=0.4), SMALL)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    told = refusal_of(lambda: read_recording(path).complete)
    assert told == "False" or (told.startswith(f"{path}: ") and "\n" not in told)


@pytest.mark.parametrize("share", [0.2, 0.6, 0.95])
def test_a_cut_ros1_bag(tmp_path: Path, share: float) -> None:
    path = write_rosbag1(tmp_path / "a.bag", DRIVE, SMALL)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    assert refusal(path).startswith("a.bag: is cut off or damaged: ")
    assert refusal(path).endswith("; valid is a whole bag")


def test_a_ros1_bag_that_was_never_closed(tmp_path: Path) -> None:
    """The recorder writes where the index is at the end; until then it is 0."""
    path = write_rosbag1(tmp_path / "a.bag", DRIVE, SMALL)
    whole = path.read_bytes()
    at = whole.index(b"index_pos=") + len(b"index_pos=")
    path.write_bytes(whole[:at] + bytes(8) + whole[at + 8 :])
    assert "reindex" in refusal(path)


def test_an_index_that_leads_to_another_topic(tmp_path: Path) -> None:
    """Where the indices of two connections are exchanged, nothing is taken for what it is not."""
    path = write_rosbag1(tmp_path / "a.bag", DRIVE, SMALL)
    whole = path.read_bytes()
    index = rb"(?<=op=\x04).{0,40}?conn=(.{4})"
    first, other = list(re.finditer(index, whole, re.DOTALL))[:2]
    path.write_bytes(
        whole[: first.start(1)] + other[1] + whole[first.end(1) : other.start(1)] + first[1] + whole[other.end(1) :]
    )
    bag = RosBag(path)
    topics = [channel.topic for channel in bag.channels]
    with pytest.raises(LogError, match="its index leads to a message of /"):
        [list(bag.samples([topic])) for topic in topics]


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_a_cut_sqlite_file(tmp_path: Path, share: float) -> None:
    path = write_rosbag2(tmp_path / "bag", DRIVE, SMALL, StoragePlugin.SQLITE3) / "bag.db3"
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    assert "is cut off or damaged: " in refusal(path)


def test_a_database_that_is_no_bag(tmp_path: Path) -> None:
    with sqlite3.connect(tmp_path / "a.db3") as database:
        database.execute("CREATE TABLE notes(text TEXT)")
    database.close()
    assert "missing tables" in refusal(tmp_path / "a.db3")


def test_a_cut_packed_file(tmp_path: Path) -> None:
    path = write_rosbag2(tmp_path / "bag", DRIVE, SMALL, compression=CompressionMode.FILE)
    packed = path / "bag.mcap.zstd"
    packed.write_bytes(packed.read_bytes()[:-100])
    assert refusal(path).startswith("bag/bag.mcap.zstd: ")


@pytest.mark.parametrize("topic", ["/scan", "/odom", "/tf_static"])
def test_bytes_that_are_no_such_message(tmp_path: Path, topic: str) -> None:
    path = write_rosbag2(tmp_path / "bag", DRIVE, SMALL, StoragePlugin.SQLITE3)
    with sqlite3.connect(path / "bag.db3") as database:
        database.execute(
            "UPDATE messages SET data = substr(data, 1, length(data) / 2) "
            "WHERE topic_id = (SELECT id FROM topics WHERE name = ?)",
            (topic,),
        )
    database.close()
    told = refusal(path)
    assert told.startswith(f"bag: topic {topic}: the message logged at 1700000000.")
    assert "; valid is " in told


@pytest.mark.parametrize("topic", ["/scan", "/odom"])
@pytest.mark.parametrize("writer", [Rosbag1Writer, Rosbag2Writer])
def test_one_message_that_is_none_is_left_out_and_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, writer: type[Any], topic: str
) -> None:
    """The messages behind it are read, and the log is whole."""
    written, write = Counter[str](), writer.write

    def halved(self: Any, connection: Any, timestamp: int, data: Any) -> None:
        written[connection.topic] += 1
        bad = connection.topic == topic and written[topic] == 4
        write(self, connection, timestamp, bytes(data)[: len(data) // 2] if bad else data)

    monkeypatch.setattr(writer, "write", halved)
    path = tmp_path / "a.bag"
    (write_rosbag1 if writer is Rosbag1Writer else write_rosbag2)(path, DRIVE, SMALL)
    bag = RosBag(path)
    plan = plan_views(bag)
    assert len(plan) == 10 - (topic == "/scan")
    assert len(list(plan.read())) == len(plan)
    assert bag.complete
    (told,) = plan.findings.losses()
    place = r"the message logged at 170000000\d\.\d{6} s is not readable and left out"
    assert re.match(f"topic {topic}: {place}: .*; valid is ", told)


@given(data=st.binary(max_size=200))
def test_any_bytes_are_refused_or_read(data: bytes) -> None:
    for serialization in Serialization:
        for kind in ("sensor_msgs/msg/LaserScan", "tf2_msgs/msg/TFMessage", "sensor_msgs/msg/Image"):
            decoder = RosDecoder(serialization)
            told = refusal_of(lambda decoder=decoder, kind=kind: decoder.sample("/topic", kind, 1, data))
            known = ("topic /topic: the message logged at 0.000000 s is not readable: ", "Sample(", "None")
            assert told.startswith(known)


def test_a_declared_length_is_not_allocated() -> None:
    header = struct.pack("<4xiI", 1, 2) + struct.pack("<I", 1) + b"\0"
    data = b"\0\1\0\0" + header[4:] + bytes(3) + struct.pack("<7fI", *[0.1] * 7, 2**31)
    with pytest.raises(LogError, match="Invalid sequence length 2147483648"):
        RosDecoder(Serialization.CDR).sample("/scan", "sensor_msgs/msg/LaserScan", 1, data)


def test_what_unpacks_to_too_much_is_damage(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    packed = write_rosbag1(tmp_path / "a.bag", DRIVE, SMALL, Rosbag1Writer.CompressionFormat.BZ2)
    for unpack in (unpacking.unpack_zstd, unpacking.unpack_bz2):
        monkeypatch.setattr(unpack, "__defaults__", (1000,))
    assert "unpacks to more than" in refusal(packed)
    with pytest.raises(ValueError, match="unpacks to more than"):
        storage.unpacked_message(zstandard.compress(bytes(2000)))


@pytest.mark.parametrize(("other", "count"), [("/ground_truth", 5), ("/tf_static", 1)])
def test_one_topic_with_two_types(tmp_path: Path, other: str, count: int) -> None:
    """The type with more messages counts; the other is told."""

    def change(message: BagMessage) -> BagMessage:
        return message._replace(topic="/scan") if message.topic == other else message

    path = tmp_path / "bag"
    messages = changed_by(change)(DRIVE, SMALL, known_distribution())
    store = messages.store
    with Rosbag2Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connections: dict[tuple[str, str], Any] = {}
        for topic, kind, logged, content in messages:
            if (topic, kind) not in connections:
                connections[topic, kind] = writer.add_connection(topic, kind, typestore=store)
            writer.write(connections[topic, kind], logged, store.serialize_cdr(content, kind))
    recording = read_recording(path)
    assert len(recording.views) == 10
    assert list(recording.skipped.values()) == [count]


def known_distribution() -> Any:
    from rosbags.typesys import Stores

    return Stores.ROS2_HUMBLE


def test_transforms_in_a_circle(tmp_path: Path) -> None:
    def change(message: BagMessage) -> BagMessage:
        if message.topic == "/tf_static":
            (first, second) = message.content.transforms
            first.header.frame_id, first.child_frame_id = "a", "b"
            second.header.frame_id, second.child_frame_id = "b", "a"
        return message

    path = write_rosbag2(tmp_path / "bag", DRIVE, SMALL, made_by=changed_by(change))
    told = refusal(path)
    assert "cycle" in told
    assert "valid is a tree" in told


def test_poses_without_numbers_are_counted(tmp_path: Path) -> None:
    def change(message: BagMessage) -> BagMessage:
        if message.topic == "/ground_truth" and message.logged < round((DRIVE.start + 0.5) * 1e9):
            message.content.pose.position.x = np.nan
        return message

    Unsure = changed_by(change)
    recording = read_recording(write_rosbag2(tmp_path / "bag", DRIVE, SMALL, made_by=Unsure))
    unsure = sum(one.sense is Sense.TRUTH and one.logged < DRIVE.start + 0.5 for one in DRIVE.moments)
    assert unsure > 1
    assert recording.skipped == {"geometry_msgs/msg/PoseStamped without a value": unsure}
    assert recording.views[0].truth is None
    assert recording.views[-3].truth is not None


def test_only_poses(tmp_path: Path) -> None:
    path = write_rosbag2(tmp_path / "bag", DRIVE, RosSetup(image_format=None, scans=False))
    told = refusal(path)
    assert told.startswith("bag: holds no view")
    assert "/odom" in told


def test_definitions_in_a_bag_are_not_executed(tmp_path: Path) -> None:
    """A name in a definition would become Python source in ``rosbags`` if it were given to it."""
    ran = tmp_path / "ran"
    attack = f"float64 x\nfloat64 __import__('pathlib').Path({str(ran)!r}).touch()\n"
    path = tmp_path / "bag"
    store = known_types(Serialization.CDR)
    with Rosbag2Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        for topic, kind in (("/scan", "sensor_msgs/msg/LaserScan"), ("/own", "own_msgs/msg/Own")):
            writer.add_connection(topic, kind, msgdef=attack, rihs01="RIHS01_" + "0" * 64)
        messages = RosMessages(DRIVE, SMALL, known_distribution())
        for topic, kind, logged, content in messages:
            if topic == "/scan":
                writer.write(writer.connections[0], logged, store.serialize_cdr(content, kind))
        writer.write(writer.connections[1], 1, b"\0\1\0\0")
    before = set(sys.modules)
    recording = read_recording(path)
    assert len(recording.views) == 10
    assert recording.skipped == {"own_msgs/msg/Own": 1}
    assert not ran.exists()
    assert "rosbags.usertypes" not in set(sys.modules) - before


def test_a_type_of_another_definition_is_passed_over_in_ros1(tmp_path: Path) -> None:
    path = tmp_path / "a.bag"
    store = known_types(Serialization.ROS1)
    definition, _ = store.generate_msgdef("sensor_msgs/msg/LaserScan")
    messages = RosMessages(DRIVE, RosSetup(), ros1())
    with Rosbag1Writer(path) as writer:
        connections: dict[str, Any] = {}
        for topic, kind, logged, content in messages:
            if topic not in connections:
                own = {"msgdef": definition, "md5sum": "0" * 32} if topic == "/scan" else {"typestore": messages.store}
                connections[topic] = writer.add_connection(topic, kind, **own)
            writer.write(connections[topic], logged, messages.store.serialize_ros1(content, kind))
    bag = RosBag(path)
    assert {channel.topic: channel.role for channel in bag.channels}["/scan"] is Role.IGNORED
    assert read_recording(path).skipped == {"sensor_msgs/msg/LaserScan": 10}


def ros1() -> Any:
    from rosbags.typesys import Stores

    return Stores.ROS1_NOETIC


@pytest.mark.parametrize("column", ["name", "type", "serialization_format"])
def test_a_topic_of_bytes_in_sqlite(tmp_path: Path, column: str) -> None:
    path = write_rosbag2(tmp_path / "bag", DRIVE, SMALL, StoragePlugin.SQLITE3)
    with sqlite3.connect(path / "bag.db3") as database:
        database.execute(f"UPDATE topics SET {column} = x'00ff' WHERE id = 1")
    database.close()
    assert "a topic has b'\\x00\\xff' where a text belongs" in refusal(path)
