"""The layout for Foxglove names topics and fields that are in the log, and settings that Foxglove's library knows."""

import json
import re
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from foxglove import layouts as fl
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory as ProtobufDecoder
from mcap_ros2.decoder import DecoderFactory as Ros2Decoder

from refseq.errors import LogError
from refseq.logs import open_log
from refseq.logs.formats import DriveFormat, output_format
from refseq.logs.foxglove.layout import foxglove_layout
from refseq.planar import Pose
from tests.refseq.logs.foreign import RosSetup, write_rosbag2
from tests.refseq.logs.robot_drive import RobotDrive
from tests.support import corridor_drive

CONFIGS = {"Image": fl.ImageConfig, "3D": fl.ThreeDeeConfig, "Plot": fl.PlotConfig}


@pytest.fixture(params=[DriveFormat.MCAP, DriveFormat.ROSBAG2])
def recording(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """A recording of ours of either format, with cameras of the bench's names."""
    path = tmp_path / "drive.mcap"
    with output_format(request.param).open(path, {}) as writer:
        for k, view in enumerate(corridor_drive(np.random.default_rng(1), 3, size=48)):
            writer.write(view, Pose(float(k), 0.0, 0.0))
    return path


def messages(path: Path) -> dict[str, Any]:
    """The last message of each topic, as libraries of others decode it."""
    file = path if path.is_file() else path / f"{path.name}.mcap"
    with file.open("rb") as opened:
        reader = make_reader(opened, decoder_factories=[ProtobufDecoder(), Ros2Decoder()])
        return {channel.topic: message for _, channel, _, message in reader.iter_decoded_messages()}


def panels_in(layout: Any) -> Iterator[str]:
    if isinstance(layout, str):
        yield layout
    else:
        assert layout["direction"] in ("row", "column")
        assert 0 < layout["splitPercentage"] < 100
        yield from panels_in(layout["first"])
        yield from panels_in(layout["second"])


def test_every_topic_and_field_is_in_the_recording(recording: Path) -> None:
    layout = json.loads(foxglove_layout(open_log(recording)))
    there = messages(recording)
    configs = layout["configById"]
    pictures = {one["imageMode"]["imageTopic"] for key, one in configs.items() if key.startswith("Image!")}
    assert len(pictures) == 2
    assert pictures | set(configs["3D!scene"]["topics"]) <= set(there)
    scans = [there[topic] for topic in configs["3D!scene"]["topics"]]
    assert [getattr(scan, "header", scan).frame_id for scan in scans] == [configs["3D!scene"]["followTf"]]
    paths = [series["value"] for series in configs["Plot!time"]["paths"]]
    paths += [series[key] for series in configs["Plot!way"]["paths"] for key in ("value", "xValuePath")]
    assert len(paths) == 8
    for path in paths:
        topic, _, names = path.partition(".")
        value = there[topic]
        for name in names.split("."):
            value = getattr(value, name)
        assert isinstance(value, float)


def test_the_panels_are_those_that_are_arranged(recording: Path) -> None:
    layout = json.loads(foxglove_layout(open_log(recording)))
    assert list(layout) == ["configById", "globalVariables", "userNodes", "playbackConfig", "layout"]
    assert sorted(panels_in(layout["layout"])) == sorted(layout["configById"])


def test_settings_are_known_to_foxglove(recording: Path) -> None:
    for key, config in json.loads(foxglove_layout(open_log(recording)))["configById"].items():
        known = {camel(field.name) for field in fields(CONFIGS[key.partition("!")[0]])}
        assert set(config) <= known, key


def camel(name: str) -> str:
    return re.sub("_(.)", lambda found: found[1].upper(), name)


def test_anothers_bag_has_a_layout_of_its_own_topics(tmp_path: Path) -> None:
    path = write_rosbag2(tmp_path / "bag", RobotDrive(seconds=0.5), RosSetup(truth=None))
    layout = json.loads(foxglove_layout(open_log(path)))
    assert layout["configById"]["Image!camera1"]["imageMode"] == {"imageTopic": "/camera/image_raw/compressed"}
    assert [series["value"] for series in layout["configById"]["Plot!way"]["paths"]] == ["/odom.pose.pose.position.y"]


def test_a_topic_of_other_letters_is_quoted(tmp_path: Path) -> None:
    class Renamed:
        def __init__(self, path: Path) -> None:
            self.path, source = path, open_log(path)
            self.channels = [
                type(one)("/my-odom", one.schema, one.encoding, one.count, one.role)
                for one in source.channels
                if one.topic == "/odom"
            ]

    path = write_rosbag2(tmp_path / "bag", RobotDrive(seconds=0.5))
    layout = json.loads(foxglove_layout(Renamed(path)))  # type: ignore[arg-type]
    assert layout["layout"]["first"] == "Plot!time"
    assert layout["configById"]["Plot!way"]["paths"][0]["value"] == '"/my-odom".pose.pose.position.y'


def test_nothing_to_show(tmp_path: Path) -> None:
    path = write_rosbag2(
        tmp_path / "bag", RobotDrive(seconds=0.5), RosSetup(image_format=None, scans=False, odometry=None, truth=None)
    )
    with pytest.raises(LogError, match="holds nothing to show; valid is a log with pictures, scans or poses"):
        foxglove_layout(open_log(path))
