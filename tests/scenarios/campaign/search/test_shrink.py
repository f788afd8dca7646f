from collections.abc import Mapping
from itertools import product

from hypothesis import given, settings
from hypothesis import strategies as st

from refseq_bench.scenarios.campaign.search.dials import Choice, Point, Scale
from refseq_bench.scenarios.campaign.search.shrink import shrunk


def kept(case: object, _value: object) -> object:
    return case


DIALS = {
    "a": Scale("a", 0.0, kept, 0.0, 4.0, 1.0),  # type: ignore[arg-type]
    "b": Scale("b", 3.0, kept, 0.0, 4.0, 1.0),  # type: ignore[arg-type]
    "drawn": Scale("drawn", None, kept, 0.0, 2.0, 1.0),  # type: ignore[arg-type]
    "word": Choice("word", "calm", kept, ("calm", "wild")),  # type: ignore[arg-type]
}


def hardness(point: Point) -> tuple[float, ...]:
    """Turns of the dials from where they are easy."""
    a, b = float(point.get("a", 0.0)), float(point.get("b", 3.0))
    drawn = 1.0 if "drawn" in point else 0.0
    return a, abs(b - 3.0), drawn, float(point.get("word", "calm") == "wild")


@settings(max_examples=60, deadline=None)
@given(st.lists(st.integers(0, 3), min_size=4, max_size=4), st.floats(1.0, 8.0))
def test_nothing_can_be_left_out_of_what_is_left(weights: list[int], bound: float) -> None:
    """For failures that grow with each dial: no dial may be set back, none moved a step towards its easy value."""

    def fails(point: Point) -> bool:
        return sum(w * h for w, h in zip(weights, hardness(point), strict=True)) >= bound

    worst: Mapping[str, float | str] = {"a": 4.0, "b": 0.0, "drawn": 2.0, "word": "wild"}
    if not fails(worst):
        return
    left = shrunk(worst, DIALS, fails)
    assert fails(left)
    for name in left if len(left) > 1 else ():
        assert not fails({other: value for other, value in left.items() if other != name})
    last = list(left)[-1]
    if last in ("a", "b"):
        nearer = float(left[last]) + (-1.0 if last == "a" else 1.0)
        assert not fails({**left, last: nearer}) or nearer == DIALS[last].easy


def test_one_dial_alone_is_found_by_trying_all_values() -> None:
    for bound in range(1, 5):
        found = shrunk({"a": 4.0, "word": "wild"}, DIALS, lambda point, bound=bound: hardness(point)[0] >= bound)
        assert found == {"a": float(bound)}


def test_points_that_fail_without_order_still_end_at_one_that_fails() -> None:
    """A method that fails at some values between which it passes: halving may miss the nearest, never tell a lie."""
    for failing in product([False, True], repeat=3):
        values = {4.0, *(value for value, bad in zip((1.0, 2.0, 3.0), failing, strict=True) if bad)}
        assert shrunk({"a": 4.0}, DIALS, lambda point, values=values: point.get("a") in values)["a"] in values
