import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from refseq_bench.sim.sensors.beams import (
    DIVERGENCE,
    EXIT_DIAMETER,
    TURN_TIME,
    LaserSweep,
    ages,
    cones,
    directions,
    sweep,
)
from tests.sim.carried import BEARINGS, SITE, Carried, boxes, room, room_distances, wall_at

MIDDLES = directions()[:, None]
IN_ROOM = Carried(room())
poses = st.tuples(st.floats(-3, 3), st.floats(-2, 2), st.floats(-np.pi, np.pi))


def test_two_turns_of_the_mirror() -> None:
    departure = ages().max() - ages()
    whole, half = departure[::2], departure[1::2]
    assert (len(whole), len(half)) == (181, 180)
    assert np.diff(whole) == pytest.approx(TURN_TIME / 360)
    assert np.diff(half) == pytest.approx(TURN_TIME / 360)
    assert half - (whole[:-1] + whole[1:]) / 2 == pytest.approx(TURN_TIME), "a turn later, at the half degrees"
    assert ages()[359] == 0 == ages().min()
    assert departure.max() + 181 / 360 * TURN_TIME - TURN_TIME / 720 == pytest.approx(2 / 75), "37.5 Hz"


@settings(max_examples=30, deadline=None)
@given(poses)
def test_true_distances_in_a_room_at_rest(pose: tuple[float, float, float]) -> None:
    x, y, heading = pose
    IN_ROOM.place(*pose)
    hits = IN_ROOM.cast(MIDDLES)
    expected = room_distances(x, y, heading + BEARINGS)
    np.testing.assert_allclose(hits.distance[:, 0], expected, rtol=1e-6)
    ends = np.stack([x + expected * np.cos(heading + BEARINGS), y + expected * np.sin(heading + BEARINGS)])
    on_end_wall = np.abs(ends[0]) > 4 - 1e-6
    slant = np.where(on_end_wall, np.cos(heading + BEARINGS), np.sin(heading + BEARINGS))
    np.testing.assert_allclose(hits.cosine[:, 0], np.abs(slant), atol=1e-6)


def test_at_rest_all_beams_leave_from_one_place() -> None:
    IN_ROOM.place(1.0, 0.5, 2.0)
    looks = sweep(IN_ROOM.model, IN_ROOM.data, SITE)
    frame = IN_ROOM.data.site(SITE)
    assert (looks.positions == frame.xpos).all()
    assert (looks.attitudes == frame.xmat.reshape(3, 3)).all()


def test_the_scanner_is_traced_back_to_where_it_was() -> None:
    """Against MuJoCo's own integration of the body that carries it off its centre, rolling and all."""
    spec = mujoco.MjSpec()
    body = spec.worldbody.add_body()
    body.add_freejoint()
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=(0.05, 0, 0))
    body.add_site(name=SITE, pos=(0.3, 0.1, 0.2), quat=(0.9, 0.1, 0.3, 0.2))
    model = spec.compile()
    data = mujoco.MjData(model)
    now = np.array([1.0, 2.0, 0.5, 0.8, 0.0, 0.0, 0.6])
    data.qpos[:], data.qvel[:] = now, (0.4, -0.3, 0.05, 0.2, -0.1, 0.5)
    mujoco.mj_forward(model, data)
    looks = sweep(model, data, SITE)
    for beam in (0, 1, 180, 359, 360):
        then = now.copy()
        mujoco.mj_integratePos(model, then, data.qvel, -ages()[beam])
        data.qpos[:] = then
        mujoco.mj_kinematics(model, data)
        # The site's speed is taken as constant: what its turning about the body adds is less than 0.02 mm.
        np.testing.assert_allclose(looks.positions[beam], data.site(SITE).xpos, atol=5e-5)
        np.testing.assert_allclose(looks.attitudes[beam], data.site(SITE).xmat.reshape(3, 3), atol=1e-9)


@settings(max_examples=20, deadline=None)
@given(poses, st.floats(-1, 1))
def test_while_turning_each_beam_looks_where_the_scanner_faced_when_it_left(
    pose: tuple[float, float, float], turn: float
) -> None:
    x, y, heading = pose
    IN_ROOM.place(*pose, turn=turn)
    expected = room_distances(x, y, heading + BEARINGS - turn * ages())
    np.testing.assert_allclose(IN_ROOM.cast(MIDDLES).distance[:, 0], expected, rtol=1e-6)


@pytest.mark.parametrize("turn", [0.5, -0.5, 0.0])
def test_turning_shows_the_interlacing(turn: float) -> None:
    """The bearing of a straight wall's points says when a beam left: odd ones a turn of the mirror after even ones."""
    carried = Carried(wall_at(3.0))
    carried.place(turn=turn)
    seen = slice(190, 340)
    faced = np.arccos(3.0 / carried.cast(MIDDLES).distance[seen, 0]) - BEARINGS[seen]
    even, odd = faced[::2], faced[1::2]
    between_neighbours = (odd[:-1] - (even[:-1] + even[1:]) / 2)[1:-1]
    assert between_neighbours == pytest.approx(turn * TURN_TIME, abs=1e-6)


@settings(max_examples=20, deadline=None)
@given(poses, st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5)))
def test_while_driving_each_beam_leaves_from_where_the_scanner_was(
    pose: tuple[float, float, float], speed: tuple[float, float]
) -> None:
    x, y, heading = pose
    IN_ROOM.place(*pose, speed=speed)
    measured = IN_ROOM.cast(MIDDLES).distance[:, 0]
    late = np.array([-1, 1])[:, None] * TURN_TIME / 8  # beams cast together share the origin of the middle one
    around = np.array(
        [
            room_distances(x - speed[0] * (ages() + e), y - speed[1] * (ages() + f), heading + BEARINGS)
            for e in late
            for f in late
        ]
    )
    assert (measured >= around.min(axis=0) - 1e-6).all()
    assert (measured <= around.max(axis=0) + 1e-6).all()


def test_driving_towards_a_wall_at_half_a_metre_a_second() -> None:
    carried = Carried(boxes(((3.1, 0.0), (0.1, 50.0)), ((0.0, -3.1), (50.0, 0.1)), ((0.0, 3.1), (50.0, 0.1))))
    carried.place(speed=(0.5, 0.5))
    distance = carried.cast(MIDDLES).distance[:, 0]
    assert distance[0] - 3.0 == pytest.approx(0.5 * -20e-3, abs=6e-4), "the oldest beam, to the right, was nearer there"
    assert distance[180] - distance[181] * np.cos(BEARINGS[181]) == pytest.approx(0.5 * TURN_TIME, abs=9e-4)
    assert distance[359] * np.cos(np.radians(0.5)) == pytest.approx(3.0, abs=6e-4)


@pytest.mark.parametrize("distance", [0.5, 2.0, 10.0, 60.0])
def test_a_beam_s_rays_fill_its_spot(distance: float) -> None:
    rays = cones(np.full(361, distance))
    radius = (EXIT_DIAMETER + DIVERGENCE * distance) / 2
    np.testing.assert_allclose(np.linalg.norm(rays, axis=2), 1.0)
    np.testing.assert_allclose(rays[:, 0], directions(), atol=1e-12)
    spot = rays[180] / rays[180, :, :1] * distance  # where the beam ahead meets a wall
    across, up = spot[:, 1], spot[:, 2]
    assert np.diff(np.sort(across)) == pytest.approx(np.full(6, np.ptp(across) / 6)), "an edge takes them one by one"
    assert (across.mean(), up.mean(), (across * up).mean()) == pytest.approx((0, 0, 0), abs=1e-12)
    # A disc of radius R has mean squares of R²/4 along each axis.
    assert (across**2).mean() == pytest.approx(radius**2 / 4, rel=0.03)
    assert (up**2).mean() == pytest.approx(radius**2 / 4, rel=0.03)


def test_a_neighbour_s_near_thing_sets_the_size_of_the_spot() -> None:
    distances = np.full(361, 20.0)
    distances[100] = 1.0
    distances[300] = np.inf
    spread = np.linalg.norm(cones(distances)[:, 1] - directions(), axis=1)
    assert spread[[99, 100, 101]] == pytest.approx(spread[100])
    assert spread[98] == pytest.approx(spread[102])
    assert spread[98] < 0.5 * spread[99]
    assert spread[300] == pytest.approx(spread[299])


def test_parts_of_a_cast_do_not_mix_up_beams() -> None:
    """One ray at a time, by the function for a single ray, from where each beam left."""
    IN_ROOM.place(1.0, -0.5, 0.7, speed=(0.0, 0.0), turn=0.8)
    looks: LaserSweep = sweep(IN_ROOM.model, IN_ROOM.data, SITE)
    rays = cones(np.full(361, 3.0))
    hits, geom = IN_ROOM.cast(rays), np.empty(1, np.int32)
    for beam in range(0, 361, 7):
        for ray in range(rays.shape[1]):
            vector = looks.attitudes[beam] @ rays[beam, ray]
            alone = mujoco.mj_ray(IN_ROOM.model, IN_ROOM.data, looks.positions[beam], vector, None, True, 1, geom)
            assert hits.distance[beam, ray] == pytest.approx(alone, rel=1e-9)
            assert hits.geom[beam, ray] == geom[0]
