"""Filmstrip of a mission as a bystander sees it, with what the robot is doing under each frame."""

from collections.abc import Sequence

from matplotlib.figure import Figure

from refseq_bench.scenarios.missions.bystander import MissionFrame
from refseq_bench.scenarios.report.contact_sheet import CaptionedImage, contact_sheet


def filmstrip_of(frames: Sequence[MissionFrame], title: str) -> Figure:
    """Put the frames on a contact sheet."""
    return contact_sheet(
        title, [CaptionedImage(one.image, f"{one.time:.0f} s, {one.along:.1f} m: {one.doing}") for one in frames]
    )
