import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from refseq_bench.sim.sensors.beams import DIVERGENCE, EXIT_DIAMETER
from refseq_bench.sim.sensors.laser_echoes import (
    DARK_SHIFT,
    PANE_LOBE,
    PANE_REMISSION,
    PANE_TRANSMISSION,
    PULSE,
    THRESHOLD,
    UNKNOWN_REMISSION,
    Light,
    first_echo,
)
from tests.sim.carried import BEARINGS, Carried, add_box, boxes, room, room_distances, wall_at

AHEAD = 180
IN_ROOM = Carried(room())


def answer(*sources: tuple[float, float]) -> tuple[float, float]:
    """What the receiver makes of (distance [m], power in thresholds)."""
    distance, power = np.array(sources).T
    echoes = first_echo(Light(distance[None], power[None] * THRESHOLD))
    return float(echoes.distance[0]), float(echoes.power[0] / THRESHOLD)


def slowly(distance: NDArray[np.float64], power: NDArray[np.float64]) -> float:
    """The first echo, as told in words: one source after the other."""
    for first, own in sorted(zip(distance, power, strict=True)):
        near = [(d, p) for d, p in zip(distance, power, strict=True) if first <= d <= first + PULSE]
        whole = sum(p for _, p in near)
        if own > 0 and whole >= THRESHOLD:
            return sum(d * p for d, p in near) / whole
    return math.inf


# --- one echo of several ---


def test_of_two_near_surfaces_the_range_is_the_mean_by_power() -> None:
    assert answer((2.0, 5.0), (2.4, 5.0)) == pytest.approx((2.2, 10.0))
    assert answer((2.0, 9.0), (2.4, 1.0)) == pytest.approx((2.04, 10.0))


def test_of_two_distant_surfaces_the_range_is_the_nearer_s() -> None:
    assert answer((2.0, 1.5), (2.6, 50.0)) == pytest.approx((2.0, 1.5))


def test_a_near_surface_that_is_too_weak_is_missed() -> None:
    assert answer((2.0, 0.9), (2.6, 50.0)) == pytest.approx((2.6, 50.0))


def test_weak_surfaces_together_are_seen() -> None:
    assert answer((2.0, 0.6), (2.4, 0.6)) == pytest.approx((2.2, 1.2))


def test_too_little_light_is_no_echo() -> None:
    assert answer((2.0, 0.6), (2.6, 0.6)) == pytest.approx((math.inf, 1.2))
    assert answer((0.0, 0.0), (0.0, 0.0)) == (math.inf, 0.0)
    # Three that a pulse does not reach over, though it does from the one in the middle to either side.
    assert answer((5.0, 0.4), (5.4, 0.4), (5.8, 0.4)) == pytest.approx((math.inf, 1.2))


@settings(max_examples=100, deadline=None)
@given(
    st.lists(st.tuples(st.floats(0.1, 3.0), st.sampled_from([0.0, 0.3, 0.7, 1.5, 20.0])), min_size=1, max_size=8),
)
def test_the_first_echo_is_the_one_told_in_words(sources: list[tuple[float, float]]) -> None:
    distance, power = np.array(sources).T
    echoes = first_echo(Light(distance[None], power[None] * THRESHOLD))
    assert echoes.distance[0] == pytest.approx(slowly(distance, power * THRESHOLD))


# --- spots at edges ---


def stepped(edge: float, gap: float) -> Carried:
    """A board at 3 m that ends at ``edge`` [m] to the left of the middle beam, ``gap`` before a wall."""
    board = ((3.001, edge - 5.0), (0.001, 5.0))
    return Carried(boxes(board, ((3.1 + gap, 0.0), (0.1, 50.0)), userdata=[0.5]))


SPOT = (EXIT_DIAMETER + DIVERGENCE * 3.0) / 2


def share_below(edge: float) -> float:
    """Area of a disc of the spot's radius to the right of a line at ``edge``, as a share."""
    u = np.clip(edge / SPOT, -1, 1)
    return float(0.5 + (u * math.sqrt(1 - u * u) + math.asin(u)) / math.pi)


@pytest.mark.parametrize("gap", [0.12, 0.2, 0.35, 0.48])
def test_an_edge_mixes_near_and_far_by_their_shares_of_the_spot(gap: float) -> None:
    for edge in np.linspace(-1.2, 1.2, 13) * SPOT:
        near = share_below(edge)
        # Light from far falls with the square of its distance.
        bright = (near / 9.0, (1 - near) / (3 + gap) ** 2)
        expected = (3.0 * bright[0] + (3 + gap) * bright[1]) / sum(bright)
        assert stepped(edge, gap).echoes().distance[AHEAD] == pytest.approx(expected, abs=1e-3 + gap / 9)


def test_mixed_pixels_go_over_from_near_to_far_step_by_step() -> None:
    ranges = [stepped(edge, 0.3).echoes().distance[AHEAD] for edge in np.linspace(1.1, -1.1, 45) * SPOT]
    assert (np.diff(ranges) > -1e-9).all()
    assert (ranges[0], ranges[-1]) == pytest.approx((3.0, 3.3), abs=1e-4)
    assert len(np.unique(np.round(ranges, 3))) == 8, "seven rays change over one by one"


def test_mixed_pixels_are_at_edges_only() -> None:
    carried = stepped(0.0, 0.3)
    y = 3.0 * np.tan(BEARINGS)
    inside = np.abs(BEARINGS) < np.radians(60)
    exact = np.where(y < 0, 3.0, 3.3) / np.cos(BEARINGS)
    # A board's edge hides what is behind it from beams to its right, up to the spot's own size.
    far_from_edge = inside & (np.abs(y) > 2 * SPOT)
    distance = carried.echoes().distance
    np.testing.assert_allclose(distance[far_from_edge], exact[far_from_edge], atol=1e-3)
    mixed = inside & (np.minimum(np.abs(distance - 3.0 / np.cos(BEARINGS)), np.abs(distance - exact)) > 0.01)
    assert np.flatnonzero(mixed).tolist() == [AHEAD]


def test_beyond_a_pulse_s_length_the_nearer_side_wins_whole() -> None:
    far = PULSE + 0.1
    ranges = np.array([stepped(edge, far).echoes().distance[AHEAD] for edge in np.linspace(-1.1, 1.1, 23) * SPOT])
    assert set(np.round(ranges, 3)) == {3.0, 3.0 + far}
    assert (ranges[12:] < 3.001).all(), "an object looks larger by up to half a spot"
    assert (ranges[8:12] < 3.001).all()


@settings(max_examples=25, deadline=None)
@given(st.floats(-3, 3), st.floats(-2, 2), st.floats(-np.pi, np.pi))
def test_in_a_room_every_range_is_one_within_the_spot(x: float, y: float, heading: float) -> None:
    IN_ROOM.place(x, y, heading)
    distance = IN_ROOM.echoes().distance
    exact = room_distances(x, y, heading + BEARINGS)
    nearest = np.min([np.roll(exact, -1), exact, np.roll(exact, 1)], axis=0)
    spread = (EXIT_DIAMETER / nearest + DIVERGENCE) / 2
    within = np.array([room_distances(x, y, heading + BEARINGS + part * spread) for part in np.linspace(-1, 1, 41)])
    assert (distance >= within.min(axis=0) - 1e-3).all()
    assert (distance <= within.max(axis=0) + 1e-3).all()
    assert np.median(np.abs(distance - exact)) < 1e-3


# --- how much comes back ---


@pytest.mark.parametrize("remission", [0.024, 0.1, 0.2, 0.4, 0.6])
def test_darker_things_are_seen_less_far(remission: float) -> None:
    reach = 30.0 * math.sqrt(remission / 0.1)
    shift = DARK_SHIFT * max(0.0, math.log10(0.2 / remission))
    seen = Carried(wall_at(0.995 * reach, userdata=[remission])).echoes()
    assert seen.distance[AHEAD] == pytest.approx(0.995 * reach - shift, abs=1e-3)
    missed = Carried(wall_at(1.005 * reach, userdata=[remission])).echoes()
    assert math.isinf(missed.distance[AHEAD])
    assert 0.98 * THRESHOLD < missed.power[AHEAD] < THRESHOLD


@given(st.floats(0.5, 25.0), st.floats(0.05, 1.8))
@settings(max_examples=15, deadline=None)
def test_power_falls_with_the_square_of_the_distance(distance: float, remission: float) -> None:
    power = Carried(wall_at(distance, userdata=[remission])).echoes().power[AHEAD]
    assert power == pytest.approx(remission / distance**2, rel=1e-3)


def test_power_falls_with_the_cosine_of_incidence() -> None:
    seen = slice(60, 301)  # up to 60° to either side
    power = Carried(wall_at(2.0, userdata=[0.8])).echoes().power[seen]
    # One cosine is Lambert's, two are the longer way.
    np.testing.assert_allclose(power, 0.8 / 4 * np.cos(BEARINGS[seen]) ** 3, rtol=2e-3)


def test_each_surface_has_its_own_remission() -> None:
    spec = wall_at(3.0, userdata=[0.8])
    add_box(spec, (2.1, 1.0), (0.1, 0.5), userdata=[0.2])
    add_box(spec, (2.1, -1.0), (0.1, 0.5))
    power = Carried(spec).echoes().power
    left, right = AHEAD + 52, AHEAD - 52  # 26° to either side
    slant = np.cos(BEARINGS[left]) ** 3
    expected = [0.8 / 9, 0.2 / 4 * slant, UNKNOWN_REMISSION / 4 * slant]
    assert power[[AHEAD, left, right]] == pytest.approx(expected, rel=2e-3)


def test_what_does_not_state_its_remission_has_the_usual_one() -> None:
    silent = wall_at(2.0)
    assert Carried(silent).echoes().power[AHEAD] == pytest.approx(UNKNOWN_REMISSION / 4, rel=1e-3)
    without_user_values = wall_at(2.0)
    without_user_values.nuser_geom = 0
    carried = Carried(without_user_values)
    assert carried.model.nuser_geom == 0
    assert carried.echoes().power[AHEAD] == pytest.approx(UNKNOWN_REMISSION / 4, rel=1e-3)


@pytest.mark.parametrize(("remission", "short"), [(1.0, 0.0), (0.2, 0.0), (0.1, 0.00301), (0.02, 0.01), (0.002, 0.02)])
def test_dark_things_look_nearer(remission: float, short: float) -> None:
    distance = Carried(wall_at(2.0, userdata=[remission])).echoes().distance[AHEAD]
    assert 2.0 - distance == pytest.approx(short, abs=1e-4)


# --- glass ---


def glazed(pane_x: float = 2.0, wall_x: float = 4.0) -> Carried:
    """A pane before a wall, both square to the middle beam."""
    spec = wall_at(wall_x, userdata=[0.5])
    add_box(spec, (pane_x + 0.003, 0.0), (0.003, 50.0), group=4, contype=0, conaffinity=0, rgba=(1, 1, 1, 0.1))
    return Carried(spec)


def test_glass_is_looked_through_but_answers_when_met_squarely() -> None:
    echoes = glazed().echoes()
    square = np.abs(BEARINGS) < PANE_LOBE - np.radians(0.3)
    slanted = (np.abs(BEARINGS) > PANE_LOBE + np.radians(0.3)) & (np.abs(BEARINGS) < np.radians(70))
    assert square.sum() == 3
    np.testing.assert_allclose(echoes.distance[square], 2.0 / np.cos(BEARINGS[square]), atol=1e-3)
    assert echoes.power[AHEAD] == pytest.approx(PANE_REMISSION / 4, rel=1e-3)
    # Up to 70° the spread of a spot along the wall hardly matters.
    np.testing.assert_allclose(echoes.distance[slanted], 4.0 / np.cos(BEARINGS[slanted]), rtol=1e-3)


def test_light_is_lost_on_both_ways_through_glass() -> None:
    behind, bare = glazed().echoes().power, Carried(wall_at(4.0, userdata=[0.5])).echoes().power
    slanted = slice(190, 300)
    np.testing.assert_allclose(behind[slanted], PANE_TRANSMISSION**2 * bare[slanted], rtol=1e-9)


def test_glass_shortens_the_reach() -> None:
    reach = 30.0 * math.sqrt(0.5 / 0.1)
    spec = wall_at(0.9 * reach, userdata=[0.5])
    assert np.isfinite(Carried(spec.copy()).echoes().distance[AHEAD])
    turned = (math.cos(0.1), 0, 0, math.sin(0.1))  # 11° off square
    add_box(spec, (2.0, 0.0), (0.003, 1.0), group=4, quat=turned, rgba=(1, 1, 1, 0.1))
    assert np.isinf(Carried(spec).echoes().distance[AHEAD])


def test_glass_behind_a_wall_does_nothing() -> None:
    bare, hidden = Carried(wall_at(4.0, userdata=[0.5])).echoes(), glazed(pane_x=4.3).echoes()
    np.testing.assert_array_equal(bare.distance, hidden.distance)
    np.testing.assert_array_equal(bare.power, hidden.power)


def test_before_the_open_only_the_square_part_of_a_pane_is_seen() -> None:
    echoes = glazed(wall_x=300.0).echoes()
    assert np.isfinite(echoes.distance).sum() in (3, 5)
    assert (echoes.power[:170] == 0).all()
