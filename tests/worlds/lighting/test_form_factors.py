import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from refseq_bench.worlds.lighting.form_factors import (
    Cards,
    Quads,
    configuration_factor,
    form_factors,
    hidden,
    window_factor,
)
from refseq_bench.worlds.lighting.radiosity import lay_patches
from refseq_bench.worlds.plans.load import parse_plan
from tests.worlds.conftest import box, corner

BOX = parse_plan(box(4, 2))
UP = np.array([[0.0, 0.0, 1.0]])


def parallel(a: float, b: float, c: float) -> float:
    """Card parallel to a rectangle a × b at distance c below its corner (Howell's catalogue, configuration B-3)."""
    x, y = a / c, b / c
    u, v = np.hypot(1, x), np.hypot(1, y)
    return (x / u * np.arctan(y / u) + y / v * np.arctan(x / v)) / (2 * np.pi)


def upright(a: float, b: float, c: float) -> float:
    """Card at right angles to a rectangle: its width b, its height a, its lower corner at distance c (Howell's B-4)."""
    x, y = a / b, c / b
    return (np.arctan(1 / y) - y / np.hypot(x, y) * np.arctan(1 / np.hypot(x, y))) / (2 * np.pi)


def factor(face: Quads, point: NDArray[np.float64], normal: NDArray[np.float64]) -> float:
    return float(configuration_factor(face.corners - point, np.atleast_2d(normal))[0])


def sampled(face: Quads, point: NDArray[np.float64], normal: NDArray[np.float64], n: int = 400) -> float:
    """Sum of cosα cosβ dA / π d² over n × n pieces, by brute force."""
    p, u, v = face.corners[0, 0], *(face.corners[0, [1, 3]] - face.corners[0, 0])
    steps = (np.arange(n) + 0.5) / n
    ray = p + steps[:, None, None] * u + steps[None, :, None] * v - point
    square = (ray**2).sum(axis=-1)
    at_card, at_face = np.maximum(0, ray @ normal), np.maximum(0, -ray @ face.normals[0])
    return float((at_card * at_face / square**2).sum() * face.areas[0] / n**2 / np.pi)


@pytest.mark.parametrize(("a", "b", "c"), [(1, 1, 1), (2, 0.5, 0.3), (0.3, 4, 2)])
def test_factor_is_the_catalogues(a: float, b: float, c: float) -> None:
    above = Quads.tiled([0, 0, c], [0, b, 0], [a, 0, 0])
    assert factor(above, np.zeros(3), UP[0]) == pytest.approx(parallel(a, b, c), rel=1e-12)
    wall = Quads.tiled([c, 0, 0], [0, 0, a], [0, b, 0])
    np.testing.assert_allclose(wall.normals, [[-1, 0, 0]], atol=1e-12)
    assert factor(wall, np.zeros(3), UP[0]) == pytest.approx(upright(a, b, c), rel=1e-12)


directions = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1)


@settings(max_examples=60, deadline=None)
@given(directions, directions, st.floats(0.2, 3), st.floats(0.2, 3), st.floats(0.5, 3))
def test_factor_of_any_card_is_the_integral(
    card: tuple[float, ...], out: tuple[float, ...], a: float, b: float, d: float
) -> None:
    normal, axis = np.array(card) / np.linalg.norm(card), np.array(out) / np.linalg.norm(out)
    side = np.cross(axis, [0.6, 0.0, 0.8] if abs(axis[1]) < 0.9 else [1.0, 0.0, 0.0])
    side /= np.linalg.norm(side)
    face = Quads.tiled(d * axis, a * side, b * np.cross(-axis, side))
    np.testing.assert_allclose(face.normals[0], -axis, atol=1e-9)
    assert factor(face, np.zeros(3), normal) == pytest.approx(sampled(face, np.zeros(3), normal), abs=2e-4)


@settings(max_examples=60, deadline=None)
@given(directions, st.floats(-2, 2), st.floats(0.2, 3))
def test_a_window_is_cut_at_the_height_of_the_card(card: tuple[float, ...], low: float, tall: float) -> None:
    """Above and below are the factors of the two parts, of which the window's is the sum."""
    normals = np.array([card]) / np.linalg.norm(card)

    def shown(bottom: float, top: float) -> float:
        part = Quads.tiled([1.0, -0.7, bottom], [0, 0, top - bottom], [0, 1.4, 0])
        return float(configuration_factor(part.corners, normals)[0])

    high = low + tall
    above, below = window_factor(Quads.tiled([1.0, -0.7, low], [0, 0, tall], [0, 1.4, 0]).corners, normals)
    assert above[0] == pytest.approx(shown(max(low, 0.0), high) if high > 0 else 0.0, abs=1e-9)
    assert below[0] == pytest.approx(shown(low, min(high, 0.0)) if low < 0 else 0.0, abs=1e-9)
    assert above[0] + below[0] == pytest.approx(shown(low, high), abs=1e-9)


def test_the_back_of_a_face_gives_nothing() -> None:
    turned = Quads.tiled([0, 0, 1], [1, 0, 0], [0, 1, 0])
    assert factor(turned, np.zeros(3), UP[0]) == 0.0


@settings(max_examples=20, deadline=None)
@given(directions, st.floats(0.1, 3.9), st.floats(-0.9, 0.9), st.floats(0.1, 2.7))
def test_a_closed_room_fills_the_view_of_any_card(card: tuple[float, ...], x: float, y: float, z: float) -> None:
    faces = lay_patches(BOX).faces
    normal = np.array(card) / np.linalg.norm(card)
    total = configuration_factor(faces.corners - [x, y, z], np.tile(normal, (len(faces), 1))).sum()
    assert total == pytest.approx(1.0, abs=1e-9)


def test_far_faces_are_points_of_nearly_the_same_light() -> None:
    cards = Cards(np.array([[1.0, 0.0, 0.5]]), UP)
    faces = lay_patches(BOX).faces
    exact = configuration_factor(faces.corners - cards.points[0], np.repeat(UP, len(faces), axis=0))
    found = form_factors(cards, faces, BOX).toarray()[0]
    assert (found != exact).any()
    np.testing.assert_allclose(found, exact, rtol=0.06, atol=2e-3)  # one on the horizon is left out


def test_around_a_corner_nothing_is_seen() -> None:
    plan = parse_plan(corner(length=12, depth=12))
    faces = Quads.joined(
        [Quads.tiled([11, 8, 2.8], [0, 0.1, 0], [0.1, 0, 0]), Quads.tiled([11, 0, 2.8], [0, 1, 0], [1, 0, 0])]
    )
    seen = form_factors(Cards(np.array([[2.0, 0.0, 0.0], [11.0, 3.0, 0.0]]), np.repeat(UP, 2, axis=0)), faces, plan)
    np.testing.assert_array_equal(seen.toarray() > 0, [[False, True], [True, True]])


def test_walls_hide_what_brute_force_says_they_hide() -> None:
    plan = parse_plan(corner(length=9, depth=9))

    def on_ground(p: NDArray[np.float64]) -> NDArray[np.bool_]:
        along = (p >= [0, -1]).all(-1) & (p <= [9, 1]).all(-1)
        return along | ((p >= [7, -1]).all(-1) & (p <= [9, 9]).all(-1))

    spots = np.random.default_rng(0).uniform((0, -1), (9, 9), (300, 2))
    a, b = np.array_split(spots[on_ground(spots)][:80], 2)
    i, j = (k.ravel() for k in np.meshgrid(np.arange(40), np.arange(40), indexing="ij"))
    steps = np.linspace(0, 1, 300)[:, None, None]
    leaves = ~on_ground(a[i] + steps * (b[j] - a[i])).all(axis=0)
    found = hidden(plan, a, b, i, j)
    assert 0.1 < found.mean() < 0.9
    assert np.mean(found == leaves) > 0.998  # steps may miss a corner that is cut by a hair
