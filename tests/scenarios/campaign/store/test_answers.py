import math
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest

from refseq.belief import Belief, Timings, pose_beside
from refseq.fault import DeclaredFault, FaultKind
from refseq.view import LASER
from refseq_bench.scenarios.campaign.store.answers import beliefs_digest

BELIEF = Belief(np.array([0.25, 0.75]), 0.5, 1, (0, 1), 0.56)
OTHERS: dict[str, Any] = {
    "places": np.nextafter(BELIEF.places, 1),
    "lost": math.nextafter(0.5, 1),
    "best": 0,
    "path": (1, 1),
    "entropy": math.nextafter(0.56, 1),
    "faults": (DeclaredFault(LASER, FaultKind.BLIND, 3, 1.5, 9.5),),
    "lost_after": np.array([0.5, 0.0]),
    "pose": pose_beside((0.1, 0.0, 0.0), np.eye(3)),
    "odometer_scale": math.nextafter(1.0, 0.0),
}


@pytest.mark.parametrize("name", [field.name for field in fields(Belief) if field.name != "timings"])
def test_a_digest_is_of_all_but_the_times(name: str) -> None:
    other = replace(BELIEF, **{name: OTHERS[name]})
    assert beliefs_digest([other]) != beliefs_digest([BELIEF])
    assert beliefs_digest([other]) == beliefs_digest([replace(other, timings=Timings(chain=1.0))])


def test_the_order_counts_and_so_does_the_place_last_sure_of() -> None:
    other = replace(BELIEF, best=0)
    assert beliefs_digest([BELIEF, other]) != beliefs_digest([other, BELIEF])
    first, second = (replace(BELIEF, lost_after=np.array(shares)) for shares in ((0.5, 0.0), (0.0, 0.5)))
    assert beliefs_digest([first]) != beliefs_digest([second])
