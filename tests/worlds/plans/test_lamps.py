from collections.abc import Callable

import pytest

from refseq_bench.worlds.errors import PlanError
from refseq_bench.worlds.plans.lamps import SLACK
from refseq_bench.worlds.plans.load import load_plan, parse_plan
from tests.worlds.conftest import corner

Text = Callable[..., str]
APART = 1e-6
"""Beside a bound, and no rounding [m]."""


def row(name: str, x: float, y: float = 0.0, more: str = "") -> str:
    """A table of one row of lamps; of one lamp, unless ``more`` says otherwise."""
    count = "" if "count" in more else "step = [3, 0]\ncount = 1\n"
    return f'[[lamp]]\nname = "{name}"\nfirst = [{x}, {y}]\nlumen = 3000\n{count}{more}\n'


def partition(x: float, height: str = "") -> str:
    """A wall across the small corridor, its inner face at ``x`` and its thickness before that."""
    return (
        f'[[wall]]\nname = "partition"\nstart = [{x}, -1.2]\nend = [{x}, 1.2]\ninside = "right"\n'
        f'material = "plaster"\n{height}\n'
    )


def told(text: str) -> str:
    """The one line that is told of a plan; none of one in which all fits."""
    try:
        parse_plan(text)
    except PlanError as error:
        return str(error).removeprefix("plan.toml: ")
    return ""


@pytest.mark.parametrize(
    ("size", "said"),
    [
        ("[120, 30]", "lamp[0].size[0]: 120 of 'a' is not valid; it should be metres, from 0.02 to 20"),
        ("[1.2, 300]", "lamp[0].size[1]: 300 of 'a' is not valid; it should be metres, from 0.02 to 20"),
        ("[0.0012, 0.3]", "lamp[0].size[0]: 0.0012 of 'a' is not valid; it should be metres, from 0.02 to 20"),
        ("[12, 0.3]", "lamp[0], lamp 1 of its row: 'a', 12 by 0.3 m, reaches to [-2.00, -0.15], outside the walls; "
         "valid is x 0 to 8, y -1.2 to 1.2"),
        ("[1.2, 3]", "lamp[0], lamp 1 of its row: 'a', 1.2 by 3 m, reaches to [3.40, -1.50], outside the walls; "
         "valid is x 0 to 8, y -1.2 to 1.2"),
        ("[8, 2.4]", ""),
    ],
)  # fmt: skip
def test_a_lamp_of_another_unit_or_larger_than_the_room(small: Text, size: str, said: str) -> None:
    assert told(small(end=row("a", 4, more=f"size = {size}"))) == said


@pytest.mark.parametrize("over", [-APART, APART])
@pytest.mark.parametrize(("x", "y"), [(0.6, 0.0), (7.4, 0.0), (4.0, -1.05), (4.0, 1.05)])
def test_a_lamp_may_stand_out_as_far_as_the_slack(small: Text, x: float, y: float, over: float) -> None:
    aside = SLACK + over
    at = (x + aside * ((x > 4) - (x < 4)), y + aside * ((y > 0) - (y < 0)))
    assert ("outside the walls" in told(small(end=row("a", *at)))) == (over > 0)


def test_of_a_row_the_lamp_that_goes_through_the_wall_is_told(small: Text) -> None:
    long = row("b", 1.0, more="step = [2.2, 0]\ncount = 4")
    assert told(small(end=row("a", 1.0, 0.9) + long)) == (
        "lamp[1], lamp 4 of its row: 'b', 1.2 by 0.3 m, reaches to [8.20, -0.15], outside the walls; "
        "valid is x 0 to 8, y -1.2 to 1.2"
    )


@pytest.mark.parametrize(
    ("x", "y", "said"),
    [
        (3.8, 0.0, ""),
        (5.0, 0.8, ""),
        (3.8, 0.95, "lamp[0], lamp 1 of its row: 'a', 1.2 by 0.3 m, reaches to [3.20, 1.10], outside the walls; "
         "valid is x 0 to 6, y -1 to 1; or x 4 to 6, y 1 to 5"),
        (4.5, 2.0, "lamp[0], lamp 1 of its row: 'a', 1.2 by 0.3 m, reaches to [3.90, 1.85], outside the walls; "
         "valid is x 4 to 6, y 1 to 5; or x 0 to 6, y -1 to 1"),
    ],
)  # fmt: skip
def test_where_two_corridors_meet_a_lamp_may_hang_in_both(x: float, y: float, said: str) -> None:
    """The areas between the walls meet at y = 1, and the corner between the corridors is at (4, 1)."""
    assert told(corner() + row("a", x, y)) == said


def test_a_lamp_across_the_gap_between_two_corridors() -> None:
    """The building is a U whose arms are 0.2 m apart: all corners of the lamp are between walls, its middle is not."""
    outline = [(0, 0), (6, 0), (6, 6), (3.1, 6), (3.1, 2), (2.9, 2), (2.9, 6), (0, 6)]
    ends = zip(outline, [*outline[1:], outline[0]], strict=True)
    walls = "".join(
        f'[[wall]]\nname = "w{k}"\nstart = {[*a]}\nend = {[*b]}\ninside = "left"\nthickness = 0.05\n'
        'material = "plaster"\n'
        for k, (a, b) in enumerate(ends)
    )
    start = corner()[: corner().index("[[wall]]")] + walls + "[routes]\nforward = [[1, 1], [5, 1]]\n"
    assert told(start + row("a", 2.7, 1)) == ""
    assert "'a', 1.2 by 0.3 m, reaches to [3.10, " in told(start + row("a", 2.7, 4))


@pytest.mark.parametrize(("x", "free"), [(4.6 - SLACK + APART, True), (4.6 - SLACK - APART, False), (3.0, True)])
def test_a_lamp_that_reaches_into_a_partition(small: Text, x: float, free: bool) -> None:
    said = f"lamp[0], lamp 1 of its row: 'a', 1.2 by 0.3 m, at [{x:.2f}, 0.00] reaches into wall 'partition'; move it"
    assert told(small(end=partition(4.0) + row("a", x))) == ("" if free else said)


def test_a_lamp_hangs_over_a_partition_that_ends_below_the_ceiling(small: Text) -> None:
    assert told(small(end=partition(4.0, "height = 2") + row("a", 4.0))) == ""


@pytest.mark.parametrize(("apart", "free"), [(1.2 - SLACK + APART, True), (1.2 - SLACK - APART, False), (-1.0, False)])
def test_lamps_of_two_rows_that_overlap(small: Text, apart: float, free: bool) -> None:
    said = (
        f"lamp[1], lamp 1 of its row: 'b', 1.2 by 0.3 m, at [{4 + apart:.2f}, 0.00] overlaps lamp 2 of 'a' at "
        f"[4.00, 0.00] by {1.2 - abs(apart):.2f} m; their centres should be 1.2 m apart along x or 0.3 m along y"
    )
    rows = row("a", 1.0, more="step = [3, 0]\ncount = 2") + row("b", 4 + apart)
    assert told(small(end=rows)) == ("" if free else said)


def test_lamps_of_two_rows_may_hang_side_by_side(small: Text) -> None:
    assert told(small(end=row("a", 4.0) + row("b", 4.1, 0.3) + row("c", 4.2, 0.7, "size = [0.6, 0.5]"))) == ""


@pytest.mark.parametrize(
    ("step", "free"), [("[1.2, 0]", True), ("[-0.5, 0]", False), ("[0.5, 0.3]", True), ("[0.5, 0.2]", False)]
)
def test_lamps_of_one_row_that_overlap(small: Text, step: str, free: bool) -> None:
    said = told(small(end=row("a", 4.0, more=f"step = {step}\ncount = 2")))
    assert said == (
        ""
        if free
        else f"lamp[0].step: {step.replace(', 0]', ', 0.0]')} of 'a' is not valid; 2 lamps would hang in each other; "
        "valid is 1.2 m along x or 0.3 m along y at least"
    )


@pytest.mark.parametrize("kind", ["building", "corridor"])
def test_lamps_of_worlds_from_a_seed_fit(kind: str) -> None:
    for seed in range(40):
        assert load_plan(f"{kind}:{seed}").lamp
