"""Filmstrip of a drive, with what the robot tells of itself under each frame."""

import math

from matplotlib.figure import Figure

from refseq_bench.scenarios.report.contact_sheet import CaptionedImage, contact_sheet
from refseq_bench.scenarios.robot_checks.film import DriveFrame, FilmedDrive

SWING = 0.5
"""A pitch that changes by less than this [deg] is told as one."""


def filmstrip(strip: FilmedDrive, frames: list[DriveFrame]) -> Figure:
    """Draw the frames in rows, each with time, speed, pitch and stops."""
    title = f"{strip.robot} in {strip.world}, {strip.route}, {frames[-1].time:.0f} s"
    return contact_sheet(title, [CaptionedImage(frame.image, caption(frame)) for frame in frames])


def caption(frame: DriveFrame) -> str:
    """Caption of a frame; the pitch since the frame before in brackets, where it changed."""
    state = frame.state
    low, high = map(math.degrees, frame.pitches)
    swing = f" ({low:+.1f} to {high:+.1f})" if high - low > SWING else ""
    told = f"{frame.time:.0f} s   {state.twist.linear:+.2f} m/s   pitch {math.degrees(state.pitch):+.1f}°{swing}"
    stops = ", ".join(stop.cause.value for stop in state.stops)
    return f"{told}\n{stops}" if stops else told
