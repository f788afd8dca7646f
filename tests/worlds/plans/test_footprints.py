import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from refseq_bench.worlds.plans.footprints import PERSON_RADIUS, Footprint, clearance, gaps, strip, taken
from refseq_bench.worlds.plans.load import load_plan

RAY = np.linspace(-1.0, 1.0, 21)
sizes = st.floats(0.0, 2.0)
shapes = st.builds(
    Footprint, st.floats(-4, 4), st.floats(-4, 4), st.floats(-3.2, 3.2), sizes, sizes, st.floats(0.0, 1.0)
)


def filled(shape: Footprint) -> NDArray[np.float64]:
    """Points all over a rectangle before it is grown, corners among them."""
    u, v = (side.ravel() for side in np.meshgrid(RAY * shape.length, RAY * shape.width))
    cos, sin = np.cos(shape.heading), np.sin(shape.heading)
    return np.stack([shape.x + cos * u - sin * v, shape.y + sin * u + cos * v], axis=1)


@given(shapes, shapes)
def test_gaps_are_those_between_all_points(one: Footprint, other: Footprint) -> None:
    a, b = filled(one), filled(other)
    nearest = np.sqrt(((a[:, None, :] - b[None, :, :]) ** 2).sum(axis=2)).min() - one.radius - other.radius
    step = 0.1 * 2.0 * 2**0.5  # diagonal of a cell of the largest rectangle: both may miss by half of it
    (gap,) = gaps(one, [other])
    assert nearest - step - 1e-9 <= gap <= nearest + 1e-9
    assert gap == pytest.approx(gaps(other, [one])[0], abs=1e-9)


@pytest.mark.parametrize(
    ("one", "other", "gap"),
    [
        (Footprint(0, 0, 0, 1, 0.5), Footprint(3, 0, 0, 1, 0.5), 1.0),
        (Footprint(0, 0, 0, 1, 0.5, 0.25), Footprint(3, 0, 0, 1, 0.5, 0.5), 0.25),
        (Footprint(0, 0, 0, 1, 1), Footprint(2 + 2**0.5, 0, np.pi / 4, 1, 1), 1.0),  # a corner points at it
        (Footprint(0, 0, 0, 1, 0), Footprint(0, 0, np.pi / 2, 1, 0), 0.0),  # lines that cross
        (Footprint(0, 0, 0, 2, 2), Footprint(0.5, 0.5, 0.3, 0.1, 0.1), 0.0),  # one within the other
        (Footprint(0, 0, 0, 1, 0, 0.5), Footprint(0, 0.7), 0.2),
    ],
)
def test_gaps_that_are_known(one: Footprint, other: Footprint, gap: float) -> None:
    assert gaps(one, [other])[0] == pytest.approx(gap, abs=1e-12)


@given(st.lists(shapes, max_size=4), st.tuples(st.floats(-5, 5), st.floats(-5, 5)))
def test_clearance_is_the_least_gap_of_a_point(others: list[Footprint], point: tuple[float, float]) -> None:
    least = gaps(Footprint(*point), others).min(initial=np.inf)
    assert clearance([point], others)[0] == pytest.approx(least, abs=1e-9)


def test_a_strip_is_what_a_disc_sweeps() -> None:
    swept = strip((1, 1), (4, 5), 0.5)
    assert (swept.length, swept.radius) == (2.5, 0.5)
    ends_and_beside = [(1, 1), (4, 5), (2.5 - 0.8 * 0.5, 3 + 0.6 * 0.5), (1 - 0.3, 1 - 0.4)]
    np.testing.assert_allclose(clearance(ends_and_beside, [swept]), [-0.5, -0.5, 0.0, 0.0], atol=1e-12)


def test_the_hallway_s_things_take_the_ground_that_they_stand_on() -> None:
    ground = {(t.table, t.name): t.footprint for t in taken(load_plan("hallway"))}
    assert clearance([(36.1, -1.2 + 0.35)], [ground["cabinet", "c02"]])[0] == pytest.approx(0.0, abs=1e-12)
    assert clearance([(7.2, 1.2 - 0.02 - 0.28)], [ground["bin", "n01"]])[0] == pytest.approx(0.0, abs=1e-12)
    assert clearance([(50.0, 1.2), (50.0, -1.2)], [ground["wall", "left"]]) == pytest.approx([0.0, 2.4])
    assert ("fixture", "f05") in ground  # a radiator
    assert ("fixture", "f17") not in ground  # a sign overhead
    assert PERSON_RADIUS < 0.3
