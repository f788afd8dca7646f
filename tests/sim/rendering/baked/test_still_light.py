"""Light on what stands still, and around what moves: where it is known, and how it is looked up between."""

from functools import partial
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from refseq_bench.sim.rendering.baked.batch import COLUMNS, LUX, NORMAL, PLACE
from refseq_bench.sim.rendering.baked.charts import MARGIN, Sheet
from refseq_bench.sim.rendering.baked.model_lights import bake_lamps
from refseq_bench.sim.rendering.baked.moving import moved
from refseq_bench.sim.rendering.baked.still_light import PROBE_STEP, Probes, _sheet, light_still, on_cards
from refseq_bench.sim.rendering.baked.surfaces import surfaces_of
from refseq_bench.worlds.lighting.ambient import AXES
from refseq_bench.worlds.lighting.baking import Baked

FLOOR = '<geom type="plane" size="6 4 1" pos="20 10 0"/>'
BOX = '<geom type="box" size="6 4 0.1" pos="20 10 -0.1"/>'
LAND = '<geom type="plane" size="90 90 1" pos="0 0 -0.03" contype="0" conaffinity="0"/>'
CAR = '<body pos="70 70 0.5"><freejoint/><geom type="box" size="1 1 0.5"/></body>'
CUBE = np.array([600.0, 100.0, 300.0, 200.0, 900.0, 50.0])
turns = st.tuples(*[st.floats(-3.0, 3.0)] * 3).map(lambda angles: Rotation.from_euler("xyz", angles).as_matrix())


def test_cards_along_the_axes_get_their_own_light() -> None:
    np.testing.assert_allclose(on_cards(CUBE, AXES), CUBE)


@given(turns)
def test_a_card_between_axes_gets_some_mean_of_the_sides_that_it_faces(turn: np.ndarray) -> None:
    normals = AXES @ turn.T
    for normal, lux in zip(normals, on_cards(CUBE, normals), strict=True):
        faced = CUBE[AXES @ normal >= 0.0]
        assert faced.min() - 1e-9 <= lux <= faced.max() + 1e-9
    np.testing.assert_allclose(on_cards(np.full(6, 70.0), normals), 70.0)


@given(turns)
def test_the_light_on_a_body_is_that_of_the_way_which_its_sides_face(turn: np.ndarray) -> None:
    """Its corners and their normals turn with it; those of another body stay."""
    vertices = np.zeros((12, COLUMNS), np.float32)
    vertices[:, PLACE], vertices[:, NORMAL] = 0.5 * np.vstack([AXES, AXES]), np.vstack([AXES, AXES])
    batch: Any = SimpleNamespace(vertices=vertices, bodies=np.repeat([1, 2], 6))
    places = np.array([[0.0, 0.0, 0.0], [3.0, 4.0, 0.5], [-1.0, 0.0, 0.0]])
    data: Any = SimpleNamespace(xmat=np.array([np.eye(3), turn, np.eye(3)]).reshape(3, 9), xpos=places)
    points = np.zeros((1, 3))
    found = moved(batch, data, Probes(points, CUBE[None], cKDTree(points)))
    np.testing.assert_allclose(found[:6, PLACE], 0.5 * AXES @ turn.T + places[1], atol=1e-5)
    np.testing.assert_allclose(found[:6, NORMAL], AXES @ turn.T, atol=1e-6)
    np.testing.assert_allclose(found[:6, LUX], on_cards(CUBE, AXES @ turn.T), rtol=1e-4)
    np.testing.assert_allclose(found[6:, LUX], CUBE, rtol=1e-6)
    assert not vertices[:, LUX].any(), "the vertices as they were made stay"


def test_a_buried_point_of_the_sheet_has_the_light_of_the_nearest_that_is_not() -> None:
    """Of its own face: a dark one beside it on the sheet lends nothing."""
    sheet = Sheet()
    faces = [np.array([[0, 0, z], [2, 0, z], [2, 1, z], [0, 1, z]], float) for z in (0.0, 1.0)]
    charts = [sheet.lay(face, 0.25) for face in faces]
    rows, columns = charts[0].shape
    lux = np.concatenate([100.0 + 10 * np.tile(np.arange(columns), rows), np.zeros(rows * columns)])
    buried = np.zeros((2, rows, columns), bool)
    buried[0, :, 5:] = True
    found = _sheet(SimpleNamespace(sheet=sheet), Baked(lux, buried.ravel(), np.zeros(0)))  # type: ignore[arg-type]
    first, other = (
        found[chart.row - MARGIN : chart.row + rows + MARGIN, chart.column - MARGIN : chart.column + columns + MARGIN]
        for chart in charts
    )
    expected = 100.0 + 10 * np.minimum(np.pad(np.arange(columns), MARGIN, mode="edge"), 4)
    np.testing.assert_array_equal(first, np.tile(expected, (rows + 2 * MARGIN, 1)))
    assert not other.any()


@pytest.mark.parametrize("share", [0.0, 0.25, 0.5])
def test_light_around_lies_between_that_of_the_nearest_places(share: float) -> None:
    points = np.array([[0.0, 0.0, 1.0], [1.5, 0.0, 1.0]])
    probes = Probes(points, np.array([[100.0] * 6, [500.0] * 6]), cKDTree(points))
    near = probes.at(np.array([1.5 * share, 0.0, 1.0]))
    mirrored = probes.at(np.array([1.5 * (1 - share), 0.0, 1.0]))
    np.testing.assert_allclose(near + mirrored, 600.0)
    assert (near <= 300.0 + 1e-9).all()
    assert (near >= 100.0).all()


def places(geoms: str) -> np.ndarray:
    """Places where the light around what moves is known, (n, 2) [m]."""
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{geoms}</worldbody></mujoco>")
    surfaces = surfaces_of(model, 0.4)
    return light_still(model, surfaces, partial(bake_lamps, model)).probes.points[:, :2]


@pytest.mark.parametrize("floor", [FLOOR, BOX])
def test_it_is_known_on_all_of_the_floor_and_not_on_the_land_around(floor: str) -> None:
    known = places(floor + LAND + CAR)
    assert (np.abs(known - [20, 10]) <= [6 + 1e-6, 4 + 1e-6]).all()
    spots = np.random.default_rng(3).uniform([14, 6], [26, 14], (200, 2))
    assert np.linalg.norm(spots[:, None] - known, axis=2).min(axis=1).max() <= PROBE_STEP


def test_it_is_known_everywhere_where_nothing_is_touched() -> None:
    known = places(LAND)
    assert known.min() < -88
    assert known.max() > 88
