"""The localiser as a module: each belief is that of one that heard all views in order, or it asks for them again."""

import json
from functools import cache

import numpy as np
import pytest

from refseq.map.learning import learn
from refseq.map.map import Map
from refseq.modules.heads import MissingError, Parts
from refseq.modules.localiser import ASKED, LocaliserModule
from refseq.modules.messages import BELIEF, VIEWS, part, view_parts
from tests.support import corridor_drive

DRIVE = corridor_drive(np.random.default_rng(0), 8, size=96)


@cache
def map_() -> Map:
    return learn(DRIVE, profile="best", sensors=["forward"])


def hear(module: LocaliserModule, number: int, drive: str = "a drive") -> Parts | None:
    return module.hear(VIEWS, view_parts(drive, number, DRIVE[number]))


def told(parts: Parts | None) -> tuple[float, list[float]]:
    assert parts is not None
    belief = json.loads(part(parts, BELIEF))
    return belief["lost"], belief["places"]


def test_a_view_before_older_ones_is_asked_for_again_and_nothing_is_lost() -> None:
    whole, late = LocaliserModule(map_()), LocaliserModule(map_())
    wanted = [told(hear(whole, number)) for number in range(6)]
    with pytest.raises(MissingError, match="view 0 of the drive is missing: 5 came"):
        hear(late, 5)
    assert [told(hear(late, number)) for number in range(6)] == wanted
    assert hear(late, 3) is None, "it was answered"


def test_a_gap_on_the_way_is_asked_for_however_often() -> None:
    module = LocaliserModule(map_())
    hear(module, 0)
    for _ in range(2 * ASKED):
        with pytest.raises(MissingError, match="view 1 of the drive is missing: 2 came"):
            hear(module, 2)
    assert hear(module, 1) is not None


def test_first_views_that_nobody_keeps_are_done_without() -> None:
    module = LocaliserModule(map_())
    for _ in range(ASKED):
        with pytest.raises(MissingError):
            hear(module, 4)
    first = LocaliserModule(map_())
    assert told(hear(module, 4)) == told(first.hear(VIEWS, view_parts("other", 0, DRIVE[4])))
    with pytest.raises(MissingError):
        hear(module, 4, "the next drive")
