"""Furniture: where beams end on it, that it keeps to its footprint, and that what is touched is seen."""

from collections.abc import Callable

import cv2
import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from refseq_bench.worlds.build import build_world
from refseq_bench.worlds.errors import PlanError
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.parts import clutter, greyscale, posters, textures
from refseq_bench.worlds.parts.furniture import BENCH_CLUTTER, LIGHT_CLUTTER, SHELF_CLUTTER, TABLE_CLUTTER, furnish
from refseq_bench.worlds.parts.site import SEEN, SOLID, TOUCHED, Site
from refseq_bench.worlds.plans.frame import LocalFrame
from refseq_bench.worlds.plans.load import parse_plan
from refseq_bench.worlds.plans.schema import SMALLEST, Furniture
from tests.worlds.conftest import SMALL

SCAN = 0.35
"""Height of the robot's laser [m]."""
MAKERS = sorted({*BENCH_CLUTTER, *TABLE_CLUTTER, *SHELF_CLUTTER, *LIGHT_CLUTTER}, key=lambda maker: maker.__name__)


def plan_with(**item: object) -> str:
    """Text of a plan 8 × 2.4 m with one piece of furniture in it."""
    known = {"name": "it", "at": [4.0, 0.0], "heading": 0.0, "material": "plaster", **item}
    pairs = ", ".join(f"{key} = {repr(value).replace(chr(39), chr(34))}" for key, value in known.items())
    return SMALL.format(top=f"furniture = [{{ {pairs} }}]", end="")


def compiled(seed: int = 0, **item: object) -> mujoco.MjModel:
    """The furniture of such a plan, by itself."""
    return alone(parse_plan(plan_with(**item)).furniture[0], seed)


def alone(item: Furniture, seed: int) -> mujoco.MjModel:
    plan = parse_plan(SMALL.format(top="", end=""))
    site = Site("alone", seed)
    for name, material in plan.material.items():
        site.plain(name, material)
    site.plain("trim", plan.material["plaster"])
    furnish(site, plan.model_copy(update={"furniture": (item,)}))
    return site.spec.compile()


def beam(model: mujoco.MjModel, frame: LocalFrame, s: float, height: float, start: float = 3.0) -> float:
    """Where a beam from the front, across the width at ``s``, ends: how far out [m]; minus infinity if nowhere."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    groups = np.zeros(6, np.uint8)
    groups[[SOLID, TOUCHED]] = 1
    pos, back = frame.point(s, start, height), np.append(-frame.inward, 0.0)
    reach = mujoco.mj_ray(model, data, pos, back, groups, 1, -1, np.zeros(1, np.int32))
    return start - reach if reach >= 0.0 else -np.inf


@pytest.mark.parametrize("heading", [0.0, 30.0, -90.0])
def test_a_beam_ends_on_the_legs_of_a_table_and_passes_between_them(heading: float) -> None:
    item = parse_plan(plan_with(kind="table", width=0.9, depth=0.6, height=0.74, heading=heading)).furniture[0]
    model, frame = alone(item, 0), LocalFrame.under(item)
    # Legs of 5 cm, 2 cm in from the edges: from 0.38 to 0.43 m along, and 0.28 m out.
    for s, out in ((0.405, 0.28), (-0.405, 0.28), (0.425, 0.28), (0.435, -np.inf), (0.375, -np.inf), (0.0, -np.inf)):
        assert beam(model, frame, s, SCAN) == pytest.approx(out, abs=1e-6), s
    assert beam(model, frame, 0.0, 0.73) == pytest.approx(0.3, abs=1e-6)  # the edge of the top


def test_a_beam_ends_on_a_bench_s_drawers_and_between_them_on_its_back() -> None:
    item = parse_plan(plan_with(kind="bench", width=2.0, depth=0.7, height=0.9)).furniture[0]
    model, frame = alone(item, 0), LocalFrame.under(item)
    # Two pedestals 0.48 m wide, 3 cm from the ends, 6 cm behind the edge of the top; the back is 4 cm deep.
    for s, out in ((0.95, 0.29), (0.5, 0.29), (0.48, -0.31), (0.0, -0.31), (-0.73, 0.29)):
        assert beam(model, frame, s, SCAN) == pytest.approx(out, abs=1e-6), s


def test_a_beam_ends_on_a_chair_s_legs_under_its_seat() -> None:
    item = parse_plan(plan_with(kind="chair", width=0.44, depth=0.46, height=0.85)).furniture[0]
    model, frame = alone(item, 0), LocalFrame.under(item)
    assert beam(model, frame, 0.21, SCAN) == pytest.approx(0.23, abs=1e-6)
    assert beam(model, frame, 0.0, SCAN) == -np.inf
    assert beam(model, frame, 0.0, 0.46) == pytest.approx(0.23, abs=1e-6)  # the seat
    assert beam(model, frame, 0.0, 0.8) == pytest.approx(-0.206, abs=1e-6)  # the back's front


def test_a_beam_at_a_shelf_ends_on_what_stands_in_it_or_passes() -> None:
    item = parse_plan(plan_with(kind="shelf", width=1.6, depth=0.4, height=2.0)).furniture[0]
    model, frame = alone(item, 3), LocalFrame.under(item)
    ends = np.array([beam(model, frame, s, 0.2) for s in np.linspace(-0.75, 0.75, 151)])
    assert np.isfinite(ends).mean() > 0.5
    assert not np.isfinite(ends).all()
    assert ends.max() <= 0.2


KINDS = st.sampled_from(sorted(SMALLEST))


@settings(max_examples=25, deadline=None)
@given(
    kind=KINDS,
    grow=st.tuples(st.floats(1.0, 3.0), st.floats(1.0, 2.0), st.floats(1.0, 2.5)),
    heading=st.floats(-180.0, 180.0),
    seed=st.integers(0, 1000),
)
def test_furniture_of_any_size_keeps_to_its_place(
    kind: str, grow: tuple[float, float, float], heading: float, seed: int
) -> None:
    width, depth, height = np.multiply(SMALLEST[kind], grow)
    item = Furniture(
        name="it",
        kind=kind,
        at=(4.0, 0.3),
        heading=heading,
        width=width,
        depth=depth,
        height=height,
        material="plaster",
    )
    model = alone(item, seed)
    touched, seen = corners(model, item, (SOLID, TOUCHED)), corners(model, item, (SEEN, SOLID))
    half = np.array([width, depth]) / 2
    # Solid parts reach the edges of the footprint and not past them; what is only seen may stick out by a little.
    np.testing.assert_allclose(np.abs(touched[:, :2]).max(axis=0), half, atol=1e-6)
    assert np.all(np.abs(seen[:, :2]) < half + 0.05)
    for parts in (touched, seen):
        assert parts[:, 2].min() == pytest.approx(0.0, abs=1e-6)
    assert touched[:, 2].max() < max(height, 1.2) + 1e-6
    # What is touched is seen: no solid part outside the hull of what the cameras see.
    assert np.all(touched.min(axis=0) > seen.min(axis=0) - 1e-6)
    assert np.all(touched.max(axis=0) < seen.max(axis=0) + 1e-6)


def corners(model: mujoco.MjModel, item: Furniture, groups: tuple[int, ...]) -> NDArray[np.float64]:
    """Corners of all geoms of these groups in the item's own frame, (n, 3) [m]."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    frame, found = LocalFrame.under(item), []
    for g in np.flatnonzero(np.isin(model.geom_group, groups)):
        local = _local_corners(model, g)
        world = data.geom_xpos[g] + local @ data.geom_xmat[g].reshape(3, 3).T
        level = (world[:, :2] - frame.origin) @ np.array([frame.along, frame.inward]).T
        found.append(np.column_stack([level, world[:, 2]]))
    return np.concatenate(found)


def _local_corners(model: mujoco.MjModel, g: int) -> NDArray[np.float64]:
    if model.geom_type[g] == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = model.geom_dataid[g]
        first = model.mesh_vertadr[mesh]
        return model.mesh_vert[first : first + model.mesh_vertnum[mesh]].astype(float)
    signs = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    flat = model.geom_type[g] == mujoco.mjtGeom.mjGEOM_PLANE
    return signs * model.geom_size[g] * ((1, 1, 0) if flat else (1, 1, 1))


def test_a_seed_puts_the_same_things_on_a_bench_and_another_seed_others() -> None:
    bench = {"kind": "bench", "width": 2.8, "depth": 0.74, "height": 0.9}
    first, again, other = (compiled(seed, **bench).mesh_vert for seed in (0, 0, 1))
    assert np.array_equal(first, again)
    assert first.shape != other.shape


def test_a_bench_takes_few_geoms() -> None:
    model = compiled(kind="bench", width=2.8, depth=0.74, height=0.9)
    assert model.nmeshface > 1000
    assert (model.geom_group == SEEN).sum() <= 6


def test_a_cupboard_has_doors_and_a_pillar_has_plaster() -> None:
    assert compiled(kind="cupboard", width=1.2, depth=0.45, height=1.9).geom("cupboard:it:front").group[0] == SEEN
    model = compiled(kind="pillar", width=0.4, depth=0.4, height=2.8)
    assert model.geom("pillar:it:block").group[0] == SOLID
    assert model.ntex == 1


def test_furniture_is_built_with_the_world() -> None:
    text = plan_with(kind="box", width=0.5, depth=0.4, height=0.4)
    spec = build_world(parse_plan(text), light_named("18:00"), pictured=False).spec
    assert spec.geom("box:it:0").userdata[0] == pytest.approx(clutter.GREYS["grey"])


@pytest.mark.parametrize(
    ("item", "message"),
    [
        (
            {"kind": "bench", "width": 0.5, "depth": 0.7, "height": 0.9},
            "plan.toml: furniture[0].width: 0.5 is not valid; a bench has at least 0.9 m",
        ),
        (
            {"kind": "shelf", "width": 1.0, "depth": 0.4, "height": 0.3},
            "plan.toml: furniture[0].height: 0.3 is not valid; a shelf has at least 0.4 m",
        ),
        (
            {"kind": "pillar", "width": 0.4, "depth": 0.4, "height": 3.0},
            "plan.toml: furniture[0].height: 3 is not valid; the ceiling is 2.8 m high",
        ),
        (
            {"kind": "table", "width": 1.6, "depth": 0.8, "height": 0.7, "at": [4.0, 0.9]},
            "plan.toml: furniture[0].at: table 'it' reaches to [4.80, 1.30], outside the walls; move it",
        ),
    ],
)
def test_furniture_that_does_not_fit_is_one_line(item: dict[str, object], message: str) -> None:
    with pytest.raises(PlanError) as error:
        parse_plan(plan_with(**item))
    assert str(error.value) == message


# --- things ---


@pytest.mark.parametrize("maker", MAKERS, ids=lambda maker: maker.__name__)
def test_a_thing_keeps_within_its_size(maker: clutter.Maker) -> None:
    for seed in range(40):
        thing = maker(np.random.default_rng(seed))
        spans = np.array([part.block for part in thing.parts])
        width, depth, height = thing.size
        room = np.array([(-width / 2, width / 2), (-depth / 2, depth / 2), (0.0, height)])
        assert np.all(spans[..., 1] > spans[..., 0]), seed
        assert np.all(spans[..., 0] >= room[:, 0] - 1e-9), seed
        assert np.all(spans[..., 1] <= room[:, 1] + 1e-9), seed
        assert spans[:, 2, 0].min() == pytest.approx(0.0, abs=0.021), seed  # it stands, and does not float
        np.testing.assert_allclose(thing.hull, np.stack([spans[..., 0].min(axis=0), spans[..., 1].max(axis=0)], axis=1))
        assert {part.grey for part in thing.parts} <= set(clutter.GREYS)


@given(seed=st.integers(0, 10_000), width=st.floats(0.3, 4.0), depth=st.floats(0.1, 0.8), height=st.floats(0.1, 0.6))
def test_things_in_a_row_stand_side_by_side_within_the_room(
    seed: int, width: float, depth: float, height: float
) -> None:
    placed = list(clutter.row(SHELF_CLUTTER, (width, depth, height), 0.1, 0.0, np.random.default_rng(seed)))
    edges = np.array([(p.s - p.thing.size[0] / 2, p.s + p.thing.size[0] / 2) for p in placed]).reshape(-1, 2)
    assert np.all(np.diff(edges.ravel()) > 0.0)
    assert np.all(np.abs(edges) <= width / 2 + 1e-9)
    for p in placed:
        assert abs(p.out) + p.thing.size[1] / 2 <= depth / 2 + 1e-9
        assert p.thing.size[2] <= height


# --- pictures ---


@pytest.mark.parametrize("draw", [textures.carpet, textures.parquet])
def test_a_floor_has_the_albedo_of_its_material(draw: Callable[..., greyscale.Image]) -> None:
    image = draw((8, 6), 0.3, np.random.default_rng(0))
    assert image.shape == (6 * 48, 8 * 48)
    assert greyscale.linear(image).mean() == pytest.approx(0.3, rel=0.08)


@pytest.mark.parametrize("draw", [textures.carpet, textures.parquet])
def test_neighbouring_squares_of_a_floor_run_across_each_other(draw: Callable[..., greyscale.Image]) -> None:
    field = greyscale.linear(draw((8, 6), 0.3, np.random.default_rng(0)))
    for row in range(6):
        for column in range(8):
            square = field[row * 48 + 3 : row * 48 + 46, column * 48 + 3 : column * 48 + 46]
            across, down = np.abs(np.diff(square, axis=1)).mean(), np.abs(np.diff(square, axis=0)).mean()
            assert (down > across) == ((row + column) % 2 == 0), (row, column)


def test_a_whiteboard_is_mostly_white_with_some_writing() -> None:
    for seed in range(3):
        image = posters.whiteboard((1.5, 1.0), np.random.default_rng(seed))
        assert np.median(image) > greyscale.grey(0.7)
        assert len(cv2.SIFT_create().detect(image, None)) > 50


def test_the_front_of_a_small_cabinet_has_its_label_too() -> None:
    for seed in range(20):
        assert textures.metal((0.3, 0.3), 0.45, np.random.default_rng(seed)).shape == (60, 60)
