"""What the plan of the second floor says of itself."""

import itertools
import math

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from refseq_bench.worlds.build import build_world
from refseq_bench.worlds.check import RobotBox, check_world, geom_boxes
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.parts.site import SOLID
from refseq_bench.worlds.plans.areas import enclosing, rectangles
from refseq_bench.worlds.plans.frame import LocalFrame
from refseq_bench.worlds.plans.load import load_plan
from refseq_bench.worlds.plans.schema import ON_WALL, OnWall

PLAN = load_plan("second-floor")
FOUR = ("path-1", "path-2", "path-3", "path-4")
SPACING = 0.85
"""Between two views of the thesis' sequences [m]."""
STEP = 0.1


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    """The floor in the evening, when most lamps burn."""
    return build_world(PLAN, light_named("21:30"), pictured=False).spec.compile()


@pytest.fixture(scope="module")
def data(model: mujoco.MjModel) -> mujoco.MjData:
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return data


# --- routes ---


def length(route: str) -> float:
    return sum(math.dist(a, b) for a, b in itertools.pairwise(PLAN.routes[route]))


def trodden(route: str) -> NDArray[np.float64]:
    """Rows (x, y, dx, dy): a place every 10 cm of a route and the direction in which it is passed."""
    rows = []
    for a, b in itertools.pairwise(np.array(PLAN.routes[route])):
        count = round(math.dist(a, b) / STEP)
        along = np.linspace(0.0, 1.0, count, endpoint=False)[:, None]
        rows.append(np.hstack([a + along * (b - a), np.tile((b - a) / math.dist(a, b), (count, 1))]))
    return np.concatenate(rows)


def on_both(route: str, other: str, turned: bool = False) -> NDArray[np.bool_]:
    """Which places of ``route`` lie on ``other``, passed in the same direction, or with ``turned`` in the opposite."""
    one, two = trodden(route), trodden(other)
    near = np.hypot(*(one[:, None, :2] - two[None, :, :2]).transpose(2, 0, 1)) < STEP
    cosine = one[:, 2:] @ two[:, 2:].T
    return (near & ((-cosine if turned else cosine) > 0.99)).any(axis=1)


def test_two_paths_have_the_lengths_of_the_thesis_sequences() -> None:
    assert length("path-a") == pytest.approx(55 * SPACING, abs=0.6)
    assert length("path-b") == pytest.approx(98 * SPACING, abs=0.6)


def test_they_come_from_two_sides_share_a_stretch_in_the_middle_and_fork() -> None:
    for route, other, begins in (("path-a", "path-b", 16), ("path-b", "path-a", 22)):
        shared = np.flatnonzero(on_both(route, other))
        assert np.all(np.diff(shared) == 1), "one stretch"
        assert 20.0 < len(shared) * STEP < 25.0
        assert shared[0] * STEP == pytest.approx(begins * SPACING, abs=SPACING)
        assert shared[-1] * STEP < length(route) - 10.0
    a, b = (np.array(PLAN.routes[name]) for name in ("path-a", "path-b"))
    assert a[0, 0] < 26.0 < b[0, 0]
    assert a[-1, 0] < 26.0 < b[-1, 0]


def test_four_paths_are_300_m_in_all_and_each_is_driven_both_ways() -> None:
    assert sum(length(name) for name in FOUR) == pytest.approx(300.0, abs=3.0)
    for name in FOUR:
        assert PLAN.routes[f"{name}-reverse"] == PLAN.routes[name][::-1]
    assert PLAN.routes["reverse"] == PLAN.routes["forward"][::-1]
    assert PLAN.routes["forward"] == PLAN.routes[max(("path-a", "path-b", *FOUR), key=length)]


def test_four_paths_overlap_as_in_the_thesis() -> None:
    same = {pair: round(on_both(*pair).sum() * STEP) for pair in itertools.combinations(FOUR, 2)}
    against = {pair: round(on_both(*pair, turned=True).sum() * STEP) for pair in itertools.combinations(FOUR, 2)}
    # A with B and C with D in the same direction, B with D in the opposite one; the rest at most where corridors meet.
    assert {pair for pair, metres in same.items() if metres > 3} == {("path-1", "path-2"), ("path-3", "path-4")}
    assert same["path-1", "path-2"] > 40
    assert same["path-3", "path-4"] > 40
    assert against["path-2", "path-4"] > 30


# --- walls and rooms ---


def test_the_walls_close_the_floor_off() -> None:
    assert enclosing(PLAN) == PLAN.wall


@pytest.mark.slow
def test_nothing_stands_in_anything_else_and_a_body_1_3_m_wide_gets_along_every_route() -> None:
    cart = RobotBox("cart", front=0.55, back=0.55, half_width=0.6, height=1.3)  # 5 cm are added on all sides
    one_way = {name: PLAN.routes[name] for name in ("path-a", "path-b", *FOUR)}  # the cart has no front
    plan = PLAN.model_copy(update={"routes": one_way})
    assert check_world(plan, light_named("16:00"), [cart]).findings == ()


def test_rooms_behind_open_doors_keep_to_themselves(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    low, high = geom_boxes(model, data)
    rooms = {}
    for door in (d for d in PLAN.door if d.open > 0.0):
        parts = [i for i in range(model.ngeom) if model.geom(i).name.startswith(f"door:{door.name}:room:")]
        rooms[door.name] = low[parts, :2].min(axis=0), high[parts, :2].max(axis=0)
        outside = [i for i in parts if not model.geom(i).name.endswith(":floor")]  # the floor reaches to the sill
        for area in rectangles(PLAN):
            apart = np.maximum(low[outside, :2] - area.high, area.low - high[outside, :2]).max(axis=1)
            assert np.all(apart > 0.1), f"{door.name} reaches into a corridor"
    assert len(rooms) == 6
    for (one, (a, b)), (other, (c, d)) in itertools.combinations(rooms.items(), 2):
        assert np.maximum(a - d, c - b).max() > 0.0, f"{one} and {other} overlap"


# --- what hangs where ---


def place(item: OnWall) -> NDArray[np.float64]:
    """Where on the floor plan its centre is, (2,) [m]."""
    return LocalFrame.of(PLAN.wall_named(item.wall)).point(item.at, 0.0, 0.0)[:2]


def hung() -> list[OnWall]:
    return [item for table in ON_WALL for item in getattr(PLAN, table)]


def test_the_west_corridor_is_bare_for_more_than_15_m() -> None:
    reaches = sorted(
        (place(item)[1] - item.width / 2, place(item)[1] + item.width / 2)
        for item in hung()
        if item.wall in ("west", "west-theatre")
    )
    widest = max(
        itertools.pairwise(itertools.accumulate(reaches, lambda past, one: (one[0], max(past[1], one[1])))),
        key=lambda pair: pair[1][0] - pair[0][1],
    )
    begin, end = widest[0][1], widest[1][0]
    assert end - begin > 15.0
    middle = np.array(PLAN.wall_named("west").start)[0] + 1.2, (begin + end) / 2
    assert all(math.dist(middle, item.at) > 8.0 for item in PLAN.furniture)
    passing = trodden("path-1")
    assert ((passing[:, 1] > begin) & (passing[:, 1] < end) & (np.abs(passing[:, 0] - middle[0]) < 0.1)).any()


def test_two_stretches_of_the_north_corridor_are_alike_piece_by_piece_and_lamp_by_lamp() -> None:
    def between(first: float, last: float) -> set[tuple[object, ...]]:
        """All that hangs between two lines across the corridor, without names and walls, from the first line on."""
        found = set()
        for item in hung():
            x, y = place(item)
            if first < x < last and item.wall.startswith("north-"):
                rest = item.model_dump(exclude={"name", "at", "wall"})
                found.add((type(item).__name__, round(x - first, 6), y, *sorted(rest.items())))
        return found | {("Lamp", round(x - first, 6), y) for x, y in lamps if first < x < last and abs(y - 24.1) < 1}

    lamps = [tuple(at) for row in PLAN.lamp for at in row.positions.tolist()]
    assert len(between(4, 16)) == 11 + 3
    assert between(4, 16) == between(32, 44)


def test_two_paths_pass_the_stretches_in_the_same_direction() -> None:
    for route, first, last in (("path-2", 4.0, 16.0), ("path-3", 32.0, 44.0), ("path-4", 32.0, 44.0)):
        rows = trodden(route)
        there = rows[(rows[:, 0] > first) & (rows[:, 0] < last) & (rows[:, 1] == 24.1)]
        assert len(there) == pytest.approx((last - first) / STEP, abs=2), route
        np.testing.assert_allclose(there[:, 2:], [[-1.0, 0.0]] * len(there), atol=1e-9)


def ahead(model: mujoco.MjModel, data: mujoco.MjData, start: tuple[float, float, float]) -> float:
    """Return how far a beam along +y gets before it meets something solid [m]."""
    groups = np.zeros(6, np.uint8)
    groups[SOLID] = 1
    along = np.array([0.0, 1.0, 0.0])
    return mujoco.mj_ray(model, data, np.array(start), along, groups, 1, -1, np.zeros(1, np.int32))


def test_the_stairs_rise_from_the_lobby_where_a_laser_finds_them(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    # 0.4 m up, where a laser may look, is between the second and the third tread; the third riser is two runs up.
    for x in (19.7, 20.6, 21.5):
        assert ahead(model, data, (x, 3.0, 0.4)) == pytest.approx(7.4 + 2 * 0.28 - 3.0, abs=1e-6)


def test_it_stays_within_what_the_renderer_takes(model: mujoco.MjModel) -> None:
    assert model.nlight <= 256
    assert model.ngeom < 900
    assert model.ntexdata < 200e6
