import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import cast

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.stats import norm

from refseq.planar import Pose
from refseq_bench import robots
from refseq_bench.robots import Robot, Twist
from refseq_bench.robots.motion import WHEELS
from refseq_bench.sim.acceptance.floor import empty_floor
from refseq_bench.sim.bench.bench import ADAPTATION, Bench
from refseq_bench.sim.bench.control_period import CONTROL_PERIOD
from refseq_bench.sim.bench.faults import CameraBlack, Fault, FaultSchedule, Kidnap, LaserDazzled, WheelSlip
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.cameras.camera import CameraModel
from refseq_bench.sim.cameras.sensor import WHITE
from refseq_bench.sim.drives.operator import Operator, OperatorStyle
from refseq_bench.sim.drives.recorder import RecordedView, drive_and_sense, operator_for
from refseq_bench.sim.drives.trigger import Trigger
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.sim.sensors.beams import BEAMS
from refseq_bench.sim.sensors.laser import Laser
from refseq_bench.sim.sensors.laser_echoes import LaserEchoes
from refseq_bench.sim.sensors.laser_model import DAZZLE, LaserModel
from refseq_bench.worlds.build import World, build_world
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.plans.load import parse_plan
from tests.sim.bench.lamp import Lamp, signal
from tests.worlds.conftest import SMALL

PERFECT = OperatorStyle(strength=0.0)
BLIND = BenchSettings(renderer=RendererKind.NONE)
STEP = 0.5
ROUTE = np.array([[1.0, 0.0], [7.0, 0.0]])
GRAVITY = 9.81
SETTLED = math.exp(-ADAPTATION / CameraModel().exposure.lag)
"""What is left of a wrong exposure, as a share of its logarithm, when the camera has looked at a scene once."""


@pytest.fixture(scope="module")
def corridor() -> World:
    """8 m long, walls at y = ±1.2 m, its route along the x axis from 1 m to 7 m."""
    return build_world(parse_plan(SMALL.format(top="", end="")), light_named("16:00"), seed=0)


@pytest.fixture(scope="module")
def floor() -> World:
    return empty_floor()


def bench_in(
    world: World, route: NDArray[np.float64] = ROUTE, settings: BenchSettings = BLIND, robot: str = "robuter"
) -> Bench:
    return Bench(world, robots.load(robot), route=route, seed=1, settings=settings)


def taken(world: World, *faults: Fault, settings: BenchSettings = BLIND, robot: str = "robuter") -> list[RecordedView]:
    """A drive by a perfect operator, a view every half metre."""
    with bench_in(world, ROUTE, settings, robot) as bench:
        return list(
            drive_and_sense(bench, operator_for(bench, 1, PERFECT), Trigger(STEP), faults=faults, timeout=120.0)
        )


def truth(one: RecordedView) -> Pose:
    assert one.view.truth is not None
    return one.view.truth


def ranges(one: RecordedView) -> NDArray[np.float32]:
    assert one.view.scan is not None
    return one.view.scan.ranges


# --- kidnap ---


@pytest.mark.quick_cases("robuter-2-4.5")
@pytest.mark.parametrize(("robot", "at", "to"), [("robuter", 2, 4.5), ("robuter", 4.5, 2), ("segway_rmp", 2, 4.5)])
def test_the_odometer_does_not_notice_a_kidnap_and_the_truth_does(
    corridor: World, robot: str, at: float, to: float
) -> None:
    views = taken(corridor, Kidnap(at, to), robot=robot)
    went = np.array([after.view.distance for _, after in pairwise(views)])
    moved = np.array([truth(after).x - truth(before).x for before, after in pairwise(views)])
    assert went == pytest.approx(STEP, abs=0.06)  # a machine that balances rolls back before it goes
    leaps = moved - went
    carried = int(np.argmax(np.abs(leaps)))
    assert leaps[carried] == pytest.approx(to - at, abs=0.05)
    assert np.delete(leaps, carried) == pytest.approx(0.0, abs=0.05)
    assert truth(views[carried]).x < 1.0 + at + 0.02
    assert views[-1].odometry.x - views[0].odometry.x == pytest.approx(6.0 - (to - at), abs=STEP + 0.1)


BENT = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 3.0], [2.0, 0.0], [1.0, 0.0]])
"""Along x, to the left up y, and by a turn on the spot back down, and to where it came from."""


@pytest.mark.parametrize(
    ("to", "pose"),
    [
        (0.0, Pose(0.0, 0.0, 0.0)),
        (1.5, Pose(1.5, 0.0, 0.0)),
        (3.0, Pose(2.0, 1.0, math.pi / 2)),
        (6.0, Pose(2.0, 2.0, -math.pi / 2)),
        (8.5, Pose(1.5, 0.0, math.pi)),
    ],
)
def test_a_kidnapped_robot_is_set_down_on_its_route_looking_along_it(floor: World, to: float, pose: Pose) -> None:
    with bench_in(floor, BENT) as bench:
        operator = operator_for(bench, 1, PERFECT)
        FaultSchedule([Kidnap(0.0, to)], bench, operator).look()
        assert (bench.pose.x, bench.pose.y) == pytest.approx((pose.x, pose.y), abs=1e-9)
        assert math.remainder(bench.pose.heading - pose.heading, 2 * math.pi) == pytest.approx(0.0, abs=1e-9)
        assert operator.progress == pytest.approx(to, abs=1e-9)
        for _ in range(25):
            bench.drive(operator.command(bench.time, bench.pose))
        east, north = math.cos(pose.heading), math.sin(pose.heading)
        ahead = east * (bench.pose.x - pose.x) + north * (bench.pose.y - pose.y)
    # It starts from rest at 0.3 m/s² and goes on the way it looks, not back to where it was taken from.
    assert 0.08 < ahead < 0.15


def test_a_robot_that_is_carried_to_where_it_stands_has_but_stopped(floor: World) -> None:
    plain, stopped = (taken(floor, *faults)[-2] for faults in ((), (Kidnap(2.0, 2.0),)))
    late = stopped.view.time - plain.view.time - (truth(stopped).x - truth(plain).x) / 0.4
    # Speeding up again to v = 0.4 m/s at a = 0.3 m/s² costs v / 2a; a command every 0.2 s is heard.
    assert 0.4 / 0.6 < late < 0.4 / 0.6 + 0.3


# --- a covered camera ---


def test_a_covered_camera_sees_nothing_between_the_two_places_and_the_other_camera_sees_all(
    corridor: World, lamp: Lamp
) -> None:
    lamp.edge = True
    settings = BenchSettings()
    views = taken(corridor, CameraBlack(1.2, 3.1, "camera-2"), settings=settings)
    plain = taken(corridor, settings=settings)
    assert len(views) == len(plain)
    for one, other in zip(views, plain, strict=True):
        assert np.array_equal(one.view.images["camera-1"], other.view.images["camera-1"])
        halves = np.hsplit(one.view.images["camera-2"].astype(float), 2)
        lit = halves[1].mean() / max(halves[0].mean(), 1e-9)
        if 1.2 <= one.progress < 3.1:
            assert lit == pytest.approx(1.0, abs=0.03)
        else:
            assert lit > 1.5
    assert sum(1.2 <= one.progress < 3.1 for one in views) == 4


def black_mean(model: CameraModel, gain: float) -> float:
    """Mean byte of a black picture: read noise at a gain, cut off below black, 12 bits, gamma."""
    sigma = model.sensor.read_noise * gain * WHITE / model.sensor.full_well
    numbers = np.arange(WHITE + 1)
    upper = norm.cdf((numbers + 0.5) / sigma)
    upper[-1] = 1.0
    share = np.diff(upper, prepend=0.0)
    return float(share @ np.round(255.0 * (numbers / WHITE) ** (1.0 / model.gamma)))


def test_a_covered_camera_turns_its_gain_up_until_only_noise_is_left_and_then_has_to_get_used_to_the_light(
    corridor: World, lamp: Lamp
) -> None:
    model = CameraModel()
    with bench_in(corridor, settings=BenchSettings(cameras=("camera-1",))) as bench:
        camera = bench._cameras["camera-1"]

        def look() -> NDArray[np.uint8]:
            for _ in range(round(1.0 / CONTROL_PERIOD)):
                bench.drive(Twist())
            return bench.sense().images["camera-1"]

        look()
        wanted, most = math.log(camera.exposure.product), math.log(model.exposure.limits[1])
        assert signal(bench.sense()) == pytest.approx(model.exposure.target, rel=0.03)
        bench.covered = frozenset({"camera-1"})
        told = wanted
        for _ in range(6):
            black = look()
            told += (most - told) * (1.0 - SETTLED)
            assert math.log(camera.exposure.product) == pytest.approx(told, abs=1e-6)
            assert black.mean() == pytest.approx(black_mean(model, camera.exposure.gain), rel=0.01)
        assert camera.exposure.gain == pytest.approx(model.exposure.gain[1], rel=0.01)
        bench.covered = frozenset()
        look()
        told += (wanted - told) * (1.0 - SETTLED)
        assert math.log(camera.exposure.product) == pytest.approx(told, abs=1e-6)
        assert math.exp(told - wanted) > 2.0
        for _ in range(4):
            look()
        assert signal(bench.sense()) == pytest.approx(model.exposure.target, rel=0.03)


# --- a dazzled laser ---


def test_dazzled_beams_measure_nothing_between_the_two_places_and_all_others_what_they_would_have(
    corridor: World,
) -> None:
    fault = LaserDazzled(1.2, 3.1, bearing=30.0, width=40.0)
    views, plain = taken(corridor, fault), taken(corridor)
    bearings = np.linspace(-90.0, 90.0, BEAMS)
    arc = (bearings >= 10.0 - 1e-6) & (bearings <= 50.0 + 1e-6)
    assert len(views) == len(plain)
    dazzled = 0
    for one, other in zip(views, plain, strict=True):
        if 1.2 <= one.progress < 3.1:
            assert np.isinf(ranges(one)[arc]).all()
            assert np.array_equal(ranges(one)[~arc], ranges(other)[~arc])
            assert np.isfinite(ranges(other)[arc]).mean() > 0.8  # at its ends the corridor is open
            dazzled += 1
        else:
            assert np.array_equal(ranges(one), ranges(other))
    assert dazzled == 4


@given(st.floats(-180, 180), st.floats(1, 360))
@example(0.0, 180.0)
@example(45.0, 45.0)
@example(10.0, 91.0)
@example(90.0, 20.0)
def test_the_beams_within_half_the_width_of_the_bearing_are_dazzled_whichever_way_round(
    bearing: float, width: float
) -> None:
    laser = Laser(LaserModel(), np.random.default_rng(0))
    laser.dazzled = (LaserDazzled(0.0, 1.0, bearing, width).arc,)
    words = laser.reading(LaserEchoes(np.full(BEAMS, 3.0), np.ones(BEAMS))).words
    away = np.array([abs(math.remainder(beam - bearing, 360.0)) for beam in np.linspace(-90.0, 90.0, BEAMS)])
    sure = (np.abs(away - width / 2) > 1e-6) | (np.abs(away - width / 2) < 1e-12)  # clear of an edge, or on it
    assert np.array_equal((words == DAZZLE)[sure], (away <= width / 2 + 1e-12)[sure])
    assert (words[words != DAZZLE] < 400).all()


# --- slipping wheels ---


def motion(
    world: World, seconds: float, wheels: Sequence[str], friction: float = 0.02
) -> tuple[Pose, Pose, Pose, Pose]:
    """Truth and odometry [m from the start] after so long at 0.4 m/s from rest, wheels slipping; and 5 s later."""
    with bench_in(world, np.array([[0.0, 0.0], [15.0, 0.0]])) as bench:
        for wheel in wheels:
            bench.grip(wheel, friction)
        found: list[Pose] = []
        for time in (seconds, 5.0):
            for _ in range(round(time / CONTROL_PERIOD)):
                bench.drive(Twist(0.4, 0.0))
            found += [bench.pose, bench.odometry]
            for wheel in wheels:
                bench.grip(wheel, None)
    return found[0], found[1], found[2], found[3]


@pytest.mark.parametrize("friction", [0.005, 0.02])
def test_a_slick_lets_the_robot_speed_up_no_faster_than_friction_can_push_it(floor: World, friction: float) -> None:
    truth, odometry, _, _ = motion(floor, 1.5, WHEELS, friction)
    _, gripping, _, _ = motion(floor, 1.5, ())
    # Coulomb: a ≤ μ g, were all weight on the driven wheels. The motor's regulator turns them as if nothing were amiss.
    assert 0.0 <= truth.x <= friction * GRAVITY * 1.5**2 / 2
    assert odometry.x == pytest.approx(gripping.x, rel=0.1)
    assert odometry.x - truth.x > 0.15


def test_once_off_the_slick_the_odometer_tells_the_way_again(floor: World) -> None:
    truth, odometry, later, told = motion(floor, 1.5, WHEELS)
    went = math.dist((truth.x, truth.y), (later.x, later.y))
    counted = math.dist((odometry.x, odometry.y), (told.x, told.y))
    # But for the moment in which the tyres catch on: the wheels turn at 0.4 m/s, the robot stands nearly.
    assert went > 1.7
    assert counted - went == pytest.approx(0.0, abs=0.1)


def test_all_tyres_have_their_own_grip_back_after_slipping(floor: World) -> None:
    with bench_in(floor) as bench:
        before = bench.model.geom_friction.copy(), bench.model.geom_priority.copy()
        for wheel in WHEELS:
            bench.grip(wheel, 0.02)
            assert not np.array_equal(bench.model.geom_friction, before[0])
            bench.grip(wheel, None)
            assert np.array_equal(bench.model.geom_friction, before[0])
            assert np.array_equal(bench.model.geom_priority, before[1])


@pytest.mark.parametrize(("wheel", "sense"), [("left", 1.0), ("right", -1.0)])
def test_a_robot_of_which_one_wheel_slips_turns_to_that_side_and_does_not_know(
    floor: World, wheel: str, sense: float
) -> None:
    truth, odometry, _, _ = motion(floor, 1.5, [wheel])
    assert sense * truth.heading > math.radians(1)
    assert sense * (truth.heading - odometry.heading) > math.radians(1)


# --- the agenda ---


@dataclass
class Course:
    """Stands for bench and operator: notes what is asked of them, and is where the test puts it."""

    progress: float = 0.0
    time: float = 0.0
    length: float = 10.0
    covered: frozenset[str] = frozenset()
    dazzled: tuple[tuple[float, float], ...] = ()
    slipping: dict[str, float | None] = field(default_factory=lambda: dict.fromkeys(WHEELS))
    carried_to: list[float] = field(default_factory=list)
    robot: Robot = field(default_factory=lambda: robots.load("robuter"))

    def dazzle(self, arcs: Sequence[tuple[float, float]]) -> None:
        self.dazzled = tuple(arcs)

    def grip(self, wheel: str, friction: float | None) -> None:
        self.slipping[wheel] = friction

    def carried(self, to: float) -> Pose:
        self.carried_to.append(to)
        self.progress = to
        return Pose(to, 0.0, 0.0)

    def place(self, pose: Pose) -> None:
        assert pose.x == self.progress


def agenda_of(course: Course, faults: Sequence[Fault]) -> FaultSchedule:
    return FaultSchedule(faults, cast(Bench, course), cast(Operator, course))


places = st.floats(0, 10)
stretches = st.tuples(places, places).filter(lambda pair: pair[0] < pair[1])


blacks = st.builds(
    lambda pair, camera: CameraBlack(*pair, camera), stretches, st.sampled_from(["camera-1", "camera-2"])
)
lights = st.builds(lambda pair, bearing: LaserDazzled(*pair, bearing), stretches, st.floats(-90, 90))
slicks = st.builds(
    WheelSlip,
    places,
    st.floats(0.1, 5),
    st.sampled_from(["both", "left", "right"]),
    st.sampled_from([0.01, 0.02, 0.05]),
)


@given(st.lists(blacks | lights | slicks, max_size=8), st.lists(st.floats(0, 1), max_size=60))
def test_faults_that_overlap_add_up(faults: list[CameraBlack | LaserDazzled | WheelSlip], steps: list[float]) -> None:
    course = Course()
    agenda = agenda_of(course, faults)
    began: dict[int, float] = {}
    for step in [0.0, *steps]:
        course.progress = min(course.progress + step, course.length)
        course.time += 0.7
        agenda.look()
        there = [fault for fault in faults if fault.at <= course.progress]
        for fault in there:
            began.setdefault(id(fault), course.time)
        dark = {f.camera for f in there if isinstance(f, CameraBlack) and course.progress < f.until}
        arcs = [f.arc for f in there if isinstance(f, LaserDazzled) and course.progress < f.until]
        slick = [f for f in there if isinstance(f, WheelSlip) and course.time - began[id(f)] < f.seconds]
        assert course.covered == dark
        assert sorted(course.dazzled) == sorted(arcs)
        for wheel in WHEELS:
            under = [f.friction for f in slick if f.wheels in ("both", wheel)]
            assert course.slipping[wheel] == min(under, default=None)


def test_the_same_thing_may_happen_twice() -> None:
    course = Course()
    agenda = agenda_of(course, [CameraBlack(1.0, 2.0, "camera-1"), CameraBlack(4.0, 5.0, "camera-1")])
    dark = []
    for course.progress in np.arange(0.5, 6.0):
        agenda.look()
        dark.append("camera-1" in course.covered)
    assert dark == [False, True, False, False, True, False]


def test_a_fault_at_the_start_is_there_for_the_first_view(corridor: World, lamp: Lamp) -> None:
    first = taken(corridor, CameraBlack(0.0, 1.0, "camera-1"), LaserDazzled(0.0, 1.0), settings=BenchSettings())[0]
    assert np.isinf(ranges(first)[1:-1]).all()
    assert first.view.images["camera-1"].mean() < 64 < first.view.images["camera-2"].mean()


def test_a_kidnap_back_over_another_fault_does_not_begin_it_again() -> None:
    course = Course()
    agenda = agenda_of(course, [CameraBlack(2.0, 3.0, "camera-1"), Kidnap(5.0, 1.0)])
    seen = []
    for _ in range(100):
        course.progress = min(course.progress + 0.1, 10.0)
        agenda.look()
        seen.append((round(course.progress, 1), "camera-1" in course.covered))
    assert course.carried_to == [1.0]
    covered = [k for k, (_, dark) in enumerate(seen) if dark]
    assert [seen[k][0] for k in covered] == pytest.approx(np.arange(2.0, 3.0, 0.1).tolist(), abs=0.1)
    assert covered == list(range(covered[0], covered[-1] + 1)), "the second time past it is not dark"


@pytest.mark.parametrize(("to", "ill"), [(1.0, False), (2.0, True), (2.9, True), (3.0, False), (8.0, False)])
def test_a_kidnap_out_of_another_fault_ends_it_for_good(to: float, ill: bool) -> None:
    course = Course()
    agenda = agenda_of(course, [CameraBlack(2.0, 3.0, "camera-1"), LaserDazzled(2.0, 3.0), Kidnap(2.5, to)])
    for course.progress in (2.2, 2.6):
        agenda.look()
    assert course.progress == to
    assert (course.covered == {"camera-1"}, len(course.dazzled) == 1) == (ill, ill)
    if not ill:
        course.progress = 2.5
        agenda.look()
        assert (course.covered, course.dazzled) == (set(), ())


def test_a_robot_that_rolls_back_a_little_has_not_left_a_fault() -> None:
    course = Course()
    agenda = agenda_of(course, [CameraBlack(2.0, 3.0, "camera-1")])
    for course.progress in (2.01, 1.99):
        agenda.look()
        assert course.covered == {"camera-1"}


def test_wheels_that_slip_do_so_for_their_time_wherever_the_robot_is_carried() -> None:
    course = Course()
    agenda = agenda_of(course, [WheelSlip(2.0, 5.0), Kidnap(2.5, 1.0)])
    slipping = []
    for course.progress, course.time in ((2.2, 0.0), (2.6, 3.0), (1.5, 6.0)):
        agenda.look()
        slipping.append(course.slipping["left"] is not None)
    assert slipping == [True, True, False]


def test_what_the_robot_is_carried_past_does_not_happen() -> None:
    course = Course()
    past = [CameraBlack(3.0, 5.0, "camera-1"), LaserDazzled(4.0, 8.0), WheelSlip(5.0, 9.0), Kidnap(6.0, 1.0)]
    agenda = agenda_of(course, [Kidnap(2.0, 8.0), *past])
    course.progress = 2.0
    agenda.look()
    assert (course.progress, course.covered, course.dazzled, course.carried_to) == (8.0, set(), (), [8.0])
    assert course.slipping == {"left": None, "right": None}


def test_what_reaches_to_where_the_robot_is_set_down_is_there() -> None:
    course = Course()
    agenda = agenda_of(course, [Kidnap(2.0, 8.0), CameraBlack(3.0, 8.5, "camera-1"), WheelSlip(8.0, 1.0, "left")])
    course.progress = 2.0
    agenda.look()
    assert (course.covered, course.slipping["left"]) == ({"camera-1"}, 0.02)


@pytest.mark.parametrize(
    ("fault", "told"),
    [
        (Kidnap(10.1, 3.0), "fault kidnap: at = 10.1 m is beyond the end of what is driven; valid is 0 to 10.0 m"),
        (Kidnap(1.0, 11.0), "fault kidnap: to = 11 m is beyond the end of what is driven; valid is 0 to 10.0 m"),
        (
            CameraBlack(1.0, 10.5, "camera-1"),
            "fault camera-black: until = 10.5 m is beyond the end of what is driven; valid is 0 to 10.0 m",
        ),
        (
            LaserDazzled(11.0, 12.0),
            "fault laser-dazzled: at = 11 m is beyond the end of what is driven; valid is 0 to 10.0 m",
        ),
        (WheelSlip(12.0, 1.0), "fault wheel-slip: at = 12 m is beyond the end of what is driven; valid is 0 to 10.0 m"),
        (
            CameraBlack(1.0, 2.0, "camera-3"),
            "fault camera-black: camera 'camera-3' is not on robuter; valid are camera-1, camera-2",
        ),
    ],
)
def test_what_cannot_happen_on_this_route_is_refused_before_the_drive(fault: Fault, told: str) -> None:
    with pytest.raises(SimError, match=told):
        agenda_of(Course(), [fault])


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda: Kidnap(-1.0, 3.0), "fault kidnap: at = -1.0 must be 0 m or more along the route"),
        (lambda: Kidnap(1.0, math.nan), "fault kidnap: to = nan must be 0 m or more along the route"),
        (lambda: CameraBlack(2.0, 2.0, "camera-1"), "fault camera-black: until = 2.0 m must be beyond at = 2.0 m"),
        (lambda: LaserDazzled(3.0, 1.0), "fault laser-dazzled: until = 1.0 m must be beyond at = 3.0 m"),
        (lambda: LaserDazzled(0.0, 1.0, width=0.0), "width = 0.0 must be above 0 and at most 360 degrees"),
        (lambda: LaserDazzled(0.0, 1.0, bearing=181.0), "bearing = 181.0 must be from -180 to 180 degrees"),
        (lambda: WheelSlip(math.inf, 1.0), "fault wheel-slip: at = inf must be 0 m or more along the route"),
        (lambda: WheelSlip(0.0, 0.0), "fault wheel-slip: seconds = 0.0 must be positive"),
        (lambda: WheelSlip(0.0, 1.0, friction=0.0), "friction = 0.0 must be above 0 and at most 2"),
    ],
)
def test_a_fault_that_could_never_be_is_refused(make: Callable[[], Fault], told: str) -> None:
    with pytest.raises(SimError, match=told):
        make()
