from collections.abc import Callable

import mujoco
import numpy as np
import pytest

from refseq_bench.worlds.build import build_world
from refseq_bench.worlds.errors import PlanError
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.parts.site import SEEN, SOLID
from refseq_bench.worlds.plans.load import parse_plan
from tests.worlds.test_build import touched

FOOT, WIDTH, STEPS, RISE, RUN = (3.0, 0.0), 0.8, 4, 0.17, 0.28
HEADINGS = (0.0, 90.0, 37.0, -140.0)


def flight(heading: float = 0.0, steps: int = STEPS) -> str:
    return (
        f'stairs = [{{ name = "up", at = [{FOOT[0]}, {FOOT[1]}], heading = {heading}, width = {WIDTH}, '
        f'steps = {steps}, rise = {RISE}, run = {RUN}, material = "door" }}]'
    )


def spec(text: str) -> mujoco.MjSpec:
    return build_world(parse_plan(text), light_named("18:00"), pictured=False).spec


def ready(text: str) -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = spec(text).compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def at(heading: float, along: float, left: float, up: float) -> np.ndarray:
    """Return the world point so far up the flight, to the left of its middle and above the floor."""
    cos, sin = np.cos(np.radians(heading)), np.sin(np.radians(heading))
    return np.array([FOOT[0] + cos * along - sin * left, FOOT[1] + sin * along + cos * left, up])


def reach(model: mujoco.MjModel, data: mujoco.MjData, start: np.ndarray, end: np.ndarray) -> float:
    """Return how far a beam of solid things' group gets from ``start`` towards ``end`` [m]."""
    groups = np.zeros(6, np.uint8)
    groups[SOLID] = 1
    aim = (end - start) / np.linalg.norm(end - start)
    return mujoco.mj_ray(model, data, start, aim, groups, 1, -1, np.zeros(1, np.int32))


@pytest.mark.parametrize("heading", HEADINGS)
def test_each_tread_lies_a_rise_above_the_one_before_over_the_whole_width(
    small: Callable[..., str], heading: float
) -> None:
    model, data = ready(small(flight(heading)))
    for step in range(STEPS):
        for share in (0.02, 0.5, 0.98):
            for left in (-0.49 * WIDTH, 0.0, 0.49 * WIDTH):
                above, below = (at(heading, (step + share) * RUN, left, z) for z in (2.7, 0.0))
                assert 2.7 - reach(model, data, above, below) == pytest.approx((step + 1) * RISE, abs=1e-9)


@pytest.mark.parametrize("heading", HEADINGS)
def test_a_level_beam_up_the_flight_ends_on_the_riser_at_its_height(small: Callable[..., str], heading: float) -> None:
    model, data = ready(small(flight(heading)))
    for step in range(STEPS):
        height = (step + 0.5) * RISE
        start, end = at(heading, -0.5, 0.0, height), at(heading, 0.0, 0.0, height)
        assert reach(model, data, start, end) == pytest.approx(0.5 + step * RUN, abs=1e-9)


def test_a_body_touches_the_steps_that_it_reaches_into_and_nothing_beside_them(small: Callable[..., str]) -> None:
    world, half = spec(small(flight())), (0.05, 0.05, 0.05)
    assert touched(world, (FOOT[0] - 0.06, 0.0, 0.06), half) == set()
    assert touched(world, (FOOT[0] - 0.04, 0.0, 0.06), half) == {"stairs:up:0"}
    assert touched(world, (FOOT[0] + STEPS * RUN + 0.06, 0.0, 0.06), half) == set()
    for side in (-1.0, 1.0):
        assert touched(world, (FOOT[0] + RUN, side * (WIDTH / 2 + 0.06), 0.06), half) == set()
        assert touched(world, (FOOT[0] + RUN, side * (WIDTH / 2 + 0.04), 0.06), half) == {"stairs:up:0", "stairs:up:1"}


@pytest.mark.parametrize("heading", HEADINGS)
def test_handrails_run_0_9_m_above_the_edges_along_both_sides(small: Callable[..., str], heading: float) -> None:
    model, data = ready(small(flight(heading)))
    for side, sign in (("left", 1.0), ("right", -1.0)):
        rail = data.geom(f"stairs:up:rail:{side}")
        axis, half = rail.xmat.reshape(3, 3)[:, 2], model.geom(f"stairs:up:rail:{side}").size[1]
        assert axis[2] == pytest.approx(RISE / np.hypot(RISE, RUN))
        ends = [at(heading, k * RUN, sign * (WIDTH / 2 - 0.07), (k + 1) * RISE + 0.9) for k in (0, STEPS - 1)]
        np.testing.assert_allclose([rail.xpos - half * axis, rail.xpos + half * axis], ends, atol=1e-9)


def test_handrails_end_below_the_ceiling_and_a_single_step_has_none(small: Callable[..., str]) -> None:
    model, data = ready(small(flight(steps=16)))  # 2.72 m, the ceiling at 2.8 m
    rail = data.geom("stairs:up:rail:left")
    top = rail.xpos[2] + model.geom("stairs:up:rail:left").size[1] * rail.xmat[8]
    assert 2.8 - RISE < top + 0.022 <= 2.8
    names = {geom.name for geom in spec(small(flight(steps=1))).geoms}
    assert "stairs:up:0" in names
    assert not [name for name in names if "rail" in name or "post" in name]


def test_steps_are_solid_and_echo_their_material_and_the_rest_is_only_seen(small: Callable[..., str]) -> None:
    model = spec(small(flight())).compile()
    stairs = [model.geom(i) for i in range(model.ngeom) if model.geom(i).name.startswith("stairs:up:")]
    steps = [geom for geom in stairs if geom.name.split(":")[2].isdigit()]
    assert len(steps) == STEPS
    for geom in stairs:
        solid = geom in steps
        assert geom.group == (SOLID if solid else SEEN)
        assert (geom.contype, geom.conaffinity) == (int(solid), int(solid))
    assert [geom.user[0] for geom in steps] == [0.3] * STEPS  # the material's albedo


def test_nosings_stand_out_of_their_steps_by_a_paper_s_thickness(small: Callable[..., str]) -> None:
    model, data = ready(small(flight()))
    geom, mesh = data.geom("stairs:up:nosings"), model.mesh("stairs:up:nosings")
    local = model.mesh_vert[mesh.vertadr[0] :][: mesh.vertnum[0]]
    corners = local @ geom.xmat.reshape(3, 3).T + geom.xpos
    np.testing.assert_allclose(corners.min(axis=0), [FOOT[0] - 0.003, -WIDTH / 2, RISE - 0.045], atol=1e-6)
    np.testing.assert_allclose(
        corners.max(axis=0), [FOOT[0] + (STEPS - 1) * RUN + 0.045, WIDTH / 2, STEPS * RISE + 0.003], atol=1e-6
    )


def test_stairs_that_rise_through_the_ceiling_are_told(small: Callable[..., str]) -> None:
    message = (
        r"^plan.toml: stairs\[0\].steps: 17 is not valid; they rise 2.89 m, and the ceiling is 2.8 m high: "
        r"at most 16 steps fit$"
    )
    with pytest.raises(PlanError, match=message):
        parse_plan(small(flight(steps=17)))
