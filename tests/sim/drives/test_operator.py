import math
from dataclasses import dataclass, fields

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from refseq.planar import Pose
from refseq_bench.robots import Twist
from refseq_bench.sim.drives.operator import Operator, OperatorStyle, style_named
from refseq_bench.sim.errors import SimError
from tests.robots.driving import Driven

STRAIGHT = np.array([[0.0, 0.0], [100.0, 0.0]])
CORNER = np.array([[0.0, 0.0], [15.0, 0.0], [15.0, 15.0]])
JOG = np.array([[0.0, 0.0], [10.0, 0.0], [15.0, 3.0], [25.0, 3.0]])
THERE_AND_BACK = np.array([[0.0, 0.0], [12.0, 0.0], [0.0, 0.0]])
PERFECT = OperatorStyle(strength=0.0)
PERIOD = 0.1


@dataclass(frozen=True)
class Led:
    """A drive of a robot that does at once what it is told, sampled every ``PERIOD``."""

    poses: NDArray[np.float64]
    twists: NDArray[np.float64]
    progress: NDArray[np.float64]
    operator: Operator

    def stray(self, route: NDArray[np.float64]) -> NDArray[np.float64]:
        """Distances from the route [m], (n,)."""
        start, step = route[:-1], np.diff(route, axis=0)
        offset = self.poses[:, None, :2] - start
        part = np.clip(np.sum(offset * step, axis=-1) / np.sum(step**2, axis=-1), 0, 1)
        return np.linalg.norm(offset - part[..., None] * step, axis=-1).min(axis=1)


def lead(route: NDArray[np.float64], seed: int, style: OperatorStyle | None = None, start: Pose | None = None) -> Led:
    operator = Operator(route, style or OperatorStyle(), np.random.default_rng(seed))
    heading = math.atan2(*(route[1] - route[0])[::-1])
    pose = start or Pose(*route[0], heading)
    poses, twists, progress = [], [], []
    for step in range(6000):
        twist = operator.command(step * PERIOD, pose)
        if operator.finished and twist == Twist():
            break
        pose = Pose(
            pose.x + twist.linear * PERIOD * math.cos(pose.heading + twist.angular * PERIOD / 2),
            pose.y + twist.linear * PERIOD * math.sin(pose.heading + twist.angular * PERIOD / 2),
            pose.heading + twist.angular * PERIOD,
        )
        poses.append((pose.x, pose.y, pose.heading))
        twists.append((twist.linear, twist.angular))
        progress.append(operator.progress)
    return Led(np.array(poses), np.array(twists), np.array(progress), operator)


@pytest.fixture(scope="module")
def corridor_drives() -> list[Led]:
    return [lead(STRAIGHT, seed) for seed in range(10)]


def test_it_comes_to_the_end(corridor_drives: list[Led]) -> None:
    for led in corridor_drives:
        assert led.operator.finished
        assert led.poses[-1, 0] == pytest.approx(100.0, abs=0.1)
        assert led.operator.progress == led.operator.length == 100.0


def test_it_stays_clear_of_the_furniture(corridor_drives: list[Led]) -> None:
    assert max(led.stray(STRAIGHT).max() for led in corridor_drives) < 0.3


@pytest.mark.parametrize("route", [CORNER, JOG, THERE_AND_BACK], ids=["corner", "jog", "there and back"])
@pytest.mark.parametrize("seed", range(4))
def test_it_stays_by_routes_with_bends(route: NDArray[np.float64], seed: int) -> None:
    led = lead(route, seed)
    assert led.operator.finished
    assert led.stray(route).max() < 0.3
    assert np.linalg.norm(led.poses[-1, :2] - route[-1]) < 0.3


def test_it_is_no_machine(corridor_drives: list[Led]) -> None:
    sideways = np.concatenate([led.poses[:, 1] for led in corridor_drives])
    speeds = np.concatenate([led.twists[50:-50, 0] for led in corridor_drives])
    headings = np.concatenate([led.poses[:, 2] for led in corridor_drives])
    assert 0.03 < sideways.std() < 0.1
    assert 0.03 < speeds.std() < 0.06
    assert speeds.mean() == pytest.approx(0.4, abs=0.02)
    assert 0.01 < headings.std() < 0.15


def test_its_wander_is_correlated_over_metres(corridor_drives: list[Led]) -> None:
    along = np.arange(0, 99, 0.5)
    sideways = np.array([np.interp(along, led.poses[:, 0], led.poses[:, 1]) for led in corridor_drives])
    variance = np.mean(sideways**2)
    near, far = (np.mean(sideways[:, :-lag] * sideways[:, lag:]) / variance for lag in (2, 30))
    assert near > 0.6  # 1 m on
    assert abs(far) < 0.4  # 15 m on


def test_without_imperfections_it_follows_the_line_at_its_speed() -> None:
    led = lead(STRAIGHT, 0, PERFECT)
    assert np.abs(led.poses[:, 1:]).max() < 1e-9
    np.testing.assert_allclose(led.twists[20:-20, 0], 0.4)


def test_without_imperfections_the_seed_does_not_matter() -> None:
    np.testing.assert_array_equal(lead(CORNER, 1, PERFECT).poses, lead(CORNER, 2, PERFECT).poses)


def test_strength_scales_the_imperfection() -> None:
    spread = [
        np.mean([lead(STRAIGHT[:, :] * 0.3, s, OperatorStyle(strength=k)).poses[:, 1].std() for s in range(5)])
        for k in (0.25, 0.5, 1.0)
    ]
    assert spread[0] < 0.7 * spread[1] < 0.7 * spread[2]


def test_the_same_seed_leads_the_same_way_and_another_does_not() -> None:
    np.testing.assert_array_equal(lead(JOG, 3).poses, lead(JOG, 3).poses)
    other = lead(JOG, 4).poses
    assert np.abs(lead(JOG, 3).poses[:200] - other[:200]).max() > 0.01


def test_progress_never_goes_back_by_more_than_its_noise_and_ends_at_the_length() -> None:
    for route in (STRAIGHT * 0.2, CORNER, THERE_AND_BACK):
        led = lead(route, 0)
        assert np.diff(led.progress).min() > -0.05
        assert led.progress[-1] == pytest.approx(led.operator.length)


def test_it_starts_from_beside_the_route_and_facing_away() -> None:
    led = lead(STRAIGHT * 0.1, 0, PERFECT, start=Pose(0.0, 0.8, 3.0))
    assert led.operator.finished
    assert abs(led.poses[-1, 1]) < 0.05


routes = st.lists(
    st.tuples(st.floats(-10, 10), st.floats(-10, 10)),
    min_size=2,
    max_size=5,
    unique_by=lambda p: (round(p[0]), round(p[1])),
)


@settings(max_examples=25, deadline=None)
@given(routes, st.integers(0, 2**32 - 1), st.floats(0, 1))
def test_limits_hold_on_any_route(points: list[tuple[float, float]], seed: int, strength: float) -> None:
    style = OperatorStyle(strength=strength)
    twists = lead(np.array(points), seed, style).twists
    assert np.abs(twists[:, 0]).max() <= style.max_speed + 1e-9
    assert twists[:, 0].min() >= 0
    assert np.abs(twists[:, 1]).max() <= style.max_angular + 1e-9
    changes = np.abs(np.diff(twists, axis=0, prepend=0)) / PERIOD
    assert changes[:, 0].max() <= style.acceleration + 1e-9
    assert changes[:, 1].max() <= style.angular_acceleration + 1e-9


def test_it_leads_the_real_robot() -> None:
    driven = Driven()
    operator = Operator(CORNER * 0.4, OperatorStyle(), np.random.default_rng(1))
    path = []
    driven.drive(
        45.0,
        lambda time: operator.command(time, driven.pose),
        lambda: path.append((driven.pose.x, driven.pose.y, driven.pose.heading)),
    )
    assert operator.finished
    led = Led(np.array(path), np.empty((0, 2)), np.empty(0), operator)
    assert led.stray(CORNER * 0.4).max() < 0.3
    np.testing.assert_allclose(path[-1][:2], CORNER[-1] * 0.4, atol=0.3)


@pytest.mark.parametrize(
    ("route", "message"),
    [
        ([[0, 0, 0], [1, 0, 0]], "a route has shape (n, 2), not (2, 3)"),
        ([[0, 0]], "a route needs two different points, not 1"),
        ([[1, 1], [1, 1]], "a route needs two different points, not 1"),
        ([[0, 0], [math.nan, 0]], "a route's points must be finite"),
    ],
)
def test_what_is_no_route_is_refused(route: list[list[float]], message: str) -> None:
    with pytest.raises(SimError) as error:
        Operator(np.array(route, float), PERFECT, np.random.default_rng(0))
    assert str(error.value) == message


@pytest.mark.parametrize("bad", [-1.0, math.inf, math.nan])
@pytest.mark.parametrize("key", [field.name for field in fields(OperatorStyle) if field.name != "side"])
def test_impossible_styles_are_refused(key: str, bad: float) -> None:
    with pytest.raises(SimError, match=rf"^operator: {key} = {bad} must be (0 or more,|positive) and finite$"):
        OperatorStyle(**{key: bad})
    with pytest.raises(SimError, match=r"^operator: side = nan m must be within ±1 m$"):
        OperatorStyle(side=math.nan)


def test_time_does_not_go_back() -> None:
    operator = Operator(STRAIGHT, PERFECT, np.random.default_rng(0))
    operator.command(2.0, Pose(0, 0, 0))
    with pytest.raises(SimError) as error:
        operator.command(1.0, Pose(0, 0, 0))
    assert str(error.value) == "operator: time 1.0 s is before the last command's 2.0 s"


def test_who_weaves_is_a_third_of_a_metre_aside_and_looks_ten_degrees_off() -> None:
    poses = np.concatenate([lead(STRAIGHT, seed, style_named("weaving")).poses[50:] for seed in range(4)])
    assert poses[:, 1].std() == pytest.approx(0.3, abs=0.08)
    assert np.degrees(poses[:, 2]).std() == pytest.approx(10.0, abs=2.0)


@pytest.mark.parametrize("side", [-0.4, 0.4])
def test_a_lane_beside_the_route_is_kept(side: float) -> None:
    poses = lead(STRAIGHT, 1, OperatorStyle(side=side)).poses[50:]
    assert poses[:, 1].mean() == pytest.approx(side, abs=0.05)


def test_who_or_what_lane_is_not_known_is_told() -> None:
    with pytest.raises(SimError, match=r"^unknown operator style 'hasty': valid are careful, weaving$"):
        style_named("hasty")
    with pytest.raises(SimError, match=r"^operator: side = nan m must be within ±1 m$"):
        OperatorStyle(side=math.nan)
