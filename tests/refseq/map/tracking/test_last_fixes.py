"""Views weighed by the odometer since the last fixes: a way off the path past what hangs on it elsewhere."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq.atlas.decision import Decision
from refseq.atlas.merge import merge_maps
from refseq.belief import Belief, Stage, Timings, belief_from
from refseq.map.learning import learn
from refseq.map.localiser import localise
from refseq.map.map import Map, beside
from refseq.map.matcher import Measurement
from refseq.map.profile import BEST
from refseq.map.tracking.last_fixes import APART, DRIFT, LEAST, NEAR, LastFixes, can_trust_fixes
from refseq.view import ASSUMED, View
from tests.refseq.rooms import bits_drive, bits_sequence
from tests.support import corridor_drive

STEP = 1.0
"""Way between places and between views [m]."""
COUNT = 40
"""Places of the path: 20 m east, then 20 m north."""


def drive(turns: dict[int, float]) -> list[Measurement]:
    """The steps of a robot that drives straight on but for ``turns`` [rad], by the number of the view."""
    return [step(turn=turns.get(number, 0.0), distance=STEP if number else 0.0) for number in range(COUNT)]


def step(distance: float = STEP, turn: float = 0.0, carried: float = -8.0, again: bool = False) -> Measurement:
    even = np.full(COUNT, 1 / COUNT)
    return Measurement(even, distance, Timings(), np.zeros(COUNT), turn=turn, log_ratio_carried=carried, again=again)


ROUND, STRAIGHT = drive({20: math.pi / 2}), drive({})
LEFT: list[int | None] = [*range(21), *[None] * 19]
"""The places that a robot is sure of which leaves its path at the corner."""


def dead_reckoned(steps: Sequence[Measurement]) -> np.ndarray:
    """Poses by the odometer, (n, 3), the first at the origin: written out, as no part of the bench is to be trusted."""
    heading = np.cumsum([one.turn for one in steps])
    middle = heading - np.array([one.turn for one in steps]) / 2
    way = np.array([one.distance for one in steps])
    return np.column_stack([np.cumsum(way * np.cos(middle)), np.cumsum(way * np.sin(middle)), heading])


def path_map(steps: Sequence[Measurement], shared: int = COUNT) -> Map:
    """The map of a path that shows the same as all others at its first places, and then what no other does."""
    seen = np.eye(COUNT, 3 * COUNT, dtype=bool)
    seen[shared:] = np.roll(seen[shared:], COUNT, axis=1)
    views = bits_drive({"camera": seen}, [one.distance for one in steps])
    profile = replace(BEST, log_ratio=replace(BEST.log_ratio, fixes=5))
    return Map.of(replace(bits_sequence(views, profile), odometry=dead_reckoned(steps)), "path")


MAP = path_map(ROUND)


def sure(place: int, lost: float = 0.0) -> Belief:
    return belief_from(np.eye(COUNT)[place], lost)


def followed(map_: Map, steps: Sequence[Measurement], places: Sequence[int | None]) -> tuple[LastFixes, np.ndarray]:
    """Log ratios of the places at the last of some steps, each with the place that it is sure of; None: of none."""
    fixes = LastFixes(map_)
    for one, place in zip(steps, places, strict=True):
        told = fixes.weighed([one])[0].log_ratio
        fixes.remember([one], sure(place or 0, 0.0 if place is not None else 1.0))
    assert told is not None
    return fixes, told


def test_nothing_speaks_against_the_places_of_a_robot_on_its_path() -> None:
    for number in range(1, COUNT):
        _, told = followed(MAP, ROUND[: number + 1], list(range(number + 1)))
        assert told[number] == 0


def test_who_goes_straight_on_is_not_behind_the_corner() -> None:
    """Nineteen metres past a corner that it did not take, it is 27 m from where the path has led meanwhile."""
    _, told = followed(MAP, STRAIGHT, LEFT)
    assert told[39] < math.log(0.1) < told[23]


def test_every_ratio_is_as_written_out() -> None:
    """Each place, for each of three fixes by itself: how far off, and how much bent, is more than drift allows."""
    known, last = [1, 9, 17], COUNT - 1
    _, told = followed(MAP, STRAIGHT, [number if number in known else None for number in range(COUNT)])
    ours, theirs = dead_reckoned(STRAIGHT), dead_reckoned(ROUND)
    expected = np.zeros(COUNT)
    for place in range(COUNT):
        for fix in known:
            way = (last - fix) + abs(place - fix)
            # All fixes lie on the path's first leg, where its frame is the robot's own.
            far = math.dist(ours[last][:2], theirs[place][:2]) - (NEAR + DRIFT * way)
            bent = abs(theirs[place][2]) - (math.radians(30) + math.radians(1) * way)
            z = max(0.0, far) / (0.5 * (NEAR + DRIFT * way)), max(0.0, bent) / math.radians(15)
            expected[place] += max(-0.5 * (z[0] ** 2 + z[1] ** 2), math.log(LEAST)) / len(known)
    assert expected.min() < -1
    np.testing.assert_allclose(told, expected, atol=1e-9)


@given(
    st.lists(
        st.tuples(st.floats(-2, 2), st.floats(-3, 3), st.floats(-8, 8), st.none() | st.integers(0, COUNT - 1)),
        min_size=1,
        max_size=30,
    )
)
def test_no_place_is_ever_spoken_for_nor_ruled_out(
    drive: list[tuple[float, float, float, int | None]],
) -> None:
    steps = [step(distance, turn, carried) for distance, turn, carried, _ in drive]
    _, told = followed(MAP, steps, [place for *_, place in drive])
    assert (told <= 0).all()
    assert (told >= math.log(LEAST) - 1e-9).all()


def test_a_robot_that_was_carried_may_be_anywhere() -> None:
    """Pictures and scans that tell so leave no fix from before; a step of which they tell nothing leaves all."""
    for carried, least, most in ((30.0, -0.01, 0.0), (0.0, -9.0, math.log(0.1))):
        steps = [*STRAIGHT[:25], replace(STRAIGHT[25], log_ratio_carried=carried), *STRAIGHT[26:]]
        _, told = followed(MAP, steps, LEFT)
        assert least <= told[39] <= most


def test_by_and_by_it_may_have_been_carried_unseen() -> None:
    """Hours in the dark: steps of which nothing is seen leave ever less to speak against."""
    dark = [replace(one, log_ratio_carried=0.0) for one in STRAIGHT]
    standing = [step(0.0, 0.0, carried=0.0)] * 2000
    fixes, soon = followed(MAP, dark, LEFT)
    for one in standing:
        still = fixes.weighed([one])[0].log_ratio
    assert still is not None
    np.testing.assert_allclose(still, soon, err_msg="a robot that stands is not carried by that")
    back_and_forth = [step(STEP if number % 2 else -STEP, 0.0, carried=0.0) for number in range(1000)]
    for one in back_and_forth:
        told = fixes.weighed([one])[0].log_ratio
    assert told is not None
    assert told.min() > math.log(0.95)


def test_a_way_that_nobody_measured_leaves_nothing_known() -> None:
    fixes, _ = followed(MAP, STRAIGHT, LEFT)
    assert (fixes.weighed([step(math.nan, math.nan)])[0].log_ratio == 0).all()
    assert (fixes.weighed([step()])[0].log_ratio == 0).all()


def test_a_sensor_alone_is_asked_for_no_fixes_unless_nobody_carries_the_robot(maps: tuple[Map, Map]) -> None:
    never = learn(seen(1, math.pi / 2)[:3], profile="best+chain.carried=0")
    for sensors in (["laser"], ["forward"], ["laser", "forward"], ["forward", "lateral"]):
        assert can_trust_fixes(maps[1], sensors) == (len(sensors) > 1)
        assert can_trust_fixes(never, sensors)
    assert can_trust_fixes(maps[1], None)


def test_a_map_of_pictures_whose_way_was_assumed_tells_of_no_way() -> None:
    """Nobody knows that they were taken a metre apart, nor that it went straight on."""
    assumed = MAP.noted({"odometry": f"{ASSUMED}: 1 m a picture"})
    _, told = followed(assumed, STRAIGHT, LEFT)
    assert (told == 0).all()


def test_a_reset_forgets() -> None:
    fixes, _ = followed(MAP, STRAIGHT, LEFT)
    fixes.reset()
    assert (fixes.weighed([step()])[0].log_ratio == 0).all()


def test_only_the_last_fixes_count() -> None:
    """A robot that was sure of a wrong stretch is held to it for as many fixes as are remembered, then no more."""
    straight = path_map(STRAIGHT)
    wrong = [place + 20 for place in range(9)]
    for more, least, most in ((12, -9.0, -0.5), (21, 0.0, 0.0)):
        right = list(range(9, 9 + more))
        _, told = followed(straight, STRAIGHT[: 9 + more], [*wrong, *right])
        assert least <= told[right[-1]] <= most


def test_fixes_are_apart() -> None:
    """Views nearer to each other than that are one fix: two of three that would tell otherwise are not remembered."""
    steps = [step(APART / 40) for _ in range(3)]
    fixes = LastFixes(MAP)
    for one, place in zip(steps, (0, 30, 30), strict=True):
        fixes.weighed([one])
        fixes.remember([one], sure(place))
    told = fixes.weighed([step(0.0)])[0].log_ratio
    assert told is not None
    assert told[0] == 0
    assert told[30] < -1


def test_views_of_a_stand_move_nothing() -> None:
    fixes, _ = followed(MAP, STRAIGHT, LEFT)
    before = fixes.weighed([step(0.0)])[0].log_ratio
    again = fixes.weighed([step(7.0, 2.0, again=True)])[0].log_ratio
    assert before is not None
    np.testing.assert_array_equal(before, again)


def test_what_is_not_sure_is_no_fix() -> None:
    spread = belief_from(np.full(COUNT, 1 / COUNT), 0.0)
    fixes = LastFixes(MAP)
    for one in STRAIGHT:
        fixes.weighed([one])
        for doubtful in (spread, sure(3, 0.02)):
            fixes.remember([one], doubtful)
    assert (fixes.weighed([step()])[0].log_ratio == 0).all()


CORNER = 12


def seen(seed: int, turn: float, carried: range = range(0)) -> list[View]:
    """A corridor by its pictures and scans, a turn by its odometer, and views that it is carried past."""
    views = corridor_drive(np.random.default_rng(seed), count=30, size=96)
    turned = [replace(view, turn=turn if number == CORNER else 0.0) for number, view in enumerate(views)]
    return [view for number, view in enumerate(turned) if number not in carried]


@pytest.fixture(scope="module")
def maps() -> tuple[Map, Map]:
    """A map that does not ask, and one that does: of a robot seldom carried, as drawn pictures hardly ever follow.

    Without a tail, as these pictures are so like the map's that with it an odometer's word would not count.
    """
    views, profile = seen(1, math.pi / 2), "best+chain.carried=0.0005+log_ratio.tail=0+log_ratio.fixes={}"
    return learn(views, profile=profile.format(0)), learn(views, profile=profile.format(5))


def lost(map_: Map, views: Sequence[View]) -> np.ndarray:
    return np.array([belief.lost for belief in localise(map_, views, stages=[Stage.CHAIN])[Stage.CHAIN]])


def test_who_goes_straight_on_past_the_same_pictures_is_believed_less(maps: tuple[Map, Map]) -> None:
    """Until views that cannot be told from the map's, by any sensor, have said far more than an odometer may."""
    straight = seen(2, 0.0)
    without, asking = (lost(map_, straight) for map_ in maps)
    assert (asking > 5 * without)[CORNER + 4 : CORNER + 9].all()
    np.testing.assert_allclose(without[:CORNER], asking[:CORNER], atol=1e-6)


def test_who_takes_the_corner_is_believed_as_before(maps: tuple[Map, Map]) -> None:
    without, asking = (lost(map_, seen(2, math.pi / 2)) for map_ in maps)
    assert asking.max() <= without.max() + 0.01


def test_who_is_carried_ahead_is_found_again(maps: tuple[Map, Map]) -> None:
    """Nine metres that no odometer saw, past the corner: pictures that differ anyway tell nothing of it."""
    without, asking = (lost(map_, seen(2, math.pi / 2, range(CORNER - 4, CORNER + 8))) for map_ in maps)
    assert without[-1] < 0.1
    assert asking[-1] < 0.1


def test_places_of_a_path_that_is_not_joined_are_left_alone() -> None:
    """Nobody knows where it lies to the other: both paths have the frame of their own odometry."""
    both = beside([MAP.named("here"), path_map(ROUND).named("there")])
    fixes = LastFixes(both)
    for number, one in enumerate(STRAIGHT):
        measured = fixes.weighed([one, one])
        fixes.remember(measured, belief_from(np.eye(2 * COUNT)[min(number, 20)], 0.0 if number <= 20 else 1.0))
    here, there = (one.log_ratio for one in measured)
    assert here is not None
    assert there is not None
    assert here[39] < -1
    assert (there == 0).all()


def test_a_place_of_two_paths_is_where_either_leads() -> None:
    """Two paths part behind a stretch that they share: a robot on the second is not where the first leads, nor lost."""
    straight = path_map(STRAIGHT, shared=20).named("straight")
    join = Decision("path", "straight", (0, 19), (0, 19), (19.0, 19.0), True, "wished")
    merged = merge_maps([MAP, straight], wishes=[join])
    assert len(merged.map) < 2 * COUNT
    fixes = LastFixes(merged.map)
    shared = merged.map.numbered(merged.map.paths[1])
    for number, one in enumerate(STRAIGHT):
        asked = [replace(one, log_ratio=np.zeros(len(its)), likelihood=np.ones(len(its)) / len(its))
                 for its in merged.map.sequences]  # fmt: skip
        told = np.concatenate([its.log_ratio for its in fixes.weighed(asked)])
        known = np.eye(len(merged.map))[shared[min(number, 19)]]
        fixes.remember(asked, belief_from(known, 0.0 if number < 20 else 1.0))
    own = merged.map.numbered(merged.map.paths[0])
    assert told[shared[39]] == pytest.approx(0.0)
    assert told[own[39]] < -1
