"""Layout for Foxglove that opens a log: its pictures, its scans in 3D, odometry and truth over time and as a way.

The panels' settings are made by Foxglove's own library; the file has the form in which Foxglove exports layouts and
imports them again.
"""

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from foxglove import layouts as fl

from refseq.errors import LogError
from refseq.logs.source import Channel, LogSource, Role

MOST_PICTURES = 4
"""Cameras beyond these get no panel; more would leave none of them large enough to see something."""
COLOURS = {Role.ODOMETRY: "#e8a33d", Role.TRUTH: "#3d8ee8"}
POSITIONS = {
    "foxglove.Odometry": "pose.position",
    "foxglove.PoseInFrame": "pose.position",
    "nav_msgs/msg/Odometry": "pose.pose.position",
    "geometry_msgs/msg/PoseStamped": "pose.position",
    "geometry_msgs/msg/PoseWithCovarianceStamped": "pose.pose.position",
    "geometry_msgs/msg/TransformStamped": "transform.translation",
}
"""Where the position is in a message of poses, by its type."""


@dataclass(frozen=True, slots=True)
class _Panel:
    """A panel: its identifier, which begins with its type, and its settings."""

    id: str
    config: Any


@dataclass(frozen=True, slots=True)
class _PoseTopic:
    """A topic of poses that can be plotted."""

    topic: str
    role: Role
    position: str

    def path(self, axis: str) -> str:
        """The path to a coordinate, as Foxglove writes it."""
        plain = all(letter.isalnum() or letter in "_/" for letter in self.topic)
        topic = self.topic if plain else json.dumps(self.topic)
        return f"{topic}.{self.position}.{axis}"


def foxglove_layout(source: LogSource) -> str:
    """The layout for a log as JSON. Raises ``LogError`` for a log without a topic that can be shown."""
    channels = [channel for channel in source.channels if channel.count]
    columns = [[*_pictures(channels)], [*_scene(source, channels), *_plots(channels)]]
    columns = [column for column in columns if column]
    if not columns:
        raise LogError(f"{source.path}: holds nothing to show; valid is a log with pictures, scans or poses")
    layout = {
        "configById": {panel.id: json.loads(panel.config.to_json()) for column in columns for panel in column},
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": _split([_split([panel.id for panel in column], "column") for column in columns], "row"),
    }
    return json.dumps(layout, indent=2, ensure_ascii=False) + "\n"


def _split(parts: Sequence[Any], direction: str) -> Any:
    """Parts beside or above each other, all of one size; a layout is a tree of pairs."""
    first, *others = parts
    if not others:
        return first
    share = 100 / len(parts)
    return {"direction": direction, "first": first, "second": _split(others, direction), "splitPercentage": share}


def _pictures(channels: Sequence[Channel]) -> Iterator[_Panel]:
    cameras = [channel.topic for channel in channels if channel.role is Role.CAMERA]
    for number, topic in enumerate(cameras[:MOST_PICTURES], 1):
        mode = fl.ImageModeConfig(image_topic=topic)
        yield _Panel(f"Image!camera{number}", fl.ImageConfig(image_mode=mode))


def _scene(source: LogSource, channels: Sequence[Channel]) -> Iterator[_Panel]:
    """Scans around the robot; what has a transform to the scans' frame is drawn with them."""
    lasers = [channel.topic for channel in channels if channel.role is Role.LASER]
    if not lasers:
        return
    first = next(iter(source.samples(lasers)), None)
    points = fl.BaseRendererLaserScanTopicSettings(visible=True, point_size=4, color_mode="flat", flat_color="#e8503d")
    config = fl.ThreeDeeConfig(
        camera_state=fl.ThreeDeeCameraState(distance=20, perspective=True, phi=45, theta_offset=90),
        follow_tf=first.frame if first else None,
        follow_mode="follow-pose",
        topics=dict.fromkeys(lasers, points),
        layers={"grid": fl.BaseRendererGridLayerSettings(instance_id="grid", visible=True, size=20, divisions=20)},
    )
    yield _Panel("3D!scene", config)


def _plots(channels: Sequence[Channel]) -> Iterator[_Panel]:
    topics = [
        _PoseTopic(channel.topic, channel.role, POSITIONS[channel.schema])
        for channel in channels
        if channel.role in COLOURS and channel.schema in POSITIONS
    ]
    if topics:
        yield _Panel("Plot!time", _over_time(topics))
        yield _Panel("Plot!way", _way(topics))


def _over_time(topics: Sequence[_PoseTopic]) -> Any:
    series = [
        fl.PlotSeries(
            value=topic.path(axis), enabled=True, label=f"{topic.topic} {axis} [m]", timestamp_method="receiveTime"
        )
        for topic in topics
        for axis in ("x", "y")
    ]
    return fl.PlotConfig(paths=series, show_legend=True, legend_display="floating", is_synced=True)


def _way(topics: Sequence[_PoseTopic]) -> Any:
    """Seen from above, both axes of one scale."""
    series = [
        fl.PlotSeries(
            value=topic.path("y"),
            x_value_path=topic.path("x"),
            enabled=True,
            label=f"{topic.topic} [m]",
            color=COLOURS[topic.role],
            timestamp_method="receiveTime",
        )
        for topic in topics
    ]
    return fl.PlotConfig(
        paths=series,
        x_axis_val="custom",
        x_axis_path=fl.PlotXAxisPath(value=topics[0].path("x"), enabled=True),
        axis_scales_mode="lockedScales",
        show_legend=True,
        legend_display="floating",
    )
