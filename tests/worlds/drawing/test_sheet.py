from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from refseq_bench.worlds.drawing.sheet import EDGE, FOOT, PAPERS, lay_out
from refseq_bench.worlds.plans.areas import Rectangle

sides = st.floats(2.0, 900.0)


@given(sides, sides, st.floats(-50.0, 50.0))
def test_all_ground_is_on_the_paper_once_and_above_the_foot(width: float, depth: float, x: float) -> None:
    ground = Rectangle(np.array([x, -x]), np.array([x + width, depth - x]))
    sheet = lay_out(ground)
    area = sum(float(np.prod(piece.ground.size)) for piece in sheet.pieces)
    assert np.isclose(area, width * depth)
    boxes = [(p.corner, p.corner + p.ground.size * 1000 / sheet.scale) for p in sheet.pieces]
    for low, high in boxes:
        assert np.all(low >= [EDGE - 1e-6, FOOT - 1e-6])
        assert np.all(high <= np.array(PAPERS[sheet.paper]) - EDGE + 1e-6)
    for (low, high), (other_low, other_high) in pairwise(boxes):
        assert np.any(low >= other_high) or np.any(other_low >= high), "pieces lie apart"


def test_a_long_corridor_is_cut_and_drawn_larger_than_it_would_be_whole() -> None:
    sheet = lay_out(Rectangle(np.array([0.0, -2.8]), np.array([103.2, 2.8])))
    assert len(sheet.pieces) == 3
    assert (sheet.scale, sheet.paper) == (100, "A3")
    corners = np.array([piece.corner for piece in sheet.pieces])
    assert np.all(np.diff(corners[:, 1]) < 0), "read from the top down"


def test_a_corridor_that_runs_up_is_cut_into_columns() -> None:
    sheet = lay_out(Rectangle(np.array([-2.8, 0.0]), np.array([2.8, 103.2])))
    assert len(sheet.pieces) > 1
    assert np.all(np.diff([piece.corner[0] for piece in sheet.pieces]) > 0)
    assert len({piece.corner[1] for piece in sheet.pieces}) == 1


def test_a_room_is_drawn_whole_on_the_smallest_paper() -> None:
    sheet = lay_out(Rectangle(np.zeros(2), np.array([21.0, 12.0])))
    assert (len(sheet.pieces), sheet.paper) == (1, "A3")


def test_a_large_plan_goes_on_a_larger_paper() -> None:
    assert lay_out(Rectangle(np.zeros(2), np.array([57.0, 48.0]))).paper == "A1"
