import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from refseq.errors import LogError
from refseq.logs.transforms import Mount, Transform, TransformTree, heading_of, pose_in_plane

Quaternion = tuple[float, float, float, float]
angles = st.floats(-3, 3)


def turned(axes: str, *by: float) -> Quaternion:
    x, y, z, w = Rotation.from_euler(axes, by if len(by) > 1 else by[0]).as_quat()
    return float(x), float(y), float(z), float(w)


def tree(*transforms: Transform) -> TransformTree:
    found = TransformTree()
    found.add(transforms, 0.0)
    return found


@given(angles, angles, st.booleans())
def test_a_mount_is_the_product_of_its_joints(mast: float, laser: float, hangs: bool) -> None:
    found = tree(
        Transform("base_link", "mast", (0.5, 0.1, 1.0), turned("z", mast), static=True),
        Transform("mast", "laser", (0.2, 0.0, 0.3), turned("ZX", laser, math.pi * hangs), static=True),
    )
    mount = found.mount("laser", "base_link")
    assert mount
    assert mount.upside_down == hangs
    assert math.cos(mount.yaw - mast - laser) == pytest.approx(1)
    assert (mount.x, mount.y) == pytest.approx((0.5 + 0.2 * math.cos(mast), 0.1 + 0.2 * math.sin(mast)))


def test_a_mount_is_found_through_a_frame_above_the_base() -> None:
    found = tree(
        Transform("base_footprint", "base_link", (0.0, 0.0, 0.1), static=True),
        Transform("base_footprint", "laser", (0.4, 0.0, 0.2), turned("z", 0.5), static=True),
    )
    mount = found.mount("laser", "base_link")
    assert mount
    assert (mount.x, mount.yaw) == pytest.approx((0.4, 0.5))
    assert found.mount("laser", "elsewhere") is None


@given(angles, angles)
def test_a_mount_through_a_frame_above_is_seen_by_a_base_that_is_turned(base: float, laser: float) -> None:
    """The base stands at (0.2, -0.1) of its foot, looking along ``base``."""
    found = tree(
        Transform("base_footprint", "base_link", (0.2, -0.1, 0.1), turned("z", base), static=True),
        Transform("base_footprint", "laser", (0.6, 0.3, 0.2), turned("z", laser), static=True),
    )
    mount = found.mount("laser", "base_link")
    assert mount
    assert math.cos(mount.yaw - (laser - base)) == pytest.approx(1)
    ahead = 0.4 * math.cos(base) + 0.4 * math.sin(base)
    aside = 0.4 * math.cos(base) - 0.4 * math.sin(base)
    assert (mount.x, mount.y) == pytest.approx((ahead, aside))


def test_the_robot_s_way_is_its_odometry_in_the_map() -> None:
    found = TransformTree()
    rng = np.random.default_rng(3)
    truth = []
    for k in range(40):
        x, heading = 0.1 * k, 0.05 * k
        if k % 8 == 0:
            shift, bend = rng.uniform(-1, 1), rng.uniform(-1, 1)
            found.add([Transform("map", "odom", (shift, 2.0, 0.0), turned("z", bend))], float(k))
        found.add([Transform("odom", "base_link", (x, 0.0, 0.0), turned("z", heading))], float(k))
        truth.append((shift + x * math.cos(bend), 2 + x * math.sin(bend), bend + heading))
    way = found.trajectory("base_link", "map")
    assert way
    np.testing.assert_allclose(way.poses[:, :2], np.array(truth)[:, :2], atol=1e-9)
    np.testing.assert_allclose(np.cos(way.poses[:, 2] - np.array(truth)[:, 2]), 1, atol=1e-9)
    assert found.trajectory("map", "base_link") is None


@given(st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: math.hypot(*q) > 0.1))
def test_the_heading_is_that_of_the_x_axis(values: Quaternion) -> None:
    x, y = Rotation.from_quat(values).apply([1, 0, 0])[:2]
    if math.hypot(x, y) < 1e-3:
        return  # straight up
    length = math.hypot(*values)
    a, b, c, d = (value / length for value in values)
    assert math.cos(heading_of((a, b, c, d)) - math.atan2(y, x)) == pytest.approx(1, abs=1e-6)


@example((0.0, 0.0, 0.0, 0.0))
@given(st.tuples(*[st.floats(-1, 1)] * 4))
def test_a_pose_whose_rotation_is_nothing_but_zeros_is_none(rotation: Quaternion) -> None:
    """Programs that do not know it send zeros: no robot looks along x for that."""
    assert (pose_in_plane((1.0, 2.0, 0.0), rotation) is None) == (not any(rotation))


def test_a_cycle_is_refused_and_named() -> None:
    found = tree(Transform("map", "odom"), Transform("odom", "base_link"))
    with pytest.raises(LogError) as caught:
        found.add([Transform("base_link", "map")], 1.0)
    assert str(caught.value) == "transforms form a cycle: map → odom → base_link → map; valid is a tree"
    with pytest.raises(LogError, match="transforms form a cycle: here → here; valid is a tree"):
        found.add([Transform("here", "here")], 1.0)


def test_a_second_parent_is_told_and_not_taken() -> None:
    found = tree(Transform("odom", "base_link"), Transform("map", "base_link"))
    assert found.reparented == {"base_link": "map"}
    assert found.roots == ("odom",)


@pytest.mark.parametrize("rotation", [(0.0, 0.0, 0.0, 0.0), (math.nan, 0.0, 0.0, 1.0)])
def test_a_rotation_that_is_none_is_refused(rotation: Quaternion) -> None:
    with pytest.raises(LogError, match=r"transform odom → base_link has rotation \(.*\); valid are a quaternion"):
        tree(Transform("odom", "base_link", rotation=rotation))


def test_frames_without_end_are_damage() -> None:
    with pytest.raises(LogError, match="transforms have 4097 coordinate frames in a log; valid are at most 4096"):
        tree(*(Transform("map", f"frame-{k}") for k in range(5000)))


def test_a_single_transform_moves_nothing() -> None:
    """Foxglove's messages cannot tell a static one."""
    found = tree(Transform("world", "base_link"))
    assert not found.moving("base_link")
    assert found.trajectory("base_link", "world") is None
    assert found.mount("base_link", "world") == Mount()


def test_transforms_take_the_times_of_logging_where_a_clock_was_set_back() -> None:
    found = TransformTree()
    for k in range(10):
        found.add([Transform("odom", "base_link", (0.1 * k, 0.0, 0.0))], k - 5.0 * (k >= 5), float(k))
    found.take_logged_times()
    way = found.trajectory("base_link", "odom")
    assert way is not None
    np.testing.assert_allclose(way.times, np.arange(10.0))
    np.testing.assert_allclose(way.poses[:, 0], 0.1 * np.arange(10))
