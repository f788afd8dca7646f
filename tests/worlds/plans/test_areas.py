import numpy as np
import pytest

from refseq_bench.worlds.plans.areas import rectangles
from refseq_bench.worlds.plans.load import load_plan, parse_plan
from refseq_bench.worlds.plans.schema import FloorPlan
from tests.worlds.conftest import SMALL, corner


def area(plan: FloorPlan) -> float:
    return float(sum(np.prod(r.size) for r in rectangles(plan)))


def test_the_floor_is_what_lies_between_the_walls() -> None:
    assert area(load_plan("hallway")) == 100 * 2.4
    for x in (0.0, 100.0):
        assert area(parse_plan(corner(x, length=6, depth=5))) == pytest.approx(6 * 2 + 2 * 4)
    open_at_both_ends = parse_plan(SMALL.format(top="", end=""))
    assert area(open_at_both_ends) == pytest.approx(8 * 2.4)
