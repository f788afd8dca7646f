import re
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from refseq_bench.worlds.errors import PlanError
from refseq_bench.worlds.plans.areas import enclosing, rectangles
from refseq_bench.worlds.plans.footprints import Footprint, gaps, room_behind
from refseq_bench.worlds.plans.generate import corridor
from refseq_bench.worlds.plans.load import load_plan, parse_plan
from refseq_bench.worlds.plans.schema import ON_WALL, FloorPlan
from refseq_bench.worlds.plans.write import plan_text

seeds = st.integers(0, 10**18 - 1)
quick = settings(max_examples=40, deadline=None)


def length(plan: FloorPlan) -> float:
    return sum(float(np.hypot(*np.subtract(b, a))) for a, b in pairwise(plan.routes["forward"]))


@given(seeds)
@quick
def test_a_corridor_written_down_is_read_back_the_same(seed: int) -> None:
    plan = corridor(seed)
    assert parse_plan(plan_text(plan, "made from a seed")) == plan


@given(seeds)
@quick
def test_a_seed_gives_one_corridor(seed: int) -> None:
    assert plan_text(corridor(seed)) == plan_text(corridor(seed))


@given(seeds)
@quick
def test_walls_close_the_corridor_off_and_the_way_through_its_middle_stays_inside(seed: int) -> None:
    plan = corridor(seed)
    assert enclosing(plan) == plan.wall
    half, areas = plan.wall_named("start").length / 2, rectangles(plan)
    for a, b in pairwise(np.array(plan.routes["forward"])):
        across = np.array([a[1] - b[1], b[0] - a[0]]) / np.linalg.norm(b - a)
        on_axis = np.isclose(np.abs(across).max(), 1.0)
        for t in np.linspace(0.0, 1.0, 50):
            point = a + t * (b - a)
            reach = half - 0.01 if on_axis else 0.5
            for side in (point + reach * across, point - reach * across):
                assert any(area.holds(side) for area in areas)
    assert plan.routes["reverse"] == plan.routes["forward"][::-1]


@given(seeds)
@quick
def test_a_corridor_has_the_size_that_is_promised(seed: int) -> None:
    plan = corridor(seed)
    bends = len(plan.routes["forward"]) // 2 - 1
    # A cut corner is shorter than the corner by (2 - √2) times what is cut off each leg.
    along = length(plan) + 4.0 + bends * (2 - np.sqrt(2))
    assert 39.7 < along < 120.3
    assert 1.8 <= plan.wall_named("start").length <= 3.0
    told = re.search(r"of (\d+) m", plan.title)
    assert told
    assert float(told[1]) == pytest.approx(along, abs=0.51)


@cache
def sixty() -> list[FloorPlan]:
    return [corridor(seed) for seed in range(60)]


def test_corridors_differ() -> None:
    plans = sixty()
    texts = {re.sub(r"^(name|title).*$", "", plan_text(p), flags=re.MULTILINE) for p in plans}
    assert len(texts) == len(plans)
    assert {len(p.routes["forward"]) for p in plans} == {2, 4, 6}
    assert 0.3 < np.mean([bool(p.window) for p in plans]) < 0.9
    for table in ON_WALL:
        counts = [len(getattr(p, table)) for p in plans]
        assert len(set(counts)) > 3, table
    assert any(d.open for p in plans for d in p.door)


def test_some_corridors_have_bare_stretches() -> None:
    # Where things hang by chance alone, a wall of every seventh corridor has 8 m with nothing on it.
    assert sum(longest_bare(p) > 8.0 for p in sixty()) > 60 / 4


def test_rooms_behind_open_doors_reach_into_no_corridor_and_no_other_room() -> None:
    for plan in sixty():
        rooms = [room_behind(plan, door) for door in plan.door if door.open]
        ground = [Footprint(*area.middle, 0.0, *area.size / 2) for area in rectangles(plan)]
        for i, room in enumerate(rooms):
            assert gaps(room, ground + rooms[:i]).min() > 0.0, plan.name


def longest_bare(plan: FloorPlan) -> float:
    """The longest stretch of a side wall with nothing on it [m]."""
    found = 0.0
    for wall in plan.wall:
        items = sorted(i.extent for table in ON_WALL for i in getattr(plan, table) if i.wall == wall.name)
        ends = [0.0, *(end for extent in items for end in extent), wall.length]
        found = max(found, *np.diff(ends)[::2])
    return found


def test_some_stretches_come_again_thing_for_thing() -> None:
    assert sum(most_repeated(plan) >= 4 for plan in sixty()[:40]) >= 5


def most_repeated(plan: FloorPlan) -> int:
    """How many things of a wall come again at one and the same distance."""
    most = 0
    for wall in plan.wall:
        items = [i for table in ON_WALL for i in getattr(plan, table) if i.wall == wall.name]
        rest = [(type(i), i.model_copy(update={"name": "", "at": 0.0}).model_dump_json()) for i in items]
        shifts = [round(b.at - a.at, 2) for i, a in enumerate(items) for j, b in enumerate(items) if rest[i] == rest[j]]
        distances, counts = np.unique([s for s in shifts if s > 5.0], return_counts=True)
        # Windows stand at a regular pitch and repeat of themselves.
        most = max(most, *counts, 0) if len(distances) and not plan.window else most
    return most


def test_a_corridor_is_a_world_by_its_seed() -> None:
    assert load_plan("corridor:7") == corridor(7)


@pytest.mark.parametrize("name", ["corridor:", "corridor:-1", "corridor:x", "corridor:1.5", "corridor", "corridor:²"])
def test_a_seed_that_is_none(name: str) -> None:
    with pytest.raises(PlanError) as caught:
        load_plan(name)
    assert str(caught.value).startswith(f"unknown world '{name}'; known are annex, ")
    assert str(caught.value).endswith(
        "corridor:SEED, building:SEED (a whole number from 0, 18 digits at most), or a path ending in .toml"
    )


@given(st.text(st.characters(exclude_categories=["Cs"]), max_size=12))
@quick
def test_any_text_survives_being_written(text: str) -> None:
    plan = corridor(3)
    door = plan.door[0].model_copy(update={"label": text})
    changed = plan.model_copy(update={"door": (door, *plan.door[1:]), "title": text if text.isprintable() else ""})
    assert parse_plan(plan_text(changed)) == changed


def test_a_plan_of_the_library_survives_being_written() -> None:
    plan = load_plan("annex")
    assert parse_plan(plan_text(plan)) == plan
