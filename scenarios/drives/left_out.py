"""Views that a drive lacks, as their pictures are damaged: told of it, and refused where they are counted."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from refseq_bench.scenarios.errors import ScenarioError

if TYPE_CHECKING:
    from refseq.logs import Recording

LEFT_OUT = "left_out"
"""Note of a drive some of whose views are gone with their damaged pictures, and of a map that is learnt from it."""


def views_left_out(drive: "Recording") -> dict[str, str]:
    """Note of the views left out; none where all are there, as those are that another sensor has seen."""
    if not (found := drive.findings):
        return {}
    damaged = {sensor: (len(those), those[0]) for sensor, those in found.damaged.items() if those}
    for topic, lost in found.unreadable.items():
        if sensor := found.sensors.get(topic):
            count, first = damaged.get(sensor, (0, lost.first.place))
            damaged[sensor] = count + lost.count, first
    told = [f"{sensor}: {count}, the first {first}" for sensor, (count, first) in damaged.items()]
    return {LEFT_OUT: told[0]} if len(found.damaged) == len(told) == 1 else {}


def check_all_views(metadata: Mapping[str, str], path: Path) -> None:
    """Raise ``ScenarioError`` where views were left out: the right answers are numbers of pictures."""
    if told := metadata.get(LEFT_OUT):
        raise ScenarioError(
            f"{path}: damaged pictures are left out ({told}), and the ground truth counts all; valid are whole ones"
        )
