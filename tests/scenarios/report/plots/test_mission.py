"""The plan of a mission, read back from its SVG and its legend."""

from collections.abc import Sequence

import numpy as np
import pytest

from refseq.missions.log import Touch
from refseq_bench.scenarios.report.plots.mission import mission_plan
from refseq_bench.scenarios.report.plots.style import FAULTY
from refseq_bench.scenarios.scoring.missions import MissionRun, score_mission

TRACK = np.stack([np.arange(11.0), 0.5 * np.arange(11.0), *np.zeros((2, 11)), 0.5 * np.arange(11.0)], axis=1)


def plan(touches: Sequence[Touch]) -> tuple[list[str], int]:
    """The labels of the legend, and the number of marks in the colour of what is wrong."""
    run = MissionRun(True, "", TRACK, (), (), (), (5.0, 0.0), 5.0, 10.0, 10.0, touches=tuple(touches))
    drawn = mission_plan(run, score_mission(run, 1.5, 0.5), 1.5, None)
    marks = [use for use in drawn.svg.split("<use ")[1:] if FAULTY in use.partition(">")[0]]
    return [entry.label for entry in drawn.legend], len(marks)


@pytest.mark.parametrize(
    ("things", "label"),
    [
        (["table:trolley:0"], "touches table:trolley:0"),
        (["bin", "door:o1:0", "wall:n1:0"], "touches bin, door:o1:0, wall:n1:0"),
        (["a", "b", "c", "d"], "touches 4 things"),
    ],
)
def test_what_was_touched_is_marked_and_named(things: list[str], label: str) -> None:
    without, none = plan([])
    told, marks = plan([Touch(2.0 + number, thing) for number, thing in enumerate(things)])
    assert set(told) - set(without) == {label}
    assert (none, marks) == (0, len(things))
