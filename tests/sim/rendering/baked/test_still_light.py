"""Light around what moves: known where something can stand."""

from functools import partial

import mujoco
import numpy as np
import pytest

from refseq_bench.sim.rendering.baked.model_lights import bake_lamps
from refseq_bench.sim.rendering.baked.still_light import PROBE_STEP, light_still
from refseq_bench.sim.rendering.baked.surfaces import surfaces_of

FLOOR = '<geom type="plane" size="6 4 1" pos="20 10 0"/>'
BOX = '<geom type="box" size="6 4 0.1" pos="20 10 -0.1"/>'
LAND = '<geom type="plane" size="90 90 1" pos="0 0 -0.03" contype="0" conaffinity="0"/>'
CAR = '<body pos="70 70 0.5"><freejoint/><geom type="box" size="1 1 0.5"/></body>'


def places(geoms: str) -> np.ndarray:
    """Where the light around what moves is known, (n, 2) [m]."""
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
