"""A body probes every corridor and room: a little narrower it passes, aside it touches the wall."""

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from refseq_bench.worlds.build import build_world
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.plans.areas import Rectangle, rectangles
from refseq_bench.worlds.plans.load import load_plan, world_names

INDOORS = [name for name in (*world_names(), "corridor:1", "corridor:2", "corridor:3") if load_plan(name).ceiling]
BELOW_CEILING, THICK = 0.05, 0.2
"""The probe hangs below the ceiling, above doors and most furniture [m]."""
TALL = ("furniture:", "pillar:", "shelf:", "cupboard:", "stairs:", "sign:")
"""What may reach as high as that and is no wall."""


def touched(model: mujoco.MjModel, area: Rectangle, grown: float, height: float) -> set[str]:
    """What a box touches that fills ``area`` grown by so much on all sides [m]."""
    data, probe = mujoco.MjData(model), model.geom("probe").id
    size = np.append(area.size / 2 + grown, THICK / 2)
    model.geom_size[probe], model.geom_rbound[probe] = size, np.linalg.norm(size)
    model.geom_aabb[probe, 3:] = model.bvh_aabb[model.body_bvhadr[model.geom_bodyid[probe]], 3:] = size
    data.joint("probe").qpos[:3] = [*area.middle, height - BELOW_CEILING - THICK / 2]
    mujoco.mj_forward(model, data)
    pairs = [{model.geom(g).name for g in contact.geom} for contact in data.contact if contact.dist < 0.0]
    return set().union(*(pair - {"probe"} for pair in pairs if "probe" in pair))


def walled_sides(area: Rectangle, areas: tuple[Rectangle, ...]) -> list[NDArray[np.float64]]:
    """Unit vectors to those sides beyond whose middle no other area lies."""
    sides = [np.array(side, float) for side in ((1, 0), (-1, 0), (0, 1), (0, -1))]
    beyond = [area.middle + side * (area.size / 2 + 0.02) for side in sides]
    return [side for side, point in zip(sides, beyond, strict=True) if not any(a.holds(point) for a in areas)]


@pytest.mark.parametrize("name", INDOORS)
def test_a_narrower_body_passes_and_a_wider_one_touches(name: str) -> None:
    plan = load_plan(name)
    assert plan.ceiling is not None
    spec = build_world(plan, light_named("16:00"), pictured=False).spec
    body = spec.worldbody.add_body(name="probe")
    body.add_freejoint(name="probe")
    body.add_geom(name="probe", type=mujoco.mjtGeom.mjGEOM_BOX, size=[1.0, 1.0, 0.1])
    model, areas = spec.compile(), rectangles(plan)
    for area in areas:
        met = touched(model, area, -0.01, plan.ceiling.height)
        assert not {thing for thing in met if not thing.startswith(TALL)}, (name, area)
        for side in walled_sides(area, areas):
            shifted = Rectangle(area.low + 0.02 * side, area.high + 0.02 * side)
            hit = touched(model, shifted, -0.01, plan.ceiling.height)
            assert any(thing.startswith("wall:") for thing in hit), (name, area, side)
