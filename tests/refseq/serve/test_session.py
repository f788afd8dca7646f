"""A robot's drive without a socket: answers are those of a localiser that reads the log."""

import json
import math
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from foxglove.messages import LaserScan, Timestamp

from refseq.belief import Belief
from refseq.errors import RefseqError
from refseq.logs import RecordingWriter, read_recording
from refseq.map.learning import learn
from refseq.map.localiser import Localiser
from refseq.map.map import Map
from refseq.planar import Pose
from refseq.serve.answers import BeliefAnswer
from refseq.serve.channels import robot_channel
from refseq.serve.protocol import MOST_CHANNELS, ClientChannel, FoxgloveProtocolError
from refseq.serve.session import TOO_FAST, RobotSession, ServeOptions, spacing
from tests.refseq.serve.client import Sent, in_log
from tests.support import corridor_drive

COUNT = 6
EACH = ServeOptions(distance=0)


@pytest.fixture(scope="module")
def map_() -> Map:
    return learn(corridor_drive(np.random.default_rng(0), COUNT, size=120))


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("session") / "query.mcap"
    with RecordingWriter(path, {}) as writer:
        for view in corridor_drive(np.random.default_rng(1), COUNT, size=120):
            writer.write(replace(view, time=view.time + 100), view.truth)
    return path


@pytest.fixture(scope="module")
def true(map_: Map, log: Path) -> list[Belief]:
    localiser = Localiser(map_, seed=1)
    return [localiser.update(view) for view in read_recording(log).views]


def told_of(session: RobotSession, messages: Iterable[Sent]) -> dict[str, int]:
    """Tell a session of the channels of messages; gives their numbers."""
    channels = dict.fromkeys((one.topic, one.encoding, one.schema) for one in messages)
    session.advertise(ClientChannel(number, *channel) for number, channel in enumerate(channels))
    return {topic: number for number, (topic, _, _) in enumerate(channels)}


def answered(session: RobotSession, numbers: dict[str, int], messages: Iterable[Sent]) -> Iterator[BeliefAnswer]:
    for one in messages:
        yield from session.take(numbers[one.topic], one.data)


def same(answers: Iterable[BeliefAnswer], beliefs: Iterable[Belief]) -> bool:
    """Bit for bit, but for timings."""
    return [(one.belief.places.tolist(), one.belief.lost, one.belief.best) for one in answers] == [
        (one.places.tolist(), one.lost, one.best) for one in beliefs
    ]


def test_beliefs_are_those_on_the_log_s_views(map_: Map, log: Path, true: list[Belief]) -> None:
    session, messages = RobotSession(map_, EACH), in_log(log)
    numbers = told_of(session, messages)
    answers = [*answered(session, numbers, messages), *session.end()]
    assert same(answers, true)
    assert [one.number for one in answers] == list(range(COUNT))
    assert session.views == COUNT
    assert [note.partition(":")[0] for note in session.told()] == ["a drive begins"]
    assert session.told() == []


def test_odometry_whose_rotation_is_nothing_but_zeros_is_told_once(map_: Map, log: Path) -> None:
    session = RobotSession(map_, EACH)
    channels = (("/odom", "json", "foxglove.Odometry"), ("/laser", "json", "foxglove.LaserScan"))
    session.advertise(ClientChannel(number, *channel) for number, channel in enumerate(channels))
    for _ in range(3):
        assert session.take(0, b'{"pose": {"position": {"x": 1.0}, "orientation": {"w": 0.0}}}') == []
    begun, told = session.told()
    assert begun.startswith("a drive begins: ")
    assert told.startswith("topic /odom: a message tells nothing")


@pytest.mark.parametrize("hurt", [2, COUNT - 1])
def test_a_view_is_without_a_picture_that_is_damaged_and_it_is_told_once(map_: Map, log: Path, hurt: int) -> None:
    """Also of the last view, which no other follows."""
    session, messages = RobotSession(map_, EACH), in_log(log)
    numbers = told_of(session, messages)
    camera = next(one.topic for one in messages if one.schema == "foxglove.CompressedImage")
    at = [n for n, one in enumerate(messages) if one.topic == camera][hurt]
    messages[at] = messages[at]._replace(data=messages[at].data.replace(b"IDAT", b"IDAX"))
    answers = [*answered(session, numbers, messages), *session.end()]
    assert len(answers) == COUNT
    _, lost = session.told()
    assert lost.startswith(f"topic {camera}: an image cannot be decoded")
    assert lost.endswith("; a view is without its picture")


def test_a_camera_that_stops_and_a_clock_that_stands_still_are_told_once(map_: Map, log: Path) -> None:
    session, messages = RobotSession(map_, EACH), in_log(log)
    numbers = told_of(session, messages)
    cameras = [one for one in messages if one.schema == "foxglove.CompressedImage"]
    stopped = cameras[-1].topic
    first = next(number for number, one in enumerate(messages) if one.topic == stopped)
    list(answered(session, numbers, [one for n, one in enumerate(messages) if one.topic != stopped or n == first]))
    list(answered(session, numbers, [messages[-1]] * 8))
    _, silent, standing = session.told()
    assert silent.startswith(f"topic {stopped}: silent for ")
    assert silent.endswith(" s; it is not waited for until it sends again")
    assert standing.startswith(f"topic {messages[-1].topic}: 5 messages in a row have the stamp 110.000 s; ")


def test_each_silence_of_a_camera_is_told_and_its_end(map_: Map, tmp_path: Path) -> None:
    """Not the first alone, though both are told when they have lasted as long."""
    with RecordingWriter(tmp_path / "query.mcap", {}) as writer:
        for number, view in enumerate(corridor_drive(np.random.default_rng(1), 40, size=120)):
            out = 10 <= number < 18 or 25 <= number < 33
            images = {name: image for name, image in view.images.items() if not (out and name == "lateral")}
            writer.write(replace(view, time=view.time + 100, images=images), view.truth)
    session, messages = RobotSession(map_, EACH), in_log(tmp_path / "query.mcap")
    numbers = told_of(session, messages)
    list(answered(session, numbers, messages))
    camera = next(one.topic for one in messages if "lateral" in one.topic)
    gone = f"topic {camera}: silent for 10 s; it is not waited for until it sends again"
    assert session.told()[1:] == 2 * [gone, f"topic {camera}: sends again, and is waited for"]


def test_a_clock_that_goes_back_begins_a_drive_that_knows_nothing_of_the_last(
    map_: Map, log: Path, true: list[Belief]
) -> None:
    session, messages = RobotSession(map_, EACH), in_log(log)
    numbers = told_of(session, messages)
    first = list(answered(session, numbers, messages))
    session.told()
    again = [*answered(session, numbers, messages), *session.end()]
    assert 0 < len(first) <= COUNT
    assert same(again, true)
    back, begun = session.told()
    assert back.endswith("; a new drive begins")
    assert begun.startswith("a drive begins: ")


def test_nothing_comes_of_a_drive_that_has_not_begun(map_: Map) -> None:
    session = RobotSession(map_, EACH)
    assert session.end() == []
    for _ in range(2):
        assert session.take(7, b"of a channel that nobody told of") == []
    assert session.told() == ["channel 7: it is not advertised; what comes on it is passed over"]


def test_channels_of_other_kinds_and_late_ones_are_told_and_the_forgotten_are_passed_over(map_: Map, log: Path) -> None:
    session, messages = RobotSession(map_, EACH), in_log(log)
    session.advertise([ClientChannel(90, "/map", "protobuf", "foxglove.Grid")])
    (note,) = session.told()
    assert note.startswith("topic /map: foxglove.Grid in protobuf is passed over; valid are ")
    numbers = told_of(session, messages)
    list(answered(session, numbers, messages[:1]))
    session.told()
    session.advertise([ClientChannel(91, "/late", "json", "foxglove.LaserScan")])
    assert session.told() == ["topic /late: told of after the first message; it is used in the next drive"]
    session.unadvertise([*numbers.values(), 4711])
    assert list(answered(session, numbers, messages)) == []
    assert session.end() == []


def test_a_number_that_is_advertised_anew_as_what_is_not_read_is_passed_over_until_it_is_read_again(map_: Map) -> None:
    session = RobotSession(map_, EACH)
    read = ClientChannel(1, "/scan", "protobuf", "foxglove.LaserScan")
    session.advertise([read, ClientChannel(1, "/map", "protobuf", "foxglove.Grid")])
    assert session.take(1, b"of a kind that is not read") == []
    session.told()
    session.advertise([read])
    session.unadvertise([1])
    assert session.take(1, b"of a channel that is gone") == []
    assert session.told() == ["channel 1: it is not advertised; what comes on it is passed over"]


def test_a_number_and_a_topic_that_are_advertised_twice_are_told(map_: Map) -> None:
    session = RobotSession(map_, EACH)
    session.advertise(ClientChannel(1, topic, "json", "foxglove.LaserScan") for topic in ("/a", "/a", "/b"))
    session.advertise([ClientChannel(2, "/b", "json", "foxglove.LaserScan")])
    assert session.told() == [
        "channel 1: advertised as /a, and now as /b, which counts",
        "topic /b: channels 1 and 2 are both of it; both are read",
    ]


def test_channels_are_bounded_over_all_frames(map_: Map) -> None:
    session = RobotSession(map_, EACH)
    many = [ClientChannel(number, f"/{number}", "json", "foxglove.LaserScan") for number in range(MOST_CHANNELS + 1)]
    for channel in many[:-1]:
        session.advertise([channel])
    session.advertise(many[:3])  # told of again
    with pytest.raises(FoxgloveProtocolError, match=f"more than {MOST_CHANNELS} channels"):
        session.advertise(many[-1:])
    session.unadvertise([0])
    session.advertise(many[-1:])


@pytest.mark.parametrize("encoding", ["protobuf", "json", "cdr"])
def test_bytes_that_are_no_such_message_are_told_with_their_topic(map_: Map, encoding: str) -> None:
    session = RobotSession(map_, EACH)
    schema = "sensor_msgs/msg/LaserScan" if encoding == "cdr" else "foxglove.LaserScan"
    session.advertise([ClientChannel(1, "/scan", encoding, schema)])
    with pytest.raises(FoxgloveProtocolError, match="/scan"):
        session.take(1, b"\xff\xff\xff")


@pytest.mark.parametrize("ranges", [{}, {"range": [1.0, 2.0]}, {"ranges": []}])
def test_a_scan_without_ranges_is_told(map_: Map, ranges: dict[str, list[float]]) -> None:
    session = RobotSession(map_, EACH)
    session.advertise([ClientChannel(1, "/scan", "json", "foxglove.LaserScan")])
    scan = {"timestamp": {"sec": 1, "nsec": 0}, "frame_id": "", "start_angle": -1.0, "end_angle": 1.0, **ranges}
    with pytest.raises(FoxgloveProtocolError, match="topic /scan: a scan has no ranges; valid is a list of them"):
        session.take(1, json.dumps(scan).encode())


@pytest.mark.parametrize("nothing", ["Infinity", math.inf, math.nan, None, 0])
def test_a_beam_from_nowhere_can_be_told_in_json(map_: Map, nothing: object) -> None:
    session = RobotSession(map_, EACH)
    session.advertise([ClientChannel(1, "/scan", "json", "foxglove.LaserScan")])
    scan = {"timestamp": {"sec": 1, "nsec": 0}, "frame_id": "", "start_angle": -1.0, "end_angle": 1.0}
    assert session.take(1, json.dumps({**scan, "ranges": [1.0, nothing, 2.0]}).encode()) == []


def test_a_scan_in_json_is_read_as_one_in_protobuf(log: Path, true: list[Belief]) -> None:
    """A robot with a laser alone: scans are written anew as JSON, by a simulated clock, which begins at zero."""
    views = [replace(view, images={}) for view in read_recording(log).views]
    laser = learn(views)
    session = RobotSession(laser, EACH)
    session.advertise([ClientChannel(1, "/scan", "json", "foxglove.LaserScan")])
    answers = []
    for view in views:
        assert view.scan is not None
        content = {
            "timestamp": {"sec": int(view.time) - 100, "nsec": round(view.time % 1 * 1e9)},
            "frame_id": "",
            "start_angle": float(-np.pi / 2),
            "end_angle": float(np.pi / 2),
            "ranges": [float(one) for one in view.scan.ranges],
            "intensities": [],
        }
        answers += session.take(1, json.dumps(content).encode())
    answers += session.end()
    localiser, alone = Localiser(laser, seed=1), {"distance": 0.0, "turn": 0.0, "has_odometry": False}
    beliefs = [localiser.update(replace(view, **alone)) for view in views]  # type: ignore[arg-type]
    assert same(answers, beliefs)


@pytest.mark.parametrize("encoding", ["json", "protobuf"])
@pytest.mark.parametrize("begin", [0.0, None])
def test_zero_is_a_stamp_and_a_message_without_one_gets_the_time_of_its_arrival(
    encoding: str, begin: float | None
) -> None:
    channel = robot_channel(ClientChannel(1, "/scan", encoding, "foxglove.LaserScan"))
    if encoding == "json":
        stamp = {} if begin is None else {"timestamp": {"sec": 0, "nsec": 0}}
        data = json.dumps({**stamp, "end_angle": 0.5, "ranges": [1.0, 2.0]}).encode()
    else:
        own = None if begin is None else Timestamp(sec=0, nsec=0)
        data = LaserScan(timestamp=own, end_angle=0.5, ranges=[1.0, 2.0]).encode()
    sample = channel.read(data, 7_000_000_000)
    assert sample is not None
    assert (sample.time, sample.unstamped) == ((7.0, True) if begin is None else (0.0, False))


@pytest.mark.parametrize("name", ["distance", "tolerance"])
@pytest.mark.parametrize("value", [-0.1, float("inf"), float("nan")])
def test_settings_that_are_none_are_told(name: str, value: float) -> None:
    with pytest.raises(RefseqError) as caught:
        ServeOptions(**{name: value})  # type: ignore[arg-type]
    assert str(caught.value) == f"{name} {value:g} is not valid; valid is a number of 0 or more"


def test_a_leading_sensor_is_one_of_the_map_or_named(map_: Map) -> None:
    with pytest.raises(RefseqError) as caught:
        RobotSession(map_, ServeOptions(leading="sonar"))
    assert str(caught.value) == "leading sensor 'sonar' is none of the map; valid are forward, laser, lateral"
    RobotSession(map_, ServeOptions(leading="laser"))
    RobotSession(map_, ServeOptions(leading="/scan", names={"/scan": "laser"}))


def test_views_are_as_far_apart_as_the_map_s_places(map_: Map) -> None:
    assert spacing(map_) == pytest.approx(0.85)
    wider = [
        replace(view, distance=2 * view.distance) for view in corridor_drive(np.random.default_rng(0), 3, size=120)
    ]
    assert spacing(learn(wider)) == pytest.approx(1.7)


def test_views_are_as_far_apart_as_places_that_the_robot_drove_to_however_long_it_stood() -> None:
    stood = [
        replace(view, time=view.time + 0.1 * again, distance=view.distance * (again == 0))
        for view in corridor_drive(np.random.default_rng(0), 3, size=120)
        for again in range(3)
    ]
    assert spacing(learn(stood)) == pytest.approx(0.85)


def test_a_topic_is_named_as_a_sensor_of_the_map(map_: Map) -> None:
    with pytest.raises(RefseqError) as caught:
        RobotSession(map_, ServeOptions(names={"/scan": "lazer"}))
    assert str(caught.value) == "topic /scan: 'lazer' is no sensor of the map; valid are forward, laser, lateral"


def test_an_odometer_in_millimetres_is_asked_about_once(map_: Map, tmp_path: Path) -> None:
    with RecordingWriter(tmp_path / "fast.mcap", {}) as writer:
        for k, view in enumerate(corridor_drive(np.random.default_rng(2), count=6, size=96)):
            writer.write(replace(view, images={}), Pose(850.0 * k, 0.0, 0.0))
    session, messages = RobotSession(map_, EACH), in_log(tmp_path / "fast.mcap")
    numbers = told_of(session, messages)
    assert len([*answered(session, numbers, messages), *session.end()]) > 1
    assert [note for note in session.told() if note == TOO_FAST] == [TOO_FAST]
