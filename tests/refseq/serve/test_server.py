"""A server as a process of its own, asked over its socket; answers are those of a localiser that reads the log."""

import asyncio
import os
import re
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
import types
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

import numpy as np
import pytest
from foxglove.messages import PoseInFrame
from mcap.records import Schema
from mcap_protobuf.decoder import DecoderFactory
from websockets.exceptions import ConnectionClosed, InvalidStatus

from refseq.access.policy import AccessPolicy
from refseq.belief import Belief, PoseBeside
from refseq.logs import RecordingWriter, read_recording
from refseq.logs.pairing.options import PairingOptions
from refseq.map.learning import learn
from refseq.map.localiser import Localiser
from refseq.map.map import Map
from refseq.serve.server import BeliefServer
from refseq.serve.session import RobotSession, ServeOptions
from tests.pages import ROOT, Page, pages
from tests.refseq.logs.foreign import RosMessages, RosSetup, Stores, write_rosbag2
from tests.refseq.logs.robot_drive import RobotDrive
from tests.refseq.serve.client import Robot, Sent, in_log
from tests.support import corridor_drive

COUNT = 12


class Serving(NamedTuple):
    """A server that runs: its process, its address with the token and without, its map and a recording for it."""

    process: subprocess.Popen[str]
    address: str
    map: Map
    query: Path

    @property
    def door(self) -> str:
        return self.address.rpartition("/")[0]


def started(folder: Path, *words: str) -> tuple[subprocess.Popen[str], str]:
    code = "import sys; from refseq_bench.scenarios.cli.app import main; sys.argv[0] = 'refseq'; main()"
    process = subprocess.Popen(
        [sys.executable, "-c", code, "serve", *words],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "1"},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout
    line = process.stdout.readline()
    found = re.fullmatch(r"map\.refseq: serves at (ws://127\.0\.0\.1:\d+/[0-9a-f]{32}); Ctrl-C ends it\n", line)
    assert found, line + (process.stderr.read() if process.stderr and process.poll() is not None else "")
    return process, found[1]


@pytest.fixture(scope="module")
def serving(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Serving]:
    folder = tmp_path_factory.mktemp("serve")
    rng = np.random.default_rng(0)
    map_ = learn(corridor_drive(rng, COUNT, size=120))
    map_.save(folder / "map.refseq")
    with RecordingWriter(folder / "query.mcap", {}) as writer:
        for view in corridor_drive(rng, COUNT, size=120):
            writer.write(replace(view, time=view.time + 100), view.truth)
    process, address = started(folder, "map.refseq", "--port", "0", "--distance", "0")
    yield Serving(process, address, map_, folder / "query.mcap")
    process.kill()
    process.communicate()


def check_equal(answers: Sequence[dict[str, Any]], beliefs: Sequence[Belief]) -> None:
    """All but timings, bit for bit."""
    told = [answer for answer in answers if "view" in answer]
    assert [answer["view"] for answer in told] == list(range(len(beliefs)))
    for answer, belief in zip(told, beliefs, strict=True):
        assert answer["places"] == belief.places.tolist()
        assert (answer["lost"], answer["best"], answer["entropy"]) == (belief.lost, belief.best, belief.entropy)
        assert answer["path"] == list(belief.path)
        assert (answer["lost_after"], answer["last_sure"]) == (belief.lost_after.tolist(), belief.last_sure)
        assert answer["beside"] == (belief.pose and told_of(belief.pose))
        assert [(mode["best"], mode["probability"]) for mode in answer["modes"]] == list(belief.modes)


def told_of(pose: PoseBeside) -> dict[str, Any]:
    covariance = [number for row in pose.covariance.tolist() for number in row]
    return {"along": pose.along, "aside": pose.aside, "heading": pose.heading, "covariance": covariance}


def offline(map_: Map, path: Path, options: PairingOptions | None = None, thin: float | None = None) -> list[Belief]:
    localiser = Localiser(map_, seed=1)
    return [localiser.update(view) for view in read_recording(path, options, thin=thin).views]


def test_answers_are_those_of_a_localiser_that_reads_the_log(serving: Serving) -> None:
    robot = Robot(serving.address)
    answers = robot.drive(in_log(serving.query))
    robot.close()
    check_equal(answers, offline(serving.map, serving.query))
    assert [answer["time"] for answer in answers if "view" in answer] == [100.0 + 2 * k for k in range(COUNT)]
    assert robot.notes[0].startswith("a drive begins: ")


def served_here(server: BeliefServer, talk: Callable[[str], None]) -> None:
    """Serve from this process, as a program would, until ``talk``, which is given the address, is over."""

    def connected(address: str) -> None:
        try:
            talk(address)
        finally:
            os.kill(os.getpid(), signal.SIGTERM)

    asyncio.run(server.run(lambda address: threading.Thread(target=connected, args=(address,)).start()))


def test_a_program_serves_a_map_itself_until_it_is_stopped(serving: Serving) -> None:
    answers: list[dict[str, Any]] = []
    codes: list[int | None] = []
    told: list[str] = []

    def talk(address: str) -> None:
        robot = Robot(address)
        answers.extend(robot.drive(in_log(serving.query), quiet=3.0))
        numbers = robot.advertise([("/scan", "protobuf", "foxglove.LaserScan")])
        robot.socket.send(struct.pack("<BI", 1, numbers["/scan"]))
        robot.socket.send(b"no frame at all")
        with suppress(ConnectionClosed):
            while True:
                robot.socket.recv(5)
        codes.append(robot.socket.close_code)

    server = BeliefServer(serving.map, ServeOptions(distance=0), AccessPolicy(port=0, token="t" * 32), told.append)
    served_here(server, talk)
    check_equal(answers, offline(serving.map, serving.query))
    assert (server.views, server.drives) == (COUNT, 1)
    assert codes == [1008]
    assert told


@pytest.mark.parametrize("broken", [("take",), ("take", "end")])
def test_a_fault_of_the_server_is_told_and_the_next_robot_is_served(
    serving: Serving, broken: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    told, codes, answers = list[str](), list[int | None](), list[dict[str, Any]]()

    def fails(*_: object) -> NoReturn:
        raise ValueError("planted")

    def talk(address: str) -> None:
        first = Robot(address)
        with monkeypatch.context() as patch:
            for name in broken:
                patch.setattr(RobotSession, name, fails)
            with suppress(ConnectionClosed):
                first.drive(in_log(serving.query), quiet=3.0)
            codes.append(first.socket.close_code)
            time.sleep(0.3)
        answers.extend(Robot(address).drive(in_log(serving.query), quiet=3.0))

    server = BeliefServer(serving.map, ServeOptions(distance=0), AccessPolicy(port=0, token="t" * 32), told.append)
    served_here(server, talk)
    assert codes == [1011]
    assert any("ValueError: planted" in line for line in told)
    check_equal(answers, offline(serving.map, serving.query))


@pytest.mark.slow
def test_a_program_serves_a_robot_that_speaks_as_ros_does(tmp_path: Path) -> None:
    drive, options = RobotDrive(seconds=6.0), PairingOptions(leading="camera", tolerance=0.04)
    setup = RosSetup(mounts=False, truth=None)
    views = read_recording(write_rosbag2(tmp_path / "bag", drive, setup), options, thin=0.85).views
    map_, answers = learn(views), []
    messages = RosMessages(drive, setup, Stores.ROS2_HUMBLE)
    sent = [
        Sent(one.topic, "cdr", one.type, bytes(messages.store.serialize_cdr(one.content, one.type))) for one in messages
    ]
    chosen = ServeOptions(distance=0.85, leading="camera", tolerance=0.04)
    server = BeliefServer(map_, chosen, AccessPolicy(port=0), lambda line: None)
    served_here(server, lambda address: answers.extend(Robot(address).drive(sent, quiet=3.0)))
    localiser = Localiser(map_, seed=1)
    told = [answer for answer in answers if "view" in answer]
    assert len(told) >= len(views) - 1, "the last waits for what comes behind it"
    check_equal(told, [localiser.update(view) for view in views][: len(told)])


def test_poses_are_those_of_the_best_places(serving: Serving) -> None:
    robot = Robot(serving.address)
    answers = robot.drive(in_log(serving.query))
    robot.close()
    (schema,) = (one for one in robot.channels if one["topic"] == "/belief_pose")
    known = PoseInFrame.get_schema()
    decode = DecoderFactory().decoder_for(
        schema["encoding"], Schema(id=1, name=known.name, encoding=known.encoding, data=known.data)
    )
    assert decode is not None
    poses = [decode(answer["pose_message"]) for answer in answers if "pose_message" in answer]
    told = [answer["pose"] for answer in answers if answer.get("pose")]
    assert [(one.pose.position.x, one.pose.position.y) for one in poses] == [(one["x"], one["y"]) for one in told]
    assert len(poses) > COUNT / 2
    assert {one.frame_id for one in poses} == {"map"}


def test_a_robot_that_returns_begins_anew(serving: Serving) -> None:
    messages = in_log(serving.query)
    half = Robot(serving.address)
    half.drive(messages[: len(messages) // 2], quiet=1.0)
    half.close()
    time.sleep(0.5)
    again = Robot(serving.address)
    answers = again.drive(messages)
    again.close()
    check_equal(answers, offline(serving.map, serving.query))


def test_a_clock_that_goes_back_begins_a_drive(serving: Serving) -> None:
    robot = Robot(serving.address)
    answers = robot.drive(2 * in_log(serving.query))
    robot.close()
    told = [answer for answer in answers if "view" in answer]
    check_equal(told[-COUNT:], offline(serving.map, serving.query))
    assert any("the stamp went back from 122.000 to 100.000 s; a new drive begins" in note for note in robot.notes)


def test_others_listen_and_a_second_robot_is_refused(serving: Serving) -> None:
    robot, listener, second = (Robot(serving.address) for _ in range(3))
    told = in_log(serving.query)
    robot.advertise([(told[0].topic, told[0].encoding, told[0].schema)])
    time.sleep(0.2)
    second.advertise([(told[0].topic, told[0].encoding, told[0].schema)])
    with pytest.raises(ConnectionClosed) as closed:
        list(second.received(10))
    assert closed.value.rcvd is not None
    assert (closed.value.rcvd.code, closed.value.rcvd.reason) == (
        1013, "a robot is connected already; valid is one at a time",
    )  # fmt: skip
    answers = robot.drive(told)
    assert list(listener.received(1)) == answers
    robot.close()
    listener.close()


@pytest.mark.parametrize(
    ("frame", "reason"),
    [
        ("{", "a frame is no control frame of the protocol"),
        ('{"op": "advertise", "channels": [{"id": -1}]}', "id is -1; valid is a whole number from 0"),
        ("[" * 50_000, "a frame is no control frame of the protocol"),
        (b"\x07abc", "a binary frame of 4 bytes begins with 07; valid is 01"),
        (struct.pack("<BI", 1, 0) + b"no json", "topic /scan: is no foxglove.LaserScan"),
        (struct.pack("<BI", 1, 0) + b'{"ranges": [1, 2]}', "no topic is a sensor of the map (topics: /scan"),
    ],
)
def test_what_is_wrong_is_told_and_ends_the_connection(serving: Serving, frame: str | bytes, reason: str) -> None:
    robot = Robot(serving.address)
    role = "foxglove.LaserScan" if "sensor of the map" not in reason else "foxglove.Odometry"
    robot.advertise([("/scan", "json", role)])
    robot.socket.send(frame)
    with pytest.raises(ConnectionClosed) as closed:
        list(robot.received(20))
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == 1008
    assert reason in robot.notes[-1]
    assert serving.process.poll() is None


def test_frames_that_do_nothing_are_told_once_to_who_sent_them(serving: Serving) -> None:
    robot = Robot(serving.address)
    for _ in range(2):
        robot.socket.send(struct.pack("<BI", 1, 5) + b"{}")
        robot.socket.send('{"op": "subscribe", "subscriptions": [{"id": 9, "channelId": 99}]}')
        robot.socket.send('{"op": "drive"}')
    list(robot.received(0.5))
    robot.close()
    assert robot.notes == [
        "channel 5: a message before channels are advertised is passed over",
        "subscription to channel 99: there is none; valid are 1 (/belief), 2 (/belief_pose)",
        'op "drive": is not served; valid are advertise, unadvertise, subscribe, unsubscribe',
    ]


def test_kinds_that_are_not_read_are_told(serving: Serving) -> None:
    robot = Robot(serving.address)
    robot.advertise([("/video", "protobuf", "foxglove.CompressedVideo"), ("/x", "cdr", "std_msgs/msg/String")])
    list(robot.received(1))
    robot.close()
    assert robot.notes[0].startswith("topic /video: foxglove.CompressedVideo in protobuf is passed over; valid are ")
    assert "sensor_msgs/msg/LaserScan" in robot.notes[1]


@pytest.mark.parametrize(
    ("headers", "reason"),
    [
        ({"Origin": "https://evil.example"}, "pages of https://evil.example are not let in"),
        ({"Host": "evil.example:8765"}, "the address is not this machine's"),
    ],
)
def test_no_page_gets_in_even_with_the_token(serving: Serving, headers: dict[str, str], reason: str) -> None:
    assert reason in refused(serving, "/" + serving.address.rpartition("/")[2], headers)


@pytest.mark.parametrize("path", ["", "/guess"])
def test_no_program_gets_in_without_the_token(serving: Serving, path: str) -> None:
    assert "the token of the address is missing or wrong" in refused(serving, path, {})


def refused(serving: Serving, path: str, headers: dict[str, str]) -> str:
    """The answer to a handshake that is refused."""
    host = serving.door.removeprefix("ws://")
    words = {"Host": host, **headers}
    asked = "".join(f"{name}: {value}\r\n" for name, value in words.items())
    with socket.create_connection((host.split(":")[0], int(host.split(":")[1])), timeout=20) as line:
        upgrade = "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
        key = "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n"
        line.sendall(f"GET {path or '/'} HTTP/1.1\r\n{asked}{upgrade}{key}\r\n".encode())
        answer = line.makefile().read()
    assert answer.startswith("HTTP/1.1 403 ")
    return answer


def test_the_token_is_in_the_address_or_a_header(serving: Serving) -> None:
    Robot(serving.door, additional_headers={"Authorization": f"Bearer {serving.address[-32:]}"}).close()
    with pytest.raises(InvalidStatus):
        Robot(serving.door)


def page() -> Page:
    return next(one for one in pages() if one.name == "docs/serve.md")


def example(name: str) -> str:
    (found,) = (one for one in page().examples if one.told == name)
    return found.code


def test_the_client_of_the_page_localises(serving: Serving) -> None:
    """With the laser alone, in JSON."""
    made = types.ModuleType("robot")
    exec(compile(example("robot.py"), "robot.py", "exec"), made.__dict__)
    views = read_recording(serving.query).views

    def messages() -> Iterator[tuple[int, dict[str, Any]]]:
        for view in views:
            stamp = {"sec": int(view.time), "nsec": 0}
            assert view.scan is not None
            end = view.scan.start + view.scan.step * (len(view.scan.ranges) - 1)
            pose = {"position": {"x": 0.85 * (view.time - 100) / 2, "y": 0, "z": 0}}
            turn = {"orientation": {"x": 0, "y": 0, "z": 0, "w": 1}}
            scan = {"start_angle": view.scan.start, "end_angle": end, "ranges": view.scan.ranges.tolist()}
            yield 1, {"timestamp": stamp, "frame_id": "laser", **scan}
            yield 2, {"timestamp": stamp, "frame_id": "odom", "body_frame_id": "robot", "pose": pose | turn}

    answers = list(made.beliefs(serving.address, messages()))
    assert [answer["view"] for answer in answers] == list(range(COUNT))
    assert [answer["distance"] for answer in answers] == pytest.approx([0.0] + [0.85] * (COUNT - 1))
    assert {tuple(answer["sensors"]) for answer in answers} == {("laser",)}


class EnoughError(Exception):
    """The stand-in for ROS has had as many poses as it waited for."""


def stand_ins(sent: Sequence[Sent], poses: list[tuple[float, float]], wanted: int) -> dict[str, types.ModuleType]:
    """Modules as the page's node imports them: spinning hands the messages on as bytes, publishing keeps the pose."""

    def module(name: str, **content: object) -> types.ModuleType:
        made = types.ModuleType(name)
        made.__dict__.update(content)
        return made

    def kind(name: str, package: str) -> type:
        return type(name, (), {"__module__": f"{package}.msg._x"})

    class Pose(types.SimpleNamespace):
        def __init__(self) -> None:
            position = types.SimpleNamespace()
            super().__init__(header=types.SimpleNamespace(), pose=types.SimpleNamespace(position=position))

    class Node:
        def __init__(self) -> None:
            self.told: dict[str, Callable[[bytes], None]] = {}

        def create_publisher(self, *_: object) -> "Node":
            return self

        def create_subscription(
            self, _: type, topic: str, told: Callable[[bytes], None], qos: object, *, raw: bool
        ) -> None:
            assert raw
            self.told[topic] = told

        def publish(self, message: Any) -> None:
            assert message.header.frame_id == "map"
            poses.append((message.pose.position.x, message.pose.position.y))
            if len(poses) == wanted:
                raise EnoughError

    def spin(node: Node) -> None:
        with suppress(ConnectionClosed):
            for one in sent:
                node.told[one.topic](one.data)

    sensors = {name: kind(name, "sensor_msgs") for name in ("CompressedImage", "LaserScan")}
    return {
        "rclpy": module("rclpy", init=lambda: None, create_node=lambda name: Node(), spin=spin),
        "rclpy.qos": module("rclpy.qos", qos_profile_sensor_data=object()),
        "geometry_msgs.msg": module("geometry_msgs.msg", PoseStamped=Pose),
        "nav_msgs.msg": module("nav_msgs.msg", Odometry=kind("Odometry", "nav_msgs")),
        "sensor_msgs.msg": module("sensor_msgs.msg", **sensors),
    }


def test_a_ros_2_robot_is_answered_as_its_bag(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Bytes that `rosbags` serialised, each sensor at its own rate; then the same by the node of the page."""
    drive = RobotDrive(seconds=12.0)
    bag = write_rosbag2(tmp_path / "bag", drive, RosSetup(mounts=False, truth=None))
    options = PairingOptions(leading="camera", tolerance=0.04)
    views = read_recording(bag, options, thin=0.85).views
    map_ = learn(views)
    map_.save(tmp_path / "map.refseq")
    sensors = ["--leading", "camera", "--tolerance", "0.04", "--distance", "0.85"]
    process, address = started(tmp_path, "map.refseq", "--port", "0", *sensors)
    try:
        messages = RosMessages(drive, RosSetup(mounts=False, truth=None), Stores.ROS2_HUMBLE)
        sent = [
            Sent(one.topic, "cdr", one.type, bytes(messages.store.serialize_cdr(one.content, one.type)))
            for one in messages
        ]
        robot = Robot(address)
        answers = robot.drive(sent)
        robot.close()
        localiser = Localiser(map_, seed=1)
        beliefs = [localiser.update(view) for view in views]
        told = [answer for answer in answers if "view" in answer]
        assert len(told) >= len(beliefs) - 1, "the last waits for what comes behind it"
        check_equal(told, beliefs[: len(told)])
        known = [(one["pose"]["x"], one["pose"]["y"]) for one in told if one["pose"]]
        assert len(known) > len(told) / 2
        poses: list[tuple[float, float]] = []
        for name, module in stand_ins(sent, poses, len(known)).items():
            monkeypatch.setitem(sys.modules, name, module)
        code = example("belief_node.py").replace("/front/image_raw/compressed", "/camera/image_raw/compressed")
        node: dict[str, Any] = {"__name__": "belief_node"}
        exec(compile(code, "belief_node.py", "exec"), node)
        with pytest.raises(EnoughError):
            node["main"](address)
        assert poses == known
    finally:
        process.send_signal(signal.SIGTERM)
        said = process.communicate(timeout=30)[0]
    assert re.fullmatch(r"map\.refseq: served \d+ views of 2 drives\n", said)


def test_ctrl_c_ends_it_within_a_second_though_a_robot_is_there(serving: Serving) -> None:
    """The last one: the server is gone then."""
    robot = Robot(serving.address)
    robot.advertise([("/laser", "json", "foxglove.LaserScan")])
    time.sleep(0.2)
    begin = time.monotonic()
    serving.process.send_signal(signal.SIGINT)
    said, _ = serving.process.communicate(timeout=30)
    assert time.monotonic() - begin < 5  # a second on a machine that is not busy
    assert serving.process.returncode == 0
    assert re.fullmatch(r"map\.refseq: served \d+ views? of \d+ drives?\n", said)
    with pytest.raises(ConnectionClosed):
        list(robot.received(5))
