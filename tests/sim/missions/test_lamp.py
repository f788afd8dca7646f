"""LAMP programs on a bench, by truth: how far, how near, how much turned, and that nobody looks at the laser."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from refseq.missions.lamp import LampStage, LampWord, Verb, parse_lamp
from refseq.planar import Pose
from refseq_bench import robots
from refseq_bench.robots.behaviours import BehaviourOutcome
from refseq_bench.robots.behaviours.lamp.beside import keeps
from refseq_bench.scenarios.library import LIBRARY
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.drives.behaviour_runner import description_of
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.missions.lamp import LampEnded, run_lamp
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.worlds.build import World, build_world
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.plans.load import load_plan
from tests.sim.drives.behaving_in import PERFECT, corridor, touches

AHEAD = 0.275
"""How far the front sonars are ahead of the axle [m]."""
SIGMA = 0.05
"""Spread of a sonar's reading [m]."""
LENGTH = 12.0
SIDES = (
    '[[furniture]]\nname = "{name}"\nkind = "box"\nat = [6, {y}]\nwidth = 0.3\ndepth = {depth}\nheight = 1.5\n'
    'material = "plaster"\n'
)
OPENING = SIDES.format(name="left", y=0.85, depth=0.7) + SIDES.format(name="right", y=-0.85, depth=0.7)
"""In a corridor 2.4 m wide it leaves 1 m."""
CLOSED = SIDES.format(name="all", y=0.0, depth=2.4)
KEEPS = keeps(description_of(robots.load("robuter")))
"""How far from a wall beside it the middle of its axle stays [m]."""
REAL = BenchSettings(RendererKind.NONE)
"""A robot with errors of calibration."""


@pytest.fixture(scope="module")
def bare() -> World:
    return corridor(LENGTH)


@pytest.fixture(scope="module")
def narrow() -> World:
    return corridor(LENGTH, OPENING)


def ran(
    world: World,
    program: str,
    start: tuple[float, float, float] = (3.0, 0.0, 0.0),
    *,
    seed: int = 1,
    settings: BenchSettings = PERFECT,
    timeout: float = 120.0,
) -> tuple[LampEnded, Pose, set[str]]:
    """Run a program from (x, y, heading): how it ended, where the robot stood 1 s later, and what it touched."""
    with Bench(world, robots.load("robuter"), seed=seed, settings=settings) as bench:
        bench.place(Pose(*start))
        # Whoever looks at the laser gets nothing that has ranges.
        bench.scan = SimpleNamespace  # type: ignore[assignment, method-assign]
        touched: set[str] = set()
        ended = run_lamp(bench, parse_lamp(program), timeout=timeout, each=lambda _: touched.update(touches(bench)))
        for _ in range(25):
            bench.wait()
        return ended, bench.pose, touched


@pytest.mark.quick_cases("2")
@pytest.mark.parametrize("unit", [1, 2, 3])
def test_a_length_is_gone_to_within_the_odometer_s_error(bare: World, unit: int) -> None:
    settings = BenchSettings(RendererKind.NONE, unit=unit)
    ended, rest, _ = ran(bare, "MOVE LV 200 DIL 1500", settings=settings)
    assert ended.finished
    # Three deviations of the wheels' size, and what it rolls on.
    assert rest.x - 3.0 == pytest.approx(1.5, abs=1.5 * 3 * settings.spread.calibration.size + 0.006)


def test_it_goes_backwards_and_along_an_arc(bare: World) -> None:
    """The second stage counts from its own start: 0.5 m and 45° on a radius of 0.64 m, chord 2 r sin(45°/2)."""
    ended, rest, _ = ran(bare, "MOVE LV -200 DIL 500\nMOVE LV 200 AV 18 ANL 45")
    assert ended.finished
    assert ended.stages[0].end.path[-1][0] == pytest.approx(2.5, abs=0.01)
    radius = 0.2 / math.radians(18)
    assert rest.heading == pytest.approx(math.radians(45), abs=math.radians(0.6))
    assert rest.x == pytest.approx(2.5 + radius * math.sin(math.radians(45)), abs=0.02)
    assert rest.y == pytest.approx(radius * (1 - math.cos(math.radians(45))), abs=0.02)


@pytest.mark.parametrize("angle", [90, -90])
def test_an_angle_is_turned(bare: World, angle: int) -> None:
    ended, rest, _ = ran(bare, f"MOVE AV 20 ANL {angle}")
    assert ended.finished
    assert math.degrees(rest.heading) == pytest.approx(angle, abs=0.8)  # 0.3° for the odometer, the tyres slip 0.3 %
    assert math.hypot(rest.x - 3.0, rest.y) < 0.01


@pytest.mark.quick_cases("1000-100")
@pytest.mark.parametrize(("near", "speed"), [(1000, 100), (500, 20)])
def test_it_ends_where_the_sonar_reads_less(bare: World, near: int, speed: int) -> None:
    start = LENGTH - AHEAD - near / 1000 - 0.4
    ended, rest, _ = ran(bare, f"MOVP MV {speed} USL {near} SEN 1", (start, 0.0, 0.0))
    assert ended.finished
    # The middle of 1.2 s of readings is 0.6 s old, and commands and wheels take some time.
    left = LENGTH - AHEAD - rest.x + 0.8 * speed / 1000
    assert left == pytest.approx(near / 1000, abs=2 * SIGMA)
    assert abs(rest.y) < 0.01
    assert abs(rest.heading) < math.radians(0.5)
    assert ended.stages[0].end.why.startswith("sonar 1 reads")


@pytest.mark.quick_cases("1-1")
@pytest.mark.parametrize(("side", "sign"), [(1, 1), (2, -1)])
def test_it_goes_beside_the_wall_of_its_side(bare: World, side: int, sign: int) -> None:
    """The walls are at y = ±1.2 m; it comes from the middle and a little aslant."""
    ended, rest, touched = ran(bare, f"MOVP MV 200 PS {side} USL 1000 SEN 1", (2.0, 0.0, 0.05))
    assert ended.finished
    path = ended.stages[0].end.path
    off = 1.2 - sign * path[path[:, 0] > 7.0, 1] - KEEPS
    assert len(off) > 50
    assert np.abs(off).max() < 0.06
    assert abs(rest.heading) < math.radians(3)
    assert not touched


def test_where_nothing_is_beside_it_it_goes_straight_on() -> None:
    """The left wall ends at x = 4 m, and what is beyond is farther away than it listens."""
    ended, rest, _ = ran(corridor(LENGTH, left=4.0), "MOVP MV 300 PS 1 USL 1000 SEN 1", (5.5, 0.0, 0.0))
    assert ended.finished
    assert abs(rest.y) < 0.03


@pytest.mark.quick_cases("0.08")
@pytest.mark.parametrize("aside", [-0.08, 0.0, 0.08])
def test_it_goes_through_an_opening_of_1_m(narrow: World, aside: float) -> None:
    ended, rest, touched = ran(narrow, "CROSS", (4.5, aside, 0.0))
    assert ended.finished
    assert rest.x - 0.74 > 6.15  # its tail is out
    assert rest.x - 0.74 < 6.6
    assert not touched
    assert abs(rest.y) < abs(aside) + 0.02  # what it gets to know of the middle, it gets to know inside


def test_it_does_not_go_through_a_closed_wall() -> None:
    ended, rest, touched = ran(corridor(LENGTH, CLOSED), "CROSS\nMOVE AV 20 ANL 90", (4.8, 0.0, 0.0))
    assert not ended.finished
    assert len(ended.stages) == 1, "what comes after a stage that has failed is not begun"
    assert ended.stages[0].end.outcome is BehaviourOutcome.FAILED
    assert ended.stages[0].end.why.startswith("waited 20 s: sonar: ")
    assert rest.x + 0.335 < 5.85
    assert not touched


def test_where_nothing_is_narrow_crossing_fails(bare: World) -> None:
    ended, rest, _ = ran(bare, "CROSS", (2.0, 0.0, 0.0))
    assert ended.stages[0].end.why.startswith("no narrow opening on 4.0")
    assert rest.x == pytest.approx(6.0, abs=0.1)


def test_a_stage_that_never_ends_runs_out_of_time(bare: World) -> None:
    ended, _, _ = ran(bare, "MOVE AV 5 ANL 90", timeout=3.0)
    assert not ended.finished
    assert ended.stages[0].end.why == "not done after 3 s"
    assert ended.time == pytest.approx(3.0, abs=0.1)


@pytest.mark.slow
def test_a_stray_reading_ends_nothing(bare: World) -> None:
    """Every fortieth reading is any length: between 0.15 and 10.67 m; alone it would end half of the ways."""
    settings = replace(PERFECT, sonar=replace(PERFECT.sonar, random=0.025))
    for seed in range(3):
        ended, rest, _ = ran(bare, "MOVP MV 300 USL 500 SEN 1", (2.0, 0.0, 0.0), seed=seed, settings=settings)
        assert ended.finished
        assert rest.x > LENGTH - AHEAD - 0.5 - 0.3


def test_the_same_seed_goes_the_same_way_and_another_seed_another(narrow: World) -> None:
    program = "MOVP MV 200 PS 2 USL 1500 SEN 1"
    paths = [
        ran(narrow, program, (1.5, -0.1, 0.0), seed=seed, settings=REAL)[0].stages[0].end.path for seed in (4, 4, 5)
    ]
    assert paths[0].tobytes() == paths[1].tobytes()
    assert paths[0].tobytes() != paths[2].tobytes()


# --- what is wrong ---


def test_all_stages_together_take_no_longer_than_the_program_may(bare: World) -> None:
    stages = parse_lamp("1. MOVE LV 200 DIL 800\n2. MOVE LV 200 DIL 800\n3. MOVE LV 200 DIL 800")
    with Bench(bare, robots.load("robuter"), settings=PERFECT) as bench:
        for _ in range(100):  # what was before is none of the program's time
            bench.wait()
        ended = run_lamp(bench, stages, patience=6.0)
    assert [one.end.outcome for one in ended.stages] == [BehaviourOutcome.FINISHED, BehaviourOutcome.FAILED]
    assert ended.stages[-1].end.why.startswith("not done after ")
    assert ended.time == pytest.approx(6.0, abs=0.1)


def stage(verb: Verb, **numbers: int) -> LampStage:
    return LampStage(verb, {LampWord[name]: number for name, number in numbers.items()})


@pytest.mark.parametrize(
    ("stages", "timeout", "told"),
    [
        ((), 9.0, "LAMP program without a stage: valid is one stage or more"),
        ((stage(Verb.CROSS),), 0.0, "LAMP: timeout = 0 s is not valid: valid is a time above 0 s"),
        ((stage(Verb.CROSS),), math.nan, "LAMP: timeout = nan s is not valid: valid is a time above 0 s"),
        (
            (stage(Verb.CROSS), stage(Verb.BESIDE, SPEED_BESIDE=20, RANGE=300, SONAR=24)),
            9.0,
            "LAMP stage 'MOVP MV 20 USL 300 SEN 24': robot 'robuter' has no sonar 24: valid is 0 to 23",
        ),
    ],
)
def test_what_cannot_be_run_is_told_before_anything_moves(
    bare: World, stages: tuple[LampStage, ...], timeout: float, told: str
) -> None:
    with Bench(bare, robots.load("robuter"), settings=PERFECT) as bench:
        with pytest.raises(SimError) as caught:
            run_lamp(bench, stages, timeout=timeout)
        assert str(caught.value) == told
        assert bench.time == 0.0


def test_a_robot_without_sonars_cannot_run_it(bare: World) -> None:
    with Bench(bare, robots.load("segway_rmp"), settings=PERFECT) as bench:
        with pytest.raises(SimError, match=r"^robot 'segway_rmp' has no sonars, .* valid is .*'robuter'$"):
            run_lamp(bench, parse_lamp("MOVE AV 20 ANL 90"))
        assert bench.time == 0.0


# --- the program of the thesis ---


def test_sonar_1_looks_ahead() -> None:
    ranger = description_of(robots.load("robuter")).sonars[1]
    assert ranger.bearing == pytest.approx(0.0)
    assert ranger.x == pytest.approx(AHEAD)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_the_eleven_lines_of_the_thesis_lead_through_the_world_made_for_them(seed: int) -> None:
    """1350 s of simulated time, 25 m: the corridor's end and its left wall say where it should stop."""
    world = build_world(load_plan("lamp"), light_named("16:00"), pictured=False)
    text = (LIBRARY / "fig-1.6.lamp").read_text()
    with Bench(world, robots.load("robuter"), seed=seed, settings=REAL) as bench:
        touched: set[str] = set()
        ended = run_lamp(bench, parse_lamp(text), each=lambda _: touched.update(touches(bench)))
        rest = bench.pose
    assert [each.end.why for each in ended.stages if each.end.outcome is not BehaviourOutcome.FINISHED] == []
    assert ended.finished
    assert not touched
    assert rest.x == pytest.approx(9.03 - AHEAD - 0.3, abs=0.15)  # the leaf of the door at the end
    assert rest.y == pytest.approx(2.4 - KEEPS, abs=0.1)
    assert abs(rest.heading) < math.radians(5)
