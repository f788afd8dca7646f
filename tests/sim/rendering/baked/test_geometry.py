"""Triangles of shapes: areas, sides and pieces, by geometry."""

import mujoco
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from refseq_bench.sim.rendering.baked.charts import Sheet
from refseq_bench.sim.rendering.baked.shapes import box, capsule, ellipsoid, shape_of, turned
from refseq_bench.sim.rendering.baked.sunlight import EDGE, LARGEST, frame_over
from refseq_bench.sim.rendering.baked.triangles import Triangles

sides = st.floats(0.05, 3.0)


def volume(shape: Triangles) -> float:
    """Volume within closed triangles [m³], by the divergence theorem; negative where they are inside out."""
    a, b, c = shape.corners.transpose(1, 0, 2)
    return float(np.einsum("nc,nc->n", a, np.cross(b, c)).sum() / 6)


@given(sides, sides, sides)
def test_a_box_is_closed_and_outside_is_outside(x: float, y: float, z: float) -> None:
    shape = box(np.array([x, y, z])).triangles
    assert volume(shape) == pytest.approx(8 * x * y * z)
    assert shape.area == pytest.approx(8 * (x * y + y * z + z * x))


def test_round_shapes_have_nearly_their_volume_and_normals_point_out() -> None:
    cylinder = turned(np.array([[0.0, -1.0], [0.5, -1.0], [0.5, 1.0], [0.0, 1.0]]))
    for shape, wanted in (
        (cylinder, np.pi * 0.25 * 2),
        (ellipsoid(np.array([0.5, 1.0, 2.0])), 4 / 3 * np.pi),
        (capsule(0.5, 1.0), np.pi * 0.25 * 2 + 4 / 3 * np.pi / 8),
    ):
        assert volume(shape) == pytest.approx(wanted, rel=0.05)
        flat = Triangles.flat(shape.corners).normals
        assert (np.einsum("nkc,nkc->nk", flat, shape.normals) > 0.6).all()
        np.testing.assert_allclose(np.linalg.norm(shape.normals, axis=2), 1.0)


def test_a_mesh_keeps_its_place_and_a_kind_without_triangles_is_left_out() -> None:
    spec = mujoco.MjSpec()
    corners = [0, 0, 0, 2, 0, 0, 0, 1, 0, 0, 0, 3]
    spec.add_mesh(name="wedge", uservert=corners, userface=[0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3])
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="wedge", pos=[1, 1, 1])
    spec.add_hfield(name="hills", size=[1, 1, 1, 0.1], nrow=2, ncol=2, userdata=[0, 0, 0, 1])
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_HFIELD, hfieldname="hills")
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    shape = shape_of(model, 0).placed(data.geom_xpos[0], data.geom_xmat[0].reshape(3, 3))
    assert volume(shape) == pytest.approx(1.0)
    np.testing.assert_allclose(shape.corners.reshape(-1, 3).min(axis=0), [1, 1, 1], atol=1e-6)
    assert len(shape_of(model, 1)) == 0


triangles = st.tuples(st.lists(st.tuples(sides, sides, sides), min_size=3, max_size=3), st.floats(0.2, 1.0))


@settings(max_examples=40, deadline=None)
@given(st.lists(triangles, min_size=1, max_size=4))
def test_cutting_keeps_each_area_and_leaves_no_long_edge(drawn: list[tuple[list[tuple[float, ...]], float]]) -> None:
    whole = Triangles.flat(np.array([corners for corners, _ in drawn]))
    longest = np.array([longest for _, longest in drawn])
    pieces, of = whole.cut(longest)
    for triangle in range(len(whole)):
        assert pieces[of == triangle].area == pytest.approx(whole[[triangle]].area, rel=1e-6, abs=1e-9)
    edges = np.linalg.norm(np.roll(pieces.corners, -1, axis=1) - pieces.corners, axis=2)
    assert (edges <= longest[of][:, None]).all()


def test_charts_lie_apart_and_their_cells_cover_their_face() -> None:
    rng, sheet = np.random.default_rng(1), Sheet()
    taken = np.zeros((4000, 2048), int)
    for _ in range(300):
        u, v = rng.uniform(0.01, 20, 2)
        face = np.array([[0, 0, 0], [u, 0, 0], [u, v, 0], [0, v, 0]])
        chart = sheet.lay(face, 0.4)
        rows, columns = chart.shape
        taken[chart.row - 1 : chart.row + rows + 1, chart.column - 1 : chart.column + columns + 1] += 1
        cells = Triangles.flat(chart.whole.reshape(-1, 3)[chart.cells])
        assert cells.area == pytest.approx(u * v)
        assert (cells.normals[..., 2] > 0.99).all()
        ends = chart.points.reshape(-1, 3)
        assert (ends[:, 0] > 0).all()
        assert (ends[:, 0] < u).all()
    assert taken.max() == 1
    assert taken[0, 0] == 0
    assert sheet.size[1] < 4000
    assert not taken[sheet.size[1] :].any()


@given(
    st.tuples(st.floats(0.01, 200.0), st.floats(0.001, 50.0), st.floats(0.001, 5.0)),
    st.floats(0.05, 1.5),
    st.floats(0.0, 6.3),
)
@example((73.0, 1.0, 0.6542175155386711), 0.5625, 0.0)  # a side of 16 384 texels was rounded up
def test_a_map_of_the_sun_holds_all_points_in_a_size_that_devices_have(
    box_size: tuple[float, float, float], height: float, azimuth: float
) -> None:
    """Seen along its length, a corridor of 100 m is a strip a few decimetres wide."""
    corners = np.array(list(np.ndindex(2, 2, 2))) * np.array(box_size)
    towards = np.array([np.cos(height) * np.cos(azimuth), np.cos(height) * np.sin(azimuth), np.sin(height)])
    frame = frame_over(corners, towards, 4096**2)
    on_map = np.c_[corners, np.ones(8)] @ frame.matrix.T
    assert np.abs(on_map[:, :2]).max() <= 1.0 + 1e-6
    assert all(2 * EDGE < side <= LARGEST for side in frame.size)
    assert frame.size[0] * frame.size[1] < 1.5 * 4096**2
