import itertools
import math
from collections.abc import Callable, Iterator

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from refseq_bench.worlds.build import build_world
from refseq_bench.worlds.change.change import KINDS, PRESETS, Change, change_named, changed
from refseq_bench.worlds.change.changes import ASTRAY, NUDGED, THRESHOLD
from refseq_bench.worlds.change.pedestrians import SHORTEST, STAND_EVERY, WALK_EVERY
from refseq_bench.worlds.errors import ChangeError
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.parts.people import Crowd
from refseq_bench.worlds.plans.areas import inside, rectangles
from refseq_bench.worlds.plans.footprints import PERSON_RADIUS, Footprint, clearance, footprints, gaps, taken
from refseq_bench.worlds.plans.frame import LocalFrame
from refseq_bench.worlds.plans.load import load_plan, parse_plan, world_names
from refseq_bench.worlds.plans.rules import checked
from refseq_bench.worlds.plans.schema import FloorPlan, Furniture
from tests.worlds.conftest import corner

Text = Callable[..., str]
HALLWAY, ANNEX = load_plan("hallway"), load_plan("annex")
WAY = 0.8 / 2 + 0.2  # half a robot, and how far it wanders
TURN = math.hypot(0.74, 0.8 / 2) + 0.2  # from the axle to a rear corner, and the same
ALL = Change(*[1.0] * len(KINDS))
strengths = st.one_of(st.just(0.0), st.just(1.0), st.floats(0.0, 1.0))
changes = st.builds(Change, **dict.fromkeys(KINDS, strengths))
seeds = st.integers(0, 2**32)

# --- what people write ---


@given(changes)
def test_a_change_reads_its_own_text(change: Change) -> None:
    assert change_named(change.as_text()) == change


def test_presets_and_what_replaces_their_strengths() -> None:
    assert tuple(PRESETS) == ("none", "few", "busy")
    assert change_named("none") == Change()
    assert Change().as_text() == "none"
    assert change_named("people=0.5,doors=0.3") == Change(people=0.5, doors=0.3)
    few = change_named("few")
    assert change_named("few,doors=0.9") == Change(**{kind: getattr(few, kind) for kind in KINDS} | {"doors": 0.9})
    assert all(0.0 < getattr(few, kind) < getattr(change_named("busy"), kind) for kind in KINDS)


FORM = (
    "any of people=0..1, walkers=0..1, doors=0..1, bins=0..1, furniture=0..1, posters=0..1, cars=0..1, commas between"
)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("lots", f"change 'lots': unknown 'lots'; valid is none, few, busy, or {FORM}"),
        ("", f"change '': unknown ''; valid is none, few, busy, or {FORM}"),
        ("few,dogs=1", f"change 'few,dogs=1': unknown 'dogs=1'; valid is none, few, busy, or {FORM}"),
        ("people", "change 'people': people '' is not valid; it should be from 0 to 1"),
        ("people=many", "change 'people=many': people 'many' is not valid; it should be from 0 to 1"),
        ("people=1.5", "change: people = 1.5 is not valid; it should be from 0 to 1"),
        ("people=0.1,people=0.9", "change 'people=0.1,people=0.9': people is given twice; valid is once"),
        ("few,cars=0,cars=1", "change 'few,cars=0,cars=1': cars is given twice; valid is once"),
        ("doors=nan", "change: doors = nan is not valid; it should be from 0 to 1"),
    ],
)
def test_each_mistake_is_one_line(text: str, said: str) -> None:
    with pytest.raises(ChangeError) as caught:
        change_named(text)
    assert str(caught.value) == said


# --- a dial ---


@pytest.mark.parametrize("change", [Change(), Change(people=1.0)])
def test_a_seed_below_0_is_refused(change: Change) -> None:
    with pytest.raises(ChangeError, match=r"^change: seed = -1 is not valid; it should be 0 or more$"):
        changed(HALLWAY, change, -1)


@settings(max_examples=5)
@given(seeds)
def test_no_strength_changes_nothing(seed: int) -> None:
    assert changed(HALLWAY, Change(), seed) == HALLWAY


@settings(max_examples=5, deadline=None)
@given(changes, seeds)
def test_a_seed_fixes_the_change(change: Change, seed: int) -> None:
    assert changed(ANNEX, change, seed) == changed(ANNEX, change, seed)


@pytest.mark.parametrize("name", ["hallway", "laboratory"])
def test_what_has_changed_can_change_again(name: str) -> None:
    once = changed(load_plan(name), change_named("busy"), 1)
    again = changed(once, change_named("busy"), 1)
    assert len(again.person) > len(once.person)


def test_another_seed_changes_otherwise() -> None:
    assert len({changed(HALLWAY, ALL, seed).model_dump_json() for seed in range(5)}) == 5


def touched(plan: FloorPlan, other: FloorPlan, table: str) -> set[str]:
    """Names of the things of a table that are not as they were, or that are new."""
    before, after = ({item.name: item for item in getattr(p, table)} for p in (plan, other))
    return {name for name in before | after if before.get(name) != after.get(name)}


TABLES = {
    "people": "person",
    "walkers": "person",
    "doors": "door",
    "bins": "bin",
    "furniture": "cabinet",
    "posters": "poster",
}


@settings(max_examples=12, deadline=None)
@given(st.sampled_from(sorted(TABLES)), seeds, st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_more_strength_keeps_what_less_did_and_adds_to_it(kind: str, seed: int, one: float, other: float) -> None:
    less, more = (changed(HALLWAY, Change(**{kind: s}), seed) for s in sorted((one, other)))
    few = touched(HALLWAY, less, TABLES[kind])
    assert few <= touched(HALLWAY, more, TABLES[kind])
    for name in few:
        items = [[i for i in getattr(plan, TABLES[kind]) if i.name == name] for plan in (less, more)]
        assert items[0] == items[1]


@settings(max_examples=3, deadline=None)
@given(changes, seeds)
def test_one_kind_s_strength_touches_no_other_table(change: Change, seed: int) -> None:
    for kind, table in TABLES.items():
        after = changed(HALLWAY, Change(**{kind: getattr(change, kind)}), seed)
        rest = HALLWAY.model_dump(exclude={table})
        assert after.model_dump(exclude={table}) == rest


def share_is(count: int, of: int, strength: float) -> bool:
    """Whether a binomial count lies within four standard deviations."""
    return abs(count - strength * of) <= 4.0 * math.sqrt(of * strength * (1.0 - strength)) + 0.5


@pytest.mark.quick_cases("0.15")
@pytest.mark.parametrize("strength", [0.15, 0.5, 0.8])
def test_strength_is_the_share_of_things_that_change(strength: float) -> None:
    change, runs = Change(doors=strength, bins=strength, furniture=strength), range(20)
    plans = [changed(HALLWAY, change, seed) for seed in runs]
    counts = {table: sum(len(touched(HALLWAY, plan, table)) for plan in plans) for table in ("door", "bin", "cabinet")}
    # Two doors are in the wall with the windows, where there is no room behind.
    assert share_is(counts["door"], 19 * len(runs), strength)
    assert share_is(counts["bin"], 6 * len(runs), strength)
    assert share_is(counts["cabinet"], 7 * len(runs), strength)


def test_posters_are_gone_replaced_or_joined_alike() -> None:
    tally = {"gone": 0, "replaced": 0, "joined": 0, "kept": 0}
    for seed in range(40):
        names = {poster.name for poster in changed(HALLWAY, Change(posters=0.5), seed).poster}
        for poster in HALLWAY.poster:
            there, new = poster.name in names, f"new-{poster.name}" in names
            tally[{(0, 0): "gone", (0, 1): "replaced", (1, 1): "joined", (1, 0): "kept"}[there, new]] += 1
    posters = 40 * len(HALLWAY.poster)
    assert share_is(posters - tally["kept"], posters, 0.5)
    assert all(share_is(tally[what], posters, 1 / 6) for what in ("gone", "replaced", "joined"))


def test_the_number_of_people_is_so_many_a_metre_of_way() -> None:
    plans = [changed(HALLWAY, Change(people=0.5, walkers=0.5), seed) for seed in range(30)]
    standing = sum(not person.walk for plan in plans for person in plan.person)
    walking = sum(bool(person.walk) for plan in plans for person in plan.person)
    assert share_is(standing, 30 * int(96 / STAND_EVERY), 0.5)
    assert share_is(walking, 30 * int(96 / WALK_EVERY), 0.5)


# --- what results can be ---


def route_samples(plan: FloorPlan) -> Iterator[tuple[NDArray[np.float64], float]]:
    """Points all along the routes, and how far around them has to be free."""
    for points in plan.routes.values():
        for start, end in itertools.pairwise(np.array(points)):
            share = np.linspace(0.0, 1.0, 2 + int(np.linalg.norm(end - start) / 0.02))[:, None]
            yield start + share * (end - start), WAY
        yield np.array(points), TURN


@settings(max_examples=15, deadline=None)
@given(st.sampled_from([HALLWAY, ANNEX]), changes, seeds)
def test_all_that_changes_leaves_the_routes_free(plan: FloorPlan, change: Change, seed: int) -> None:
    assert_routes_are_free(plan, checked(changed(plan, change, seed), "changed"))


@pytest.mark.slow_cases("second-floor")
@pytest.mark.parametrize("name", world_names())
def test_every_world_changes_and_keeps_its_routes_free(name: str) -> None:
    plan = load_plan(name)
    after = changed(plan, change_named("busy"), 3)
    assert len(after.person) > len(plan.person) + 2
    assert_routes_are_free(plan, after)


def assert_routes_are_free(plan: FloorPlan, after: FloorPlan) -> None:
    before = set(taken(plan))
    moved = [thing.footprint for thing in taken(after) if thing not in before]
    for points, room in route_samples(plan):
        assert clearance(points, moved).min() >= room - 1e-3


@settings(max_examples=15, deadline=None)
@given(st.sampled_from([HALLWAY, ANNEX]), changes, seeds)
def test_nothing_is_put_into_anything_else(plan: FloorPlan, change: Change, seed: int) -> None:
    after = changed(plan, change, seed)
    before = set(taken(plan))
    ground = list(taken(after))
    thresholds = [threshold(after, door.wall, door.extent) for door in after.door]
    for thing in ground:
        if thing in before:
            continue
        own_wall = getattr(next(i for i in getattr(after, thing.table) if i.name == thing.name), "wall", None)
        rest = [o.footprint for o in ground if o[:2] not in (thing[:2], ("wall", own_wall))]
        assert gaps(thing.footprint, rest).min() > 0.0
        assert inside(after, thing.footprint[:2])
        if thing.table != "person" or thing.footprint.length == 0.0:
            assert gaps(thing.footprint, thresholds).min() > 0.0


def threshold(plan: FloorPlan, wall: str, extent: tuple[float, float]) -> Footprint:
    frame = LocalFrame.of(plan.wall_named(wall))
    x, y, _ = frame.point(sum(extent) / 2, THRESHOLD / 2, 0.0)
    return Footprint(x, y, math.atan2(*frame.along[::-1]), (extent[1] - extent[0]) / 2, THRESHOLD / 2)


@settings(max_examples=10, deadline=None)
@given(st.sampled_from([HALLWAY, ANNEX]), st.floats(0.0, 1.0), seeds)
def test_doors_open_only_where_a_room_fits_behind(plan: FloorPlan, strength: float, seed: int) -> None:
    after = changed(plan, Change(doors=strength), seed)
    windowed = {window.wall for window in plan.window}
    for old, new in zip(plan.door, after.door, strict=True):
        assert new == old or new.model_copy(update={"open": old.open}) == old
        assert new.open == 0.0 or 10.0 <= new.open <= 100.0
        if new.open and not old.open:
            assert new.wall not in windowed
            wall = plan.wall_named(new.wall)
            frame = LocalFrame.of(wall)
            behind = [
                frame.point(s, -wall.thickness - depth, 0.0)[:2]
                for s in np.linspace(new.extent[0] - 0.7, new.extent[1] + 0.7, 9)
                for depth in np.linspace(0.01, new.depth + 0.1, 9)
            ]
            assert not any(area.holds(point) for point in behind for area in rectangles(plan))


def test_doors_open_shut_and_stand_ajar_otherwise() -> None:
    plans = [changed(HALLWAY, Change(doors=0.5), seed) for seed in range(30)]
    pairs = [(old.open, new.open) for plan in plans for old, new in zip(HALLWAY.door, plan.door, strict=True)]
    assert any(old == 0.0 < new for old, new in pairs)
    assert any(new == 0.0 < old for old, new in pairs)
    assert any(0.0 < old != new > 0.0 for old, new in pairs)


@pytest.mark.parametrize("plan", [HALLWAY, ANNEX])
def test_who_walks_has_some_metres_beside_a_route_to_walk(plan: FloorPlan) -> None:
    walkers = [p for seed in range(10) for p in changed(plan, Change(walkers=1.0), seed).person]
    assert len(walkers) > 30
    for person in walkers:
        start, end = np.array(person.path)
        assert np.linalg.norm(end - start) >= SHORTEST - 2e-3
        along = (end - start) / np.linalg.norm(end - start)
        legs = [np.subtract(b, a) for points in plan.routes.values() for a, b in itertools.pairwise(points)]
        assert min(abs(along[0] * leg[1] - along[1] * leg[0]) / np.linalg.norm(leg) for leg in legs) < 1e-3


def test_chairs_and_tables_are_moved_about_a_room(small: Text) -> None:
    rows = "".join(
        f'{{ name = "{kind}{k}", kind = "{kind}", at = [{x}, 2.5], width = 0.5, depth = 0.5, height = 0.7, '
        'material = "door" },\n'
        for k, x in enumerate((1.0, 3.5, 6.5))
        for kind, x in (("chair", x), ("table", x + 0.8))
    )
    text = small(f"furniture = [\n{rows}]").replace("1.2]", "3.5]")
    plan = parse_plan(text)
    moved = 0
    for seed in range(10):
        after = changed(plan, Change(bins=1.0, furniture=1.0), seed)
        for old, new in zip(plan.furniture, after.furniture, strict=True):
            reach = (ASTRAY | NUDGED)[old.kind]
            assert math.dist(old.at, new.at) <= reach + 0.01
            moved += old.at != new.at
        assert separate(after.furniture, after)
    assert moved > 50


def separate(items: tuple[Furniture, ...], plan: FloorPlan) -> bool:
    ground = [footprints(plan, item)[0] for item in items]
    return all(gaps(a, [b])[0] > 0.0 for a, b in itertools.combinations(ground, 2))


def bays(cars: int) -> str:
    spots = "".join(
        f'{{ name = "c{k}", at = [{5.0 + 2.6 * k}, 6], heading = 90, kind = "{kind}" }},\n'
        for k, kind in zip(range(cars), itertools.cycle(["hatchback", "saloon", "van"]))
    )
    return f"car = [\n{spots}]"


@pytest.fixture
def parking(small: Text) -> FloorPlan:
    walls = small(bays(12)).partition("[[wall]]")[0] + "[routes]\nforward = [[2, 0], [36, 0]]"
    roofless = walls.replace('[ceiling]\nheight = 2.8\nmaterial = "plaster"\n', "")
    return parse_plan(roofless.replace("[floor]\n", "[floor]\narea = [[0, -5], [40, 12]]\n"))


def test_cars_leave_or_take_another_s_bay(parking: FloorPlan) -> None:
    places = {car.at for car in parking.car}
    elsewhere = 0
    for seed in range(40):
        after = changed(parking, Change(cars=0.6), seed)
        assert len({car.at for car in after.car}) == len(after.car)
        assert {car.at for car in after.car} <= places
        before = {car.name: car for car in parking.car}
        elsewhere += sum(car.at != before[car.name].at for car in after.car)
    assert elsewhere > 40


def test_the_share_of_cars_that_change_is_the_strength(parking: FloorPlan) -> None:
    counts = [len(touched(parking, changed(parking, Change(cars=0.3), seed), "car")) for seed in range(60)]
    assert share_is(sum(counts), 60 * len(parking.car), 0.3)


def test_more_strength_keeps_what_happened_to_the_cars(parking: FloorPlan) -> None:
    for seed in range(10):
        plans = [changed(parking, Change(cars=strength), seed) for strength in (0.2, 0.5, 0.9)]
        for less, more in itertools.pairwise(plans):
            after = {car.name: car for car in more.car}
            for name in touched(parking, less, "car"):
                assert after.get(name) == next((car for car in less.car if car.name == name), None)


# --- a world in which much has changed, as a body meets it ---


def test_a_body_as_wide_as_the_way_gets_through_a_busy_hallway() -> None:
    plan = changed(HALLWAY, ALL, 2)
    spec = build_world(plan, light_named("18:00"), pictured=False).spec
    probe = spec.worldbody.add_body(name="probe", pos=[50.0, 0.0, 0.51])
    probe.add_freejoint()
    probe.add_geom(name="probe", type=mujoco.mjtGeom.mjGEOM_BOX, size=[48.0 + 0.55, WAY, 0.5])
    model = spec.compile()
    data, crowd = mujoco.MjData(model), Crowd(model, plan)
    assert model.nmocap >= 5 * 3
    for time in np.arange(0.0, 12.0, 0.25):
        crowd.at(data, float(time))
        mujoco.mj_forward(model, data)
        assert {model.geom(g).name for c in data.contact for g in c.geom if c.dist < 0.0} == set()


def test_a_wider_body_meets_people() -> None:
    plan = changed(HALLWAY, Change(people=1.0), 1)
    ground = [t.footprint for t in taken(plan) if t.table == "person"]
    line = np.stack([np.linspace(2, 98, 5000), np.zeros(5000)], axis=1)
    assert WAY < clearance(line, ground).min() < 1.2 - 2 * PERSON_RADIUS


def test_a_door_before_another_corridor_stays_shut() -> None:
    doors = '{ name = "free", wall = "inner-1", at = 1.2 }, { name = "near", wall = "inner-1", at = 3.3 }'
    door = "door = { albedo = 0.3, roughness = 0.5 }\n"
    plan = parse_plan(f"door = [{doors}]\n" + corner().replace("[material]\n", "[material]\n" + door))
    after = [changed(plan, Change(doors=1.0), seed).door for seed in range(3)]
    assert all(free.open > 0.0 and near.open == 0.0 for free, near in after)
