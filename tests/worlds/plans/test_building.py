"""Buildings made from a seed, and the dials of generated worlds."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from refseq_bench.worlds.arrays import Floats
from refseq_bench.worlds.errors import PlanError
from refseq_bench.worlds.plans.areas import rectangles
from refseq_bench.worlds.plans.building import building
from refseq_bench.worlds.plans.dials import Dials
from refseq_bench.worlds.plans.footprints import gaps, room_behind
from refseq_bench.worlds.plans.generate import corridor
from refseq_bench.worlds.plans.load import load_plan, parse_plan
from refseq_bench.worlds.plans.schema import ON_WALL, FloorPlan, Wall
from refseq_bench.worlds.plans.write import plan_text

seeds = st.integers(0, 10**18 - 1)
dials = st.builds(
    Dials,
    texture=st.none() | st.sampled_from([0.0, 0.2, 1.0]),
    repetition=st.none() | st.sampled_from([0.0, 0.5, 1.0]),
    glass=st.none() | st.sampled_from([0.0, 0.05, 0.3, 0.9]),
    width=st.none() | st.sampled_from([1.8, 2.5, 4.0]),
)
quick = settings(max_examples=10, deadline=None)


HALF_A_CORRIDOR = 2.1
"""No wall stands farther from the lamps over a corridor's middle [m]."""


def along_wall(wall: Wall, at: float) -> Floats:
    """The point of a wall (x, y) [m] so far from its start."""
    start, end = np.array(wall.start), np.array(wall.end)
    return start + at / wall.length * (end - start)


def on(plan: FloorPlan, wall: str) -> list[tuple[str, float, str]]:
    """Things on a wall, by table, place and all else but the name."""
    items = [(table, item) for table in ON_WALL for item in getattr(plan, table) if item.wall == wall]
    return sorted((t, i.at, i.model_copy(update={"name": "", "wall": ""}).model_dump_json()) for t, i in items)


@given(seeds, dials)
@quick
def test_a_building_keeps_all_rules_of_plans_and_is_read_back_the_same(seed: int, turned: Dials) -> None:
    plan = building(seed, turned)
    assert parse_plan(plan_text(plan)) == plan
    assert plan == building(seed, turned)
    rooms = [room_behind(plan, door) for door in plan.door if door.open]
    for i, room in enumerate(rooms[1:], start=1):
        assert gaps(room, rooms[:i]).min() > 0.0


@given(seeds, dials)
@quick
def test_all_routes_have_half_a_metre_to_either_side(seed: int, turned: Dials) -> None:
    plan = building(seed, turned)
    assert set(plan.routes) == {"forward", "reverse", "wing", "last-wing", "detour"}
    areas = rectangles(plan)
    for route in plan.routes.values():
        for a, b in pairwise(np.array(route)):
            across = np.array([a[1] - b[1], b[0] - a[0]]) / np.linalg.norm(b - a)
            for t in np.linspace(0.0, 1.0, 25):
                for side in (-0.5, 0.5):
                    assert any(area.holds(a + t * (b - a) + side * across) for area in areas)


def test_wings_are_identical_where_the_dial_says_so() -> None:
    for seed in range(6):
        same = building(seed, Dials(repetition=1.0, glass=0.0))
        for side in ("south", "east", "north", "west"):
            closed = [[(t, at) for t, at, _ in on(same, f"{side}-{block}")] for block in (1, 2)]
            assert closed[0] == closed[1]
        differ = building(seed, Dials(repetition=0.0))
        assert any(on(differ, f"{side}-1") != on(differ, f"{side}-2") for side in ("south", "north"))


def test_texture_at_none_leaves_doors_and_windows() -> None:
    for seed in range(10):
        for plan in (building(seed, Dials(texture=0.0)), corridor(seed, Dials(texture=0.0))):
            assert {table for table in ON_WALL if getattr(plan, table)} <= {"door", "window", "fixture"}
            assert {one.kind for one in plan.fixture} <= {"radiator"}


def test_texture_is_posters_a_metre_where_there_is_room() -> None:
    """Things that find no free place are left out, so that there are some fewer."""
    counts, metres = 0, 0.0
    for seed in range(40):
        plan = corridor(seed, Dials(texture=0.2, glass=0.0))
        counts, metres = counts + len(plan.poster), metres + sum(w.length for w in plan.wall if "-" in w.name)
    assert 0.1 < counts / metres <= 0.2


@pytest.mark.parametrize(("repetition", "least", "most"), [(0.0, 0.0, 0.0), (0.5, 0.35, 0.6), (1.0, 0.8, 1.0)])
def test_modules_of_a_corridor_come_again_as_often_as_asked(repetition: float, least: float, most: float) -> None:
    """Share of the posters that hang again some modules of 8 m further on; ends of walls are no whole modules."""
    again, count = 0, 0
    for seed in range(20):
        plan = corridor(seed, Dials(texture=0.3, repetition=repetition))
        hung = [(p.wall, round(100 * p.at) % 800, p.width, p.height, p.style) for p in plan.poster]
        again, count = again + sum(hung.count(poster) > 1 for poster in hung), count + len(hung)
    assert count > 500
    assert least <= again / count <= most


def test_glass_is_the_width_of_windows_over_their_pitch_and_of_the_walls_some_less_is_window() -> None:
    """Means of 30 seeds, which docs/worlds.md tells."""

    def share(plan: FloorPlan, walls: list[Wall]) -> float:
        return sum(w.width for w in plan.window) / sum(wall.length for wall in walls)

    for glass, outer, glazed in ((0.2, 0.10, 0.14), (0.45, 0.20, 0.31), (0.9, 0.33, 0.54)):
        buildings = [building(seed, Dials(glass=glass)) for seed in range(30)]
        corridors = [plan for seed in range(30) if (plan := corridor(seed, Dials(glass=glass))).window]
        with_windows = [[plan.wall_named(name) for name in {w.wall for w in plan.window}] for plan in corridors]
        assert len(corridors) > 20
        assert np.mean([share(plan, list(plan.wall[:4])) for plan in buildings]) == pytest.approx(outer, abs=0.01)
        assert np.mean(list(map(share, corridors, with_windows))) == pytest.approx(glazed, abs=0.01)


def test_width_and_glass_are_as_asked() -> None:
    for seed in range(10):
        assert corridor(seed, Dials(width=3.5)).wall_named("start").length == pytest.approx(3.5)
        assert not building(seed, Dials(glass=0.0)).window
        glazed = [sum(w.width for w in building(seed, Dials(glass=g)).window) for g in (0.2, 0.8)]
        assert 0 < glazed[0] < glazed[1]


@given(seeds, dials)
@example(2**50 - 1, Dials())  # a window behind the only lamp of a short leg
@quick
def test_no_corridor_is_dark_by_day(seed: int, turned: Dials) -> None:
    """Lamps that wait for dusk hang only where a window is on their leg, which is found here by its distance.

    A leg begins half a step before its first lamp, and ends less than two steps behind its last one.
    """
    for plan in (corridor(seed, turned), building(seed, turned)):
        windows = np.array([along_wall(plan.wall_named(w.wall), w.at) for w in plan.window]).reshape(-1, 2)
        for lamp in plan.lamp:
            step = float(np.linalg.norm(lamp.step))
            ahead = np.array(lamp.step) / step
            along, aside = np.array([ahead, (-ahead[1], ahead[0])]) @ (windows - lamp.first).T
            on_leg = (along > -step / 2) & (along < (lamp.count + 1) * step)
            beside = np.any((abs(aside) < HALF_A_CORRIDOR) & on_leg)
            assert beside or lamp.switch == "always", (plan.name, lamp.name)


@pytest.mark.parametrize(("name", "value"), [("glass", 5.0), ("width", 1.0), ("texture", float("nan"))])
def test_dials_that_are_turned_by_hand_are_checked_too(name: str, value: float) -> None:
    with pytest.raises(PlanError, match=f"^dials: {name} = '{value}' is not valid; it should be from "):
        Dials(**{name: value})


@pytest.mark.parametrize("name", ["corridor:2,glass=0.1", "building:5,glass=0.05", "building:38,glass=0.9"])
def test_what_is_wider_than_its_window_covers_nothing(name: str) -> None:
    plan = load_plan(name)
    assert parse_plan(plan_text(plan)) == plan
    assert {one.kind for one in plan.fixture} >= {"radiator"}


def test_dials_stand_behind_the_seed() -> None:
    asked = Dials(texture=0.1, width=2.0)
    assert load_plan("building:3,texture=0.1,width=2") == building(3, asked)
    assert load_plan("corridor:3,width=2,texture=0.1") == corridor(3, asked)
    assert load_plan("corridor:3") == corridor(3)
    assert building(3, asked).name == "building-3-texture0.1-width2"


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("building:3,textur=1", "unknown dial 'textur'; valid are texture, repetition, glass, width"),
        ("building:3,", "unknown dial ''; valid are texture, repetition, glass, width"),
        ("corridor:3,width=9", "width = '9' is not valid; it should be from 1.8 to 4"),
        ("corridor:3,glass=nan", "glass = 'nan' is not valid; it should be from 0 to 0.9"),
        ("corridor:3,glass", "glass = '' is not valid; it should be from 0 to 0.9"),
        ("corridor:3,width=2,width=3", "width is given twice; valid is once"),
        ("hallway,width=2", "it has no dials; valid are they behind corridor:SEED and building:SEED"),
    ],
)
def test_dials_that_are_none(name: str, told: str) -> None:
    with pytest.raises(PlanError) as caught:
        load_plan(name)
    assert str(caught.value) == f"world '{name}': {told}"
