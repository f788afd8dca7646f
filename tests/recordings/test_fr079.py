"""A laser alone in Freiburg's building 079: a corridor driven to and fro, and again between visits of its rooms.

The log is one session. It is cut at its first revisit: views 0 to 298, the corridor both ways and one room, are the
reference, 87 m. The robot later drives six stretches of 7 m and more of that corridor in the same direction (within
1.5 m and 30°); nearly everything between them, rooms and turns, is off the map.
"""

from collections.abc import Sequence
from typing import NamedTuple

import pytest

from refseq_bench.scenarios.scoring.comparison import Comparison
from refseq_bench.scenarios.scoring.path_geometry import NARROW
from tests.recordings.asking import laser_revisit, print_scores, recording, scores

LOG = "fr079/fr079.log"
FIRST_PASS = "0:299"
REVISITS = ("299:329", "421:449", "887:924", "1116:1146", "1243:1268", "1437:1460")
REST = "299:1464"


class Answers(NamedTuple):
    revisits: Sequence[Comparison]
    rest: Sequence[Comparison]


@pytest.fixture(scope="module")
def answers() -> Answers:
    comparisons = laser_revisit(recording(LOG), FIRST_PASS, [*REVISITS, REST])
    each = len(REVISITS) + 1
    return Answers([one for k, one in enumerate(comparisons) if (k + 1) % each], comparisons[each - 1 :: each])


@pytest.mark.slow
def test_each_revisit_by_itself(answers: Answers) -> None:
    found = scores(answers.revisits)
    print_scores("fr079, six revisits, five seeds, 1.5 m / 0.5 m", found, scores(answers.revisits, NARROW))
    assert found["thesis/uniform"].success.value > 0.3
    assert found["best/uniform"].success.value > 0.25
    assert found["best/prior"].success.value > 0.6
    assert found["best/chain"].success.value > 0.5
    assert found["best/chain"].recall(1).value > 0.6
    assert found["best + hu/chain"].success.value > 0.7


@pytest.mark.slow
def test_a_drive_that_keeps_leaving_the_map(answers: Answers) -> None:
    found = scores(answers.rest)
    print_scores("fr079, the rest in one drive, five seeds, 1.5 m / 0.5 m", found, scores(answers.rest, NARROW))
    assert found["best/prior"].success.value > 0.5
    assert found["best/chain"].success.value > 0.3
    assert found["best/chain"].recall(1).value > 0.5
    assert (found["best/chain"].auroc or 0.0) > 0.7
