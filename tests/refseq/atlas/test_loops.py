"""Paths that come back to themselves: a figure of eight, a way round, a way there and back, and none."""

import math
from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from refseq.atlas.decision import Decision
from refseq.atlas.found import FoundOverlap
from refseq.atlas.loops import NEVER, LoopSearch, OwnTranslation, by_rounds, elsewhere
from refseq.atlas.merge import merge_maps
from refseq.atlas.overlap import SHORT_JOINS, Overlap
from refseq.atlas.routes import CHANGE, place_of, shortest_route
from refseq.atlas.scan_check import ScanCheck
from refseq.atlas.sharing import loops_of
from refseq.atlas.similarity import translated
from refseq.belief import Stage, Timings
from refseq.dead_reckoning import dead_reckoned
from refseq.map.localiser import localise, smoothed
from refseq.map.map import Map
from refseq.map.matcher import Measurement
from refseq.map.paths.path import MapPath
from refseq.map.profile import BEST, profile_named
from refseq.map.reduction import reduced
from refseq.planar import Pose, motion_between
from refseq.view import View
from tests.refseq.rooms import bits_sequence

Corners = tuple[tuple[float, float], ...]
EIGHT: Corners = ((0, 0), (20, 0), (20, 16), (40, 16), (40, 0), (20, 0), (20, 16), (0, 16), (0, 8))
"""The middle of the eight, 16 m long, is driven twice the same way round."""
RING: Corners = ((0, 0), (20, 0), (20, 15), (0, 15), (0, 0), (14, 0))
ROUND: Corners = RING[:4]
THERE_AND_BACK: Corners = ((0, 0), (30, 0), (30, 0.5), (0, 0.5))
STRAIGHT: Corners = ((0, 0), (30, 0), (30, 16), (60, 16))
FEATURES, SIGHT = 20_000, 2.0


@cache
def field() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Spots of features in the plane, (n, 2) [m], and the headings that they are seen from."""
    rng = np.random.default_rng(7)
    return rng.uniform((-5, -5), (65, 25), (FEATURES, 2)), rng.uniform(-math.pi, math.pi, FEATURES)


def driven(corners: Corners, seed: int, missed: float = 0.3) -> list[View]:
    """A drive past a field of features, a view a metre; the odometry drifts a little, and features are missed."""
    rng, (spots, ways) = np.random.default_rng(seed), field()
    poses = [
        Pose(x + at * math.cos(heading), y + at * math.sin(heading), heading)
        for (x, y), (to_x, to_y) in pairwise(corners)
        for heading in [math.atan2(to_y - y, to_x - x)]
        for at in np.arange(0.0, math.hypot(to_x - x, to_y - y)).tolist()
    ]
    views = []
    for number, pose in enumerate(poses):
        near = np.hypot(spots[:, 0] - pose.x, spots[:, 1] - pose.y) < SIGHT
        seen = {"camera": near & (np.cos(ways - pose.heading) > math.cos(math.pi / 4))}
        images = {
            name: ((bits & (rng.random(len(bits)) >= missed)) | (rng.random(len(bits)) < 0.001))[None].astype(np.uint8)
            for name, bits in seen.items()
        }
        distance, turn = motion_between(poses[number - 1], pose) if number else (0.0, 0.0)
        noisy = distance * (1 + rng.normal(scale=0.02)), turn + rng.normal(scale=0.01) * bool(number)
        views.append(View(float(number), images, None, *noisy, pose))
    return views


def map_of(corners: Corners, seed: int = 1, name: str = "drive") -> Map:
    """The map of a drive, which asks no later one what is usual there, nor its last fixes: hindsight never does."""
    views, profile = driven(corners, seed), profile_named("best+log_ratio.usual=0+log_ratio.fixes=0")
    return Map.of(replace(bits_sequence(views, profile), odometry=dead_reckoned(views)), name)


@cache
def eight() -> Map:
    """The map of the eight, merged alone."""
    return merge_maps([map_of(EIGHT)]).map


def true_poses(map_: Map) -> NDArray[np.float64]:
    return np.array([(p.x, p.y, p.heading) for p in map_.poses if p])


def twice(poses: NDArray[np.float64]) -> NDArray[np.intp]:
    """Views that are where the path was at least 10 m of way before, in the same direction."""
    near = np.hypot(*(poses[:, None, :2] - poses[None, :, :2]).transpose(2, 0, 1)) <= 0.6
    near &= np.cos(poses[:, None, 2] - poses[None, :, 2]) > 0.9
    return np.flatnonzero(np.tril(near, -10).any(axis=1))


@pytest.mark.quick_cases("3-corners1-14")
@pytest.mark.parametrize(("corners", "back"), [(EIGHT, 16), (RING, 14)])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_path_that_comes_back_to_itself_is_joined_there(corners: Corners, back: int, seed: int) -> None:
    learnt = map_of(corners, seed)
    merged = merge_maps([learnt])
    (decision,) = [one for one in merged.decisions if one.joined]
    assert (decision.one, decision.other) == ("drive", "drive")
    assert decision.first[1] < decision.second[0]
    poses, (path,) = true_poses(learnt), merged.map.paths
    expected = twice(poses)
    assert abs(len(expected) - back) <= 1
    off = np.hypot(*(poses[path.loops[:, 0], :2] - poses[path.loops[:, 1], :2]).T)
    # An alignment may be a place off.
    assert off.max() <= 1.5
    assert len(np.intersect1d(path.loops[:, 1], expected)) >= 0.8 * len(expected)
    # All places stay where they were, and the plan closes.
    assert merged.map.sequences == learnt.sequences
    np.testing.assert_array_equal(path.places, np.arange(len(learnt)))
    ends = path.loops[len(path.loops) // 2]
    before, after = (np.hypot(*np.diff(track[ends, :2], axis=0)[0]) for track in (learnt.sequence.odometry, path.poses))
    assert after < max(before, 0.8)


@pytest.mark.quick_cases("3")
@pytest.mark.parametrize("rounds", [3, 4])
def test_every_round_of_a_path_is_joined_with_those_before(rounds: int) -> None:
    """They look alike, so that each view is as likely in any of the others."""
    learnt = map_of((*ROUND * rounds, ROUND[0]))
    merged = merge_maps([learnt])
    poses, (path,) = true_poses(learnt), merged.map.paths
    first = len(poses) // rounds
    assert np.isin(np.arange(first, len(poses)), path.loops[:, 1]).mean() > 0.8
    off = np.hypot(*(poses[path.loops[:, 0], :2] - poses[path.loops[:, 1], :2]).T)
    assert off.max() <= 1.5
    # A place is one with those of all rounds, though no pair may lead from one to the other.
    places = first // 2 + first * np.arange(rounds)
    for place in places:
        np.testing.assert_allclose(merged.map.with_twins(np.array([place])), places, atol=1)
    # Stretches that take turns are told apart again.
    assert len(loops_of(path)) == sum(decision.joined for decision in merged.decisions)
    np.testing.assert_array_equal(np.unique(np.concatenate(loops_of(path)), axis=0), path.loops)


@given(st.integers(1, 30), st.integers(1, 12), st.integers(0, 9))
def test_a_stretch_of_rounds_is_cut_so_that_none_comes_to_where_it_began(count: int, apart: int, first: int) -> None:
    pairs = np.column_stack([np.arange(count), np.arange(count) + apart]) + first
    parts = list(by_rounds(pairs))
    np.testing.assert_array_equal(np.concatenate(parts), pairs)
    assert all(part[-1, 0] < part[0, 1] for part in parts)
    assert len(parts) == math.ceil(count / apart)


def test_short_joins_of_a_path_with_itself_have_the_earlier_view_first() -> None:
    """Else the map that they make could not be read."""
    merged = merge_maps([map_of(EIGHT)], SHORT_JOINS).map
    assert (merged.paths[0].loops[:, 0] < merged.paths[0].loops[:, 1]).all()


@pytest.mark.quick_cases("1-corners0", "3-corners1")
@pytest.mark.parametrize("corners", [STRAIGHT, THERE_AND_BACK])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_path_without_loops_stays_as_it_is(corners: Corners, seed: int) -> None:
    """A way back is another place to a camera that looks ahead."""
    learnt = map_of(corners, seed)
    merged = merge_maps([learnt])
    assert merged.decisions == ()
    assert merged.map.to_bytes() == learnt.to_bytes()


def test_a_way_back_that_looks_like_the_way_there_is_contradicted_by_odometry() -> None:
    views = driven(THERE_AND_BACK, 4)
    # What looks as it did: the way back is replayed as the way there.
    half = len(views) // 2
    alike = [*views[:half], *(replace(v, images=views[n].images) for n, v in enumerate(views[half : 2 * half]))]
    learnt = Map.of(replace(bits_sequence(alike, BEST), odometry=dead_reckoned(alike)), "drive")
    merged = merge_maps([learnt])
    assert merged.found
    assert not any(decision.joined for decision in merged.decisions)
    assert any("odometry contradict it" in decision.why for decision in merged.decisions)
    assert merged.map.to_bytes() == learnt.to_bytes(), "what is refused leaves no trace"


@pytest.mark.parametrize(("objection", "count"), [("", 2), ("its scans do not lie on each other", 1)])
def test_a_path_is_looked_through_again_while_scans_let_something_stand(
    objection: str, count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    looks: list[LoopSearch] = []
    found = LoopSearch.overlaps

    def looked(search: LoopSearch) -> list[Overlap]:
        looks.append(search)
        return found(search)

    def checked(_: ScanCheck, one: FoundOverlap) -> FoundOverlap:
        return replace(one, overlap=replace(one.overlap, objection=one.overlap.objection or objection))

    monkeypatch.setattr(LoopSearch, "overlaps", looked)
    monkeypatch.setattr(ScanCheck, "checked", checked)
    merged = merge_maps([map_of(RING)])
    assert any(decision.joined for decision in merged.decisions) == (not objection)
    assert [one.copies.any() for one in looks] == [False, True][:count]


def test_a_path_shorter_than_a_loop_is_not_searched() -> None:
    assert merge_maps([map_of(((0, 0), (9, 0)))]).decisions == ()


def test_a_person_refuses_a_loop_and_adds_one() -> None:
    (decision,) = [one for one in merge_maps([map_of(EIGHT)]).decisions if one.joined]
    no = replace(decision, joined=False, why="no")
    assert not len(merge_maps([map_of(EIGHT)], wishes=[no]).map.paths[0].loops)
    yes = Decision("drive", "drive", (0, 4), (60, 64), (0.0, 0.0), True, "yes")
    pairs = merge_maps([map_of(EIGHT)], wishes=[no, yes]).map.paths[0].loops
    assert pairs.tolist() == [[0, 60], [1, 61], [2, 62], [3, 63], [4, 64]]


@pytest.mark.slow
def test_loops_stay_when_maps_are_merged_in_any_order_and_later() -> None:
    other = map_of(((30, 16), (40, 16), (40, 0), (20, 0), (20, 16), (10, 16)), 5, "other")
    one, two = (merge_maps(maps).map for maps in ([map_of(EIGHT), other], [other, map_of(EIGHT)]))
    later = merge_maps([one, map_of(STRAIGHT, 6, "third")]).map
    for map_ in (one, two, later):
        (path,) = [path for path in map_.paths if path.name == "drive"]
        np.testing.assert_array_equal(path.loops, eight().paths[0].loops)
        assert len(path.poses) == len(path)
        assert len(map_.loops)


@given(st.lists(st.floats(0.0, 1.0), min_size=2, max_size=8), st.integers(0, 255), st.booleans())
def test_a_view_is_elsewhere_as_likely_as_before_by_ratio(weights: list[float], bits: int, ratios: bool) -> None:
    K = len(weights)
    near = np.array([bool(bits >> k & 1) for k in range(K)])
    likelihood = (np.array(weights) + 1e-3) / sum(w + 1e-3 for w in weights)
    measured = Measurement(likelihood, 1.0, Timings(), np.log(likelihood) if ratios else None)
    found = elsewhere(measured, near)
    assert (found.likelihood[near] == 0).all()
    if not near.all():
        assert found.likelihood.sum() == pytest.approx(1.0)
        np.testing.assert_allclose(found.likelihood[~near], likelihood[~near] / likelihood[~near].sum())
    if ratios:
        assert found.log_ratio is not None
        np.testing.assert_array_equal(found.log_ratio[near], np.full(near.sum(), NEVER))
        np.testing.assert_array_equal(found.log_ratio[~near], np.log(likelihood)[~near])


def test_a_place_is_not_looked_for_nearer_along_its_path_than_a_loop_is_long() -> None:
    sequence = bits_sequence(driven(STRAIGHT, 1), BEST)
    own = translated(sequence, sequence)
    copies = np.arange(len(sequence)) > 50
    found = list(OwnTranslation(own.columns, own.distances, own.to, 10.0, copies).measurements())
    never = np.array([one.log_ratio for one in found]) == NEVER
    np.testing.assert_array_equal(never, copies | (np.abs(np.subtract.outer(sequence.along, sequence.along)) < 10.0))


def test_a_route_leaves_the_round_out() -> None:
    """Up the middle of the eight and on to its end: the way round, 72 m long, is left out by the loop."""
    map_ = eight()
    start, goal = place_of(map_, "drive:10"), place_of(map_, f"drive:{len(map_) - 2}")
    found, whole = shortest_route(map_, start, goal), shortest_route(map_of(EIGHT), start, goal)
    assert [leg.path for leg in found.legs] == ["drive", "drive"]
    assert whole.length - found.length == pytest.approx(72, abs=2)
    (before, after) = found.legs
    assert [before.last, after.first] in map_.paths[0].loops.tolist()
    # And back again: the earlier pass is reached from the later one.
    assert shortest_route(map_, place_of(map_, "drive:95"), place_of(map_, "drive:40")).length < 20


WALK = map_of(((0, 0), (12, 0))).sequence


@st.composite
def looped_maps(draw: st.DrawFn) -> Map:
    """A path of up to eight places that comes back to itself up to three times."""
    K = draw(st.integers(3, 8))
    steps = draw(st.lists(st.floats(0.1, 9), min_size=K - 1, max_size=K - 1))
    pair = st.integers(0, K - 2).flatmap(lambda one: st.tuples(st.just(one), st.integers(one + 1, K - 1)))
    loops = np.array(draw(st.lists(pair, max_size=3)), np.intp).reshape(-1, 2)
    along = np.cumsum([0.0, *steps])
    path = MapPath("drive", along, np.zeros(K, np.intp), np.arange(K), loops=loops)
    return Map(("drive",), (reduced(WALK, np.arange(K)),), (path,))


@settings(deadline=None)
@given(looped_maps(), st.data())
def test_routes_cost_what_trying_all_rides_and_loops_costs(map_: Map, data: st.DataObject) -> None:
    K, (path,) = len(map_), map_.paths
    start, goal = data.draw(st.integers(0, K - 1)), data.draw(st.integers(0, K - 1))
    cost = np.full(K, math.inf)
    cost[start] = 0.0
    for _ in range(3 * K):
        for one, other in path.loops.tolist():
            cost[one] = cost[other] = min(cost[one], cost[other])
        for here in range(K):
            for there in range(here + 1, K):
                cost[there] = min(cost[there], cost[here] + path.along[there] - path.along[here] + CHANGE)
    if math.isinf(cost[goal]):
        with pytest.raises(Exception, match="no path leads"):
            shortest_route(map_, start, goal)
        return
    found = shortest_route(map_, start, goal)
    assert found.length + CHANGE * len(found.legs) == pytest.approx(cost[goal])
    assert found.places[[0, -1]].tolist() == [start, goal], "also where the last step is over a loop"


def test_beliefs_go_over_where_the_path_came_back() -> None:
    """A later drive comes up the middle the first time and leaves it as the path did the second time."""
    later = driven(((0, 0), (20, 0), (20, 16), (0, 16), (0, 8)), 9, missed=0.5)
    right = {}
    for name, map_ in (("with", eight()), ("without", map_of(EIGHT))):
        beliefs = localise(map_, later, stages=[Stage.CHAIN])[Stage.CHAIN]
        poses = true_poses(map_)
        shares = [
            float(belief.places[np.hypot(poses[:, 0] - v.truth.x, poses[:, 1] - v.truth.y) <= 1.5].sum())
            * (1 - belief.lost)
            for belief, v in zip(beliefs, later, strict=True)
            if v.truth
        ]
        # The first views behind the fork, at (20, 16).
        right[name] = float(np.mean(shares[37:43]))
    assert right["with"] > 0.9
    assert right["with"] >= right["without"]


def test_a_map_of_one_path_with_loops_answers_at_every_stage() -> None:
    later = driven(RING, 8)[:20]
    for stage, beliefs in localise(eight(), later, stages=list(Stage)).items():
        assert all(belief.places.sum() == pytest.approx(1.0) for belief in beliefs), stage


@pytest.mark.parametrize("looped", [True, False])
def test_hindsight_knows_no_more_than_the_way_at_its_last_view(looped: bool) -> None:
    """Both go over the loops, if there are any: their last answers are one."""
    map_, later = eight() if looped else map_of(EIGHT), driven(RING, 8)[:20]
    online, hindsight = localise(map_, later, stages=[Stage.CHAIN])[Stage.CHAIN], smoothed(map_, later)
    np.testing.assert_allclose(hindsight[-1].places, online[-1].places, atol=1e-12)
    assert hindsight[-1].lost == pytest.approx(online[-1].lost, abs=1e-12)
    assert len(map_.loops) > 0 if looped else len(map_.loops) == 0
