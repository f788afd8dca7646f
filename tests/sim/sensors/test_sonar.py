import math
from collections.abc import Sequence

import mujoco
import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from refseq.planar import Pose
from refseq_bench import robots
from refseq_bench.robots.robuter import sonars
from refseq_bench.sim.acceptance.floor import FLOOR
from refseq_bench.sim.bench.assembly import OPTIONS
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.sim.sensors.beams import SEEN_GROUPS
from refseq_bench.sim.sensors.sonar import SonarModel, SonarRing
from refseq_bench.sim.sensors.ultrasound import INNER_RAYS, RAYS, FlatFaces, mirror_points
from refseq_bench.worlds.build import build_world
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.plans.load import parse_plan

BOX, CYLINDER = mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_CYLINDER
MOST = 10.668
EXACT = SonarModel(sigma=0.0, lost=0.0, random=0.0)


def scene() -> mujoco.MjSpec:
    """Empty space around a ``base`` whose shell is all around its rangers."""
    spec = mujoco.MjSpec()
    base = spec.worldbody.add_body(name="base")
    base.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=(0.05, 0, 0), group=3)
    return spec


def ring_in(
    spec: mujoco.MjSpec, places: Sequence[tuple[float, float]] = ((0.0, 0.0),), model: SonarModel = EXACT, seed: int = 0
) -> tuple[SonarRing, mujoco.MjData]:
    """Rangers that look along x from places (y, z) [m]."""
    for number, (y, z) in enumerate(places):
        spec.body("base").add_site(name=f"s{number}", pos=(0, y, z))
    compiled = spec.compile()
    data = mujoco.MjData(compiled)
    mujoco.mj_forward(compiled, data)
    names = tuple(f"s{number}" for number in range(len(places)))
    return SonarRing(model, np.random.default_rng(seed), compiled, names, "base"), data


def reading(spec: mujoco.MjSpec) -> float:
    ring, data = ring_in(spec)
    return float(ring.read(data)[0])


def with_wall(normal: Sequence[float], distance: float, half: float = 50.0, group: int = 3) -> mujoco.MjSpec:
    """A wall whose face is at ``distance`` and whose foot lies along ``normal``, towards it."""
    spec, outward = scene(), np.asarray(normal) / np.linalg.norm(normal)
    turn = Rotation.align_vectors([outward], [[1.0, 0.0, 0.0]])[0].as_quat(scalar_first=True)
    pos = outward * (distance + 0.05)
    spec.worldbody.add_geom(type=BOX, size=(0.05, half, half), pos=pos, quat=turn, group=group)
    return spec


def off_axis(angle: float, around: float) -> tuple[float, float, float]:
    return math.cos(angle), math.sin(angle) * math.cos(around), math.sin(angle) * math.sin(around)


angles = st.floats(-math.pi, math.pi)


@settings(max_examples=60, deadline=None)
@given(st.floats(0, math.radians(41.9)), angles, st.floats(0.2, 10.6))
@example(0.625, 0.0, 10.5)  # rays along the axis meet the wall beyond the farthest range
def test_a_wall_answers_from_the_foot_of_the_perpendicular(tilt: float, around: float, distance: float) -> None:
    assert reading(with_wall(off_axis(tilt, around), distance)) == pytest.approx(distance, abs=1e-6)


@settings(max_examples=60, deadline=None)
@given(st.floats(math.radians(42.1), math.radians(89)), angles, st.floats(0.2, 10.0))
def test_a_wall_slanted_beyond_the_side_lobes_does_not_answer(tilt: float, around: float, distance: float) -> None:
    assert reading(with_wall(off_axis(tilt, around), distance)) == MOST


def test_a_wall_out_of_reach_does_not_answer() -> None:
    assert reading(with_wall((1, 0, 0), 10.7)) == MOST
    assert reading(with_wall((1, 0, 0), 10.6)) == pytest.approx(10.6)
    ring, data = ring_in(with_wall((1, 0, 0), 10.7))
    assert ring.distances(data, np.array([0])).tolist() == [math.inf], "nor is it what the longest range is read of"


def test_nothing_is_heard_in_empty_space() -> None:
    assert reading(scene()) == MOST


def test_a_slanted_wall_that_ends_before_its_foot_does_not_answer_like_a_mirror() -> None:
    """Of a wall at 30° only a piece about the axis is left: it answers from there, not from the foot."""
    spec, outward = scene(), np.array(off_axis(math.radians(30), 0.0))
    quat = Rotation.from_euler("z", 30, degrees=True).as_quat(scalar_first=True)
    centre = np.array([2.0, 0.0, 0.0])
    spec.worldbody.add_geom(type=BOX, size=(0.05, 0.3, 0.3), pos=centre + 0.05 * outward, quat=quat, group=3)
    foot = 2.0 * math.cos(math.radians(30))
    nearest = np.linalg.norm(centre + 0.3 * np.array([-0.5, math.cos(math.radians(30)), 0.0]))
    assert foot + 0.05 < nearest
    assert nearest - 1e-6 <= reading(spec) <= 2.0


def with_post(bearing: float, distance: float, radius: float) -> mujoco.MjSpec:
    spec = scene()
    pos = (distance * math.cos(bearing), distance * math.sin(bearing), 0.0)
    spec.worldbody.add_geom(type=CYLINDER, size=(radius, 20.0, 0), pos=pos, group=3)
    return spec


@settings(max_examples=60, deadline=None)
@given(st.floats(-math.radians(13), math.radians(13)), st.floats(0.4, 4.0), st.floats(0.05, 0.15))
@example(0.125, 3.0, 0.0546875)  # rays that are even over the cone leave a gap here as seen from above
def test_a_post_in_the_nominal_cone_is_heard(bearing: float, distance: float, radius: float) -> None:
    """By a ray that is up to 15° above or below the horizontal, so from up to 1/cos 15° = 1.035 of the distance."""
    assert distance - radius - 1e-9 <= reading(with_post(bearing, distance, radius)) <= 1.036 * distance


def test_rays_of_the_nominal_cone_are_even_as_seen_from_above() -> None:
    inner = RAYS[:INNER_RAYS]
    bearings = np.degrees(np.arctan2(inner[:, 1], inner[:, 0]))
    np.testing.assert_allclose(np.diff(np.r_[-15.0, bearings, 15.0])[1:-1], 30 / INNER_RAYS)
    assert np.degrees(np.arccos(inner[:, 0])).max() < 15.0
    up = np.degrees(np.arcsin(np.sort(inner[:, 2])))
    assert np.diff(up).max() < 3.0, "tops of tables are hit as well"


@settings(max_examples=60, deadline=None)
@given(st.floats(math.radians(15), math.radians(80)), st.sampled_from([-1, 1]), st.floats(0.4, 4.0))
def test_a_post_out_of_the_nominal_cone_is_not_heard(angle: float, side: int, distance: float) -> None:
    radius = 0.05
    assume(angle - math.asin(radius / distance) > math.radians(15.1))
    # A ray that by chance meets it squarely hears a wall; a post is no wall to nearly all.
    assert reading(with_post(side * angle, distance, radius)) == MOST


def with_two_walls(between: float, towards: float, distance: float) -> mujoco.MjSpec:
    """Two walls that enclose the angle ``between``; their edge is at ``distance`` ahead and the angle's middle is
    turned by ``towards`` from straight at the ranger."""
    spec = scene()
    for side in (-1, 1):
        along = math.pi + towards + side * between / 2  # from the edge along the wall
        direction = np.array([math.cos(along), math.sin(along)])
        outward = side * np.array([-direction[1], direction[0]])
        centre = np.array([distance, 0.0]) + 19.9 * direction + 0.05 * outward  # past the edge: no slit is left there
        quat = Rotation.from_euler("z", along).as_quat(scalar_first=True)
        spec.worldbody.add_geom(type=BOX, size=(20.0, 0.05, 20.0), pos=(*centre, 0), quat=quat, group=3)
    return spec


@pytest.mark.parametrize("distance", [0.5, 2.0, 7.0])
@pytest.mark.parametrize("towards", [0.0, 1.5, -2.0])
def test_a_corner_throws_sound_back_from_its_edge(distance: float, towards: float) -> None:
    """Both walls are slanted by 43° to 47°, so neither answers alone."""
    assert reading(with_two_walls(math.pi / 2, math.radians(towards), distance)) == pytest.approx(distance, abs=0.01)


@given(st.floats(87.5, 92.5), st.floats(1.0, 10.0), st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
def test_the_way_to_a_corner_ends_on_both_walls(between: float, distance: float, aside: float, up: float) -> None:
    """And is the shortest that does: it has nothing of the edge's own direction."""
    angle = math.radians(between)
    normals = np.array([[-math.sin(angle / 2), side * math.cos(angle / 2), 0.0] for side in (-1, 1)])
    edge = np.array([distance, 0.1 * aside, 0.0])
    # A point on each wall, on the ranger's side of the other.
    along = np.array([[-math.cos(angle / 2), -side * math.sin(angle / 2), 0.0] for side in (-1, 1)])
    points = edge + 0.2 * along + [0.0, 0.0, up]
    faces = FlatFaces(np.zeros(2, np.intp), normals, -(normals @ edge), points)
    _, ways = mirror_points(faces)
    (corner,) = [way for way in ways if np.allclose(normals @ (way - edge), 0.0, atol=1e-9)]
    assert corner == pytest.approx(edge)


@pytest.mark.parametrize("between", [60.0, 75.0])
def test_walls_that_meet_at_another_angle_do_not(between: float) -> None:
    assert reading(with_two_walls(math.radians(between), 0.0, 2.0)) == MOST


def test_the_outside_of_a_corner_does_not() -> None:
    spec = scene()
    quat = Rotation.from_euler("z", 45, degrees=True).as_quat(scalar_first=True)
    spec.worldbody.add_geom(type=BOX, size=(1.0, 1.0, 1.0), pos=(3.0, 0, 0), quat=quat, group=3)
    assert reading(spec) == MOST


def test_the_nearest_echo_counts() -> None:
    spec = with_wall((1, 0, 0), 3.0)
    spec.worldbody.add_geom(type=CYLINDER, size=(0.1, 1, 0), pos=(1.5, 0.1, 0), group=3)
    assert 1.4 <= reading(spec) < 1.5


def test_a_thing_before_a_foot_hides_it() -> None:
    """A black box at 35° before the foot of a slanted wall: nothing is left to hear."""
    spec = with_wall(off_axis(math.radians(35), 0.0), 3.0)
    assert reading(spec) == pytest.approx(3.0)
    hidden = with_wall(off_axis(math.radians(35), 0.0), 3.0)
    pos = 2.0 * np.array(off_axis(math.radians(35), 0.0))
    quat = Rotation.from_euler("z", 80, degrees=True).as_quat(scalar_first=True)
    hidden.worldbody.add_geom(type=BOX, size=(0.2, 0.2, 0.2), pos=pos, quat=quat, group=3)
    assert reading(hidden) > 3.05


def test_a_person_is_heard_by_every_ranger_whose_cone_meets_one() -> None:
    """Somebody 1.5 m before the bumper; what a cone meets, and how near, is what thousands of rays in it find."""
    someone = '[[person]]\nname = "ana"\nat = [1.8, 0.15]\nheading = 90\n'
    world = build_world(
        parse_plan(FLOOR.replace("[routes]", f"{someone}[routes]")), light_named("overcast"), pictured=False
    )
    with Bench(world, robots.load("robuter"), settings=BenchSettings(renderer=RendererKind.NONE)) as bench:
        bench.place(Pose(0.0, 0.0, 0.0))
        model, data = bench.model, bench.data
        names = tuple(f"robuter/{name}" for name in sonars.SONARS)
        readings = SonarRing(EXACT, np.random.default_rng(0), model, names, "robuter/base").read(data)
        nearest = np.array([nearest_in_cone(model, data, name) for name in names])
    front = list(sonars.FRONT_SONARS)
    assert (nearest[front] < 2.0).all()
    assert (readings[front] >= nearest[front] - 1e-3).all()
    assert (readings[front] <= nearest[front] + 0.1).all()
    assert (np.delete(readings, front) == MOST).all()


def nearest_in_cone(model: mujoco.MjModel, data: mujoco.MjData, site: str) -> float:
    """Distance to the nearest thing of the world, other than the floor, in the nominal cone [m]."""
    angles = np.radians(np.arange(-15, 15.01, 0.4))
    offsets = np.array([(a, b) for a in angles for b in angles if math.hypot(a, b) <= math.radians(15)])
    local = np.column_stack([np.cos(np.hypot(*offsets.T)), np.sin(offsets)])
    rays, place = local @ data.site(site).xmat.reshape(3, 3).T, data.site(site)
    count = len(rays)
    geom, distance = np.empty(count, np.int32), np.empty(count)
    base = model.body("robuter/base").id
    mujoco.mj_multiRay(
        model, data, place.xpos, rays.ravel(), SEEN_GROUPS, True, base, geom, distance, None, count, MOST
    )
    upright = (geom >= 0) & (place.xpos[2] + distance * rays[:, 2] > 0.01)
    return float(distance[upright].min(initial=math.inf))


@pytest.mark.parametrize(("group", "heard"), [(0, True), (1, True), (2, False), (3, True), (4, True), (5, False)])
def test_solids_and_panes_answer_and_what_is_only_seen_does_not(group: int, heard: bool) -> None:
    assert reading(with_wall((1, 0, 0), 2.0, group=group)) == (pytest.approx(2.0) if heard else MOST)


def test_what_is_too_near_is_reported_at_the_nearest_range() -> None:
    assert reading(with_wall((1, 0, 0), 0.1)) == 0.15


def draws(spec: mujoco.MjSpec, model: SonarModel, firings: int, seed: int = 0) -> np.ndarray:
    """Readings of 24 rangers in one place at so many moments, (firings, 24)."""
    ring, data = ring_in(spec, [(0.0, 0.0)] * 24, model, seed)
    rows = []
    for number in range(firings):
        data.time = number * model.listening
        rows.append(ring.read(data))
    return np.array(rows)


@pytest.fixture(scope="module")
def of_a_wall() -> np.ndarray:
    return draws(with_wall((1, 0, 0), 5.0), SonarModel(groups=1), 500).ravel()


def test_readings_spread_and_fail_as_often_as_the_figures_say(of_a_wall: np.ndarray) -> None:
    count, near = len(of_a_wall), of_a_wall[np.abs(of_a_wall - 5.0) < 0.4]
    assert np.std(near) == pytest.approx(0.05, rel=0.03)
    assert np.mean(near) == pytest.approx(5.0, abs=3 * 0.05 / math.sqrt(count))
    lost, stray = np.sum(of_a_wall == MOST), np.sum((np.abs(of_a_wall - 5.0) >= 0.4) & (of_a_wall < MOST))
    assert lost == pytest.approx(0.01 * count, abs=3 * math.sqrt(0.01 * count))
    share = 0.005 * (1 - 0.8 / (MOST - 0.15))  # of the random ones some come near the wall
    assert stray == pytest.approx(share * count, abs=3 * math.sqrt(share * count))


def test_random_readings_are_spread_evenly() -> None:
    strays = draws(scene(), SonarModel(groups=1, random=0.5), 40).ravel()
    strays = strays[strays < MOST]
    assert len(strays) == pytest.approx(480, abs=60)
    quarters = np.histogram(strays, 4, (0.15, MOST))[0]
    assert quarters.min() > 0.7 * len(strays) / 4


def test_noise_does_not_depend_on_the_scene() -> None:
    near, far = (draws(with_wall((1, 0, 0), d), SonarModel(groups=1), 20, seed=3) for d in (2.0, 6.0))
    told = (near != far) & (near < MOST)
    assert told.sum() > 450
    np.testing.assert_allclose(far[told] - near[told], 4.0)
    silent = draws(scene(), SonarModel(groups=1), 20, seed=3)
    np.testing.assert_array_equal(silent[near == far], near[near == far])


def test_readings_repeat_by_seed() -> None:
    first, again, other = (draws(with_wall((1, 0, 0), 2.0), SonarModel(), 9, seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()


def test_groups_take_turns() -> None:
    model = SonarModel()
    assert model.listening == pytest.approx(0.0622, abs=1e-4)
    rows = draws(with_wall((1, 0, 0), 2.0), model, 13)
    assert (rows[0] < 3.0).sum() >= 20, "all have fired before the start"
    for number in range(1, 13):
        changed = np.flatnonzero(rows[number] != rows[number - 1])
        assert set(changed % 6) == {number % 6}


def test_between_firings_nothing_changes() -> None:
    ring, data = ring_in(with_wall((1, 0, 0), 2.0), [(0, 0)] * 24, SonarModel())
    before = ring.read(data)
    data.time = 0.9 * ring.model.listening
    assert ring.read(data) is before
    assert not before.flags.writeable
    data.time = 1.1 * ring.model.listening
    assert ring.read(data) is not before


def test_after_a_pause_every_ranger_fires_once(monkeypatch: pytest.MonkeyPatch) -> None:
    ring, data = ring_in(with_wall((1, 0, 0), 2.0), [(0, 0)] * 24, SonarModel())
    before, fired = ring.read(data), list[int]()
    distances = ring.distances

    def noted(data: mujoco.MjData, group: NDArray[np.intp]) -> NDArray[np.float64]:
        fired.extend(group.tolist())
        return distances(data, group)

    monkeypatch.setattr(ring, "distances", noted)
    data.time = 100.0
    assert (ring.read(data) != before).all()
    assert sorted(fired) == list(range(24))
    late = ring.read(data)
    data.time = 0.0
    assert (ring.read(data) != late).any(), "nor does it stop when somebody sets the clock back"


def test_rangers_that_fire_together_hear_each_other_only_where_asked() -> None:
    """A post before the first, outside the second's nominal cone; behind it nothing."""
    spec = scene()
    spec.worldbody.add_geom(type=CYLINDER, size=(0.05, 1.0, 0), pos=(1.0, 0.0, 0), group=3)
    aside = [(0.0, 0.0), (0.5, 0.0)]
    alone, data = ring_in(spec, aside, EXACT)
    assert alone.read(data).tolist() == [pytest.approx(0.95, abs=0.01), MOST]
    spec = scene()
    spec.worldbody.add_geom(type=CYLINDER, size=(0.05, 1.0, 0), pos=(1.0, 0.0, 0), group=3)
    quiet = {"sigma": 0.0, "lost": 0.0, "random": 0.0, "cross_talk": True}
    together, data = ring_in(spec, aside, SonarModel(**quiet, groups=1))
    own, heard = together.read(data)
    assert own == pytest.approx(0.95, abs=0.01)
    assert heard == pytest.approx((0.95 + math.hypot(0.95, 0.5)) / 2, abs=0.02)
    spec = scene()
    spec.worldbody.add_geom(type=CYLINDER, size=(0.05, 1.0, 0), pos=(1.0, 0.0, 0), group=3)
    in_turn, data = ring_in(spec, aside, SonarModel(**quiet, groups=2))
    assert in_turn.read(data)[1] == MOST


@pytest.mark.parametrize("cross_talk", [False, True])
def test_of_more_groups_than_rangers_some_are_silent(cross_talk: bool) -> None:
    model = SonarModel(sigma=0.0, lost=0.0, random=0.0, groups=100, cross_talk=cross_talk)
    ring, data = ring_in(with_wall((1, 0, 0), 2.0), [(0.0, 0.0), (0.5, 0.0)], model)
    assert ring.read(data) == pytest.approx([2.0, 2.0], abs=1e-6)


def test_a_ranger_that_is_nowhere_reads_something() -> None:
    ring, data = ring_in(with_wall((1, 0, 0), 2.0))
    data.site_xpos[:] = math.nan
    data.site_xmat[:] = math.nan
    assert 0.15 <= ring.read(data)[0] <= MOST


def test_the_robuters_rangers_look_outwards_and_are_numbered_counter_clockwise() -> None:
    model = robots.load("robuter").spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    places = np.array([data.site(name).xpos[:2] for name in sonars.SONARS])
    looks = np.array([data.site(name).xmat.reshape(3, 3)[:2, 0] for name in sonars.SONARS])
    assert len(places) == 24
    around = np.unwrap(np.arctan2(*(places - (-0.225, 0.0)).T[::-1]))
    assert (np.diff(around) > 0).all()
    assert around[-1] - around[0] < 2 * math.pi
    for side, look in (("FRONT", (1, 0)), ("LEFT", (0, 1)), ("REAR", (-1, 0)), ("RIGHT", (0, -1))):
        mine = list(getattr(sonars, f"{side}_SONARS"))
        np.testing.assert_allclose(looks[mine], [look] * 6, atol=1e-9)
        # Each row is the outermost of the robot on its side but for bumpers and wheels.
        np.testing.assert_allclose(places[mine] @ look, (places @ look).max(), atol=1e-9)


def test_the_robuter_in_a_box_reads_the_walls() -> None:
    """3 m ahead, 2 m to the left, 4 m behind and 1.5 m to the right of its frame; it sees no part of itself."""
    robot, world = robots.load("robuter"), mujoco.MjSpec()
    for option in OPTIONS:
        setattr(world.option, option, getattr(robot.spec.option, option))
    for pos, size in (
        ((3.1, 0, 1), (0.1, 9, 1)),
        ((0, 2.1, 1), (9, 0.1, 1)),
        ((-4.1, 0, 1), (0.1, 9, 1)),
        ((0, -1.6, 1), (9, 0.1, 1)),
    ):
        world.worldbody.add_geom(type=BOX, pos=pos, size=size)
    world.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=(0, 0, 1))
    world.attach(robot.spec, frame=world.worldbody.add_frame(), prefix="r/")
    model = world.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    names = tuple(f"r/{name}" for name in robot.sonars)
    readings = SonarRing(EXACT, np.random.default_rng(0), model, names, "r/base").read(data)
    expected = np.repeat([3 - 0.275, 2 - 0.27, 4 - 0.725, 1.5 - 0.27], 6)
    np.testing.assert_allclose(readings, expected, atol=1e-6)


@pytest.mark.parametrize(
    ("figures", "message"),
    [
        ({"min_range": 11.0}, "sonar: min_range = 11.0 m must be in [0, max_range = 10.668 m)"),
        ({"max_range": math.inf}, "sonar: min_range = 0.15 m must be in [0, max_range = inf m)"),
        ({"sigma": -0.1}, "sonar: sigma = -0.1 m must be 0 or more, and finite"),
        ({"lost": 0.8, "random": 0.3}, "sonar: lost = 0.8 and random = 0.3 must be shares of at most 1 together"),
        ({"lost": math.nan}, "sonar: lost = nan and random = 0.005 must be shares of at most 1 together"),
        ({"groups": 0}, "sonar: groups = 0 must be a whole number, 1 or more"),
        ({"groups": 2.5}, "sonar: groups = 2.5 must be a whole number, 1 or more"),
        ({"groups": math.inf}, "sonar: groups = inf must be a whole number, 1 or more"),
    ],
)
def test_impossible_figures_are_refused(figures: dict[str, float], message: str) -> None:
    with pytest.raises(SimError) as error:
        SonarModel(**figures)
    assert str(error.value) == message
