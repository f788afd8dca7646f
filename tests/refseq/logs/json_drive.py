"""A short drive in Foxglove's JSON, of which single messages can be others."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mcap.writer import Writer

VIEWS = 12
START = 1_700_000_000


def scan_at(second: int) -> dict[str, Any]:
    return {
        "timestamp": {"sec": START + second, "nsec": 0},
        "frame_id": "laser",
        "start_angle": -1.0,
        "end_angle": 1.0,
        "ranges": [2.0, 3.0, 4.0],
    }


def pose_at(second: int) -> dict[str, Any]:
    return {"timestamp": {"sec": START + second, "nsec": 0}, "pose": {"position": {"x": 0.5 * second}}}


def write_json(
    path: Path,
    *,
    scan: dict[int, object] | None = None,
    odometry: dict[int, object] | None = None,
) -> Path:
    """A laser and its odometry in JSON, once a second; some messages by their numbers are others."""
    unit = {"orientation": {"w": 1.0}}
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="", library="")
        ids = {
            topic: writer.register_channel(
                topic, "json", writer.register_schema(f"foxglove.{kind}", "jsonschema", b"{}")
            )
            for topic, kind in (("/scan", "LaserScan"), ("/odom", "Odometry"))
        }
        for second in range(VIEWS):
            pose = pose_at(second)
            pose["pose"] |= unit
            told = {"/scan": (scan or {}).get(second, scan_at(second)), "/odom": (odometry or {}).get(second, pose)}
            for topic, message in told.items():
                data = message if isinstance(message, bytes) else json.dumps(message).encode()
                time = (START + second) * 1_000_000_000
                writer.add_message(ids[topic], time, data, time)
        writer.finish()
    return path


def every(made: Callable[[int], object]) -> dict[int, object]:
    return {second: made(second) for second in range(VIEWS)}
