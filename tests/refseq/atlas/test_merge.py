"""Similarity, overlaps and merging on walks whose truth is known."""

import weakref
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations, permutations
from types import MappingProxyType

import numpy as np
import pytest

from refseq.atlas.decision import Decision
from refseq.atlas.merge import merge_maps
from refseq.atlas.overlap import SHORT_JOINS, Overlap, OverlapSettings, PairSearch, overlaps
from refseq.atlas.similarity import view_similarity
from refseq.errors import MapError
from refseq.map.learning import learn
from refseq.map.map import Map, beside
from refseq.map.profile import BEST, THESIS, Profile
from refseq.map.sequence import ReferenceSequence
from refseq.view import Scan, View
from tests.refseq.rooms import bits_drive, bits_sequence, named_maps
from tests.refseq.walks import Leg, Town, apart

TOWN = Town()
A, B = [("A", 0, 30), ("B", 0, 30)], [("C", 0, 25), ("B", 0, 30), ("D", 0, 20)]
PROFILES = [pytest.param(BEST, id="best"), pytest.param(THESIS, id="thesis")]


def assert_true(atlas: Map, walks: dict[str, ReferenceSequence], within: float = 1.5) -> None:
    """Every view of every path lies where it was made, and no place is held twice.

    Views next to a corner, which see what lies around it too, may be a place off: in this town, anywhere.
    """
    poses = atlas.poses
    for path in atlas.paths:
        true = walks[path.name].poses
        for view, number in enumerate(atlas.numbered(path)):
            before, after = true[max(view - 2, 0)], true[min(view + 2, len(true) - 1)]
            if apart(before, after) <= 4:
                assert apart(true[view], poses[number]) <= within
    for one, other in combinations(range(len(atlas.sequences)), 2):
        pairs = [(p, q) for p in atlas.sequences[one].poses for q in atlas.sequences[other].poses if p and q]
        duplicates = sum(apart(p, q) < 0.5 and abs(p.heading - q.heading) < 0.1 for p, q in pairs)
        assert duplicates <= 3  # at the ends of stretches


def assert_same(one: Map, other: Map) -> None:
    assert one.names == other.names
    for mine, its in zip(one.sequences, other.sequences, strict=True):
        assert mine.matrix.places.tobytes() == its.matrix.places.tobytes()
        assert mine.matrix.pointers.tobytes() == its.matrix.pointers.tobytes()
        assert mine.along.tobytes() == its.along.tobytes()
    for path, its_path in zip(one.paths, other.paths, strict=True):
        assert path.name == its_path.name
        assert path.sequences.tolist() == its_path.sequences.tolist()
        assert path.places.tolist() == its_path.places.tolist()


@pytest.mark.parametrize("profile", PROFILES)
def test_a_sequence_is_like_itself_place_by_place(profile: Profile) -> None:
    one = TOWN.learnt(A, profile=profile)
    similarity = view_similarity(one, one)
    assert similarity.shape == (60, 60)
    assert similarity.sum(axis=1) == pytest.approx(np.ones(60))
    # Calibrated evidence cannot tell places apart that are both better than all elsewhere.
    assert np.diag(similarity) == pytest.approx(similarity.max(axis=1))


def test_similarity_is_not_symmetric_and_has_a_row_a_view() -> None:
    one, other = TOWN.learnt(A, profile=BEST), TOWN.learnt(B, 1, BEST)
    there, back = view_similarity(one, other), view_similarity(other, one)
    assert (there.shape, back.shape) == ((60, 75), (75, 60))
    assert not np.allclose(there, back.T)


@pytest.mark.quick_cases("best")
@pytest.mark.parametrize("profile", PROFILES)
def test_a_shared_stretch_is_taken_out_of_the_longer_sequence(profile: Profile) -> None:
    walks = {"one": TOWN.learnt(A, 1, profile), "other": TOWN.learnt(B, 2, profile)}
    merged = merge_maps(named_maps(list(walks), list(walks.values())))
    (decision,) = [decision for decision in merged.decisions if decision.joined]
    # Views 30 to 59 of the one and 25 to 54 of the other are both corridor B.
    assert np.abs(np.subtract(decision.first, (30, 59))).max() <= 3
    assert np.abs(np.subtract(decision.second, (25, 54))).max() <= 3
    assert [len(sequence) for sequence in merged.map.sequences] == [60, 75 - 1 - np.ptp(decision.second)]
    assert_true(merged.map, walks)
    into, out_of = merged.map.links
    assert (into.path, into.start[0], into.end[0]) == (1, 1, 0)
    assert (out_of.path, out_of.start[0], out_of.end[0]) == (1, 0, 1)


@pytest.mark.parametrize("profile", PROFILES)
def test_the_way_back_is_another_path(profile: Profile) -> None:
    merged = merge_maps(
        named_maps(
            ["there", "back"], [TOWN.learnt([("A", 0, 40)], 1, profile), TOWN.learnt([("A", 40, 0)], 2, profile)]
        )
    )
    assert not any(decision.joined for decision in merged.decisions)
    assert merged.map.links == ()


def test_what_the_laser_alone_says_is_refused() -> None:
    """A laser that sees the same both ways, on two walks one of which looks away: all but the camera agree."""
    seen, blind = TOWN.views([("A", 0, 40)], 1), TOWN.views([("A", 0, 40)], 2)
    elsewhere = TOWN.views([("E", 0, 40)], 3)
    turned = [
        replace(v, images={"camera": o.images["camera"], "scanner": v.images["scanner"]})
        for v, o in zip(blind, elsewhere, strict=True)
    ]
    (found,) = overlaps(bits_sequence(seen, BEST), bits_sequence(turned, BEST))
    assert found.objection.endswith("nats a view")
    assert found.told["scanner"] > 0.5 > found.told["camera"]


def test_a_name_that_is_in_the_atlas_already_is_told() -> None:
    atlas = beside(named_maps(["there"], [TOWN.learnt([("A", 0, 20)], 1, BEST)]))
    with pytest.raises(MapError, match="path 'there' is there twice; valid"):
        merge_maps([atlas, *named_maps(["there"], [TOWN.learnt([("C", 0, 20)], 2, BEST)])])


@pytest.mark.quick_cases("best")
@pytest.mark.parametrize("profile", PROFILES)
def test_paths_that_do_not_meet_stay_as_they_are(profile: Profile) -> None:
    walks = [TOWN.learnt([(name, 0, 30)], n, profile) for n, name in enumerate("ACE")]
    merged = merge_maps(named_maps(["a", "c", "e"], walks))
    assert not any(decision.joined for decision in merged.decisions)
    assert_same(merged.map, beside(named_maps(["a", "c", "e"], walks)))


@pytest.mark.quick_cases("best")
@pytest.mark.parametrize("profile", PROFILES)
def test_a_sequence_within_another_takes_the_middle_out_of_it(profile: Profile) -> None:
    walks = {"long": TOWN.learnt(B, 1, profile), "short": TOWN.learnt([("B", 5, 25)], 2, profile)}
    atlas = merge_maps(named_maps(list(walks), list(walks.values()))).map
    assert len(atlas.sequences[1]) == 20
    assert len(atlas.sequences[0]) == pytest.approx(55, abs=4)
    assert_true(atlas, walks)


def test_a_sequence_merged_with_itself_holds_nothing_twice() -> None:
    one = TOWN.learnt(A, profile=BEST)
    atlas = merge_maps(named_maps(["one", "two"], [one, one])).map
    assert atlas.names == ("one",)  # of equals the first by name keeps the places
    assert [path.name for path in atlas.paths] == ["one", "two"]
    assert np.abs(atlas.paths[1].places - np.arange(60)).max() <= 1


def test_one_sequence_is_an_atlas_and_none_is_not() -> None:
    one = TOWN.learnt(A, profile=BEST)
    merged = merge_maps(named_maps(["one"], [one]))
    assert merged.decisions == ()
    assert_same(merged.map, beside(named_maps(["one"], [one])))
    with pytest.raises(MapError, match="a map holds no path; valid is at least one"):
        merge_maps(named_maps([], []))


@pytest.mark.slow
def test_three_in_a_ring_are_joined_two_by_two() -> None:
    legs: dict[str, list[Leg]] = {
        "x": [("A", 0, 25), ("B", 0, 25)],
        "y": [("B", 0, 25), ("C", 0, 25)],
        "z": [("C", 0, 25), ("A", 0, 25)],
    }
    walks = {name: TOWN.learnt(way, n, BEST) for n, (name, way) in enumerate(legs.items())}
    merged = merge_maps(named_maps(list(walks), list(walks.values())))
    joined = {(decision.one, decision.other) for decision in merged.decisions if decision.joined}
    assert joined == {("x", "y"), ("x", "z"), ("y", "z")}
    assert len(merged.map) == pytest.approx(75, abs=6)
    assert_true(merged.map, walks)


def test_joined_paths_have_one_frame_however_long_a_path_is_that_shares_nothing() -> None:
    legs: dict[str, list[Leg]] = {
        "a": [("A", 0, 10), ("B", 0, 20)],
        "b": [("B", 0, 20), ("D", 0, 10)],
        "far": [("E", 0, 40), ("F", 0, 40)],
    }
    maps = []
    for number, (name, way) in enumerate(legs.items()):
        learnt = TOWN.learnt(way, number, BEST)
        straight = np.pad(np.arange(len(learnt), dtype=float)[:, None], ((0, 0), (0, 2)))
        maps.append(Map.of(replace(learnt, odometry=straight), name))
    assert len(maps[2]) > len(maps[0]) + len(maps[1])
    merged = merge_maps(maps)
    assert {(one.one, one.other) for one in merged.decisions if one.joined} == {("a", "b")}
    assert [len(path.poses) for path in merged.map.paths] == [30, 30, 0]


def test_adding_one_later_joins_what_merging_all_at_once_joins() -> None:
    walks = {
        "a": TOWN.learnt(A, 1, BEST),
        "b": TOWN.learnt(B, 2, BEST),
        "c": TOWN.learnt([("D", 0, 20), ("A", 5, 30)], 3, BEST),
    }
    at_once = merge_maps(named_maps(list(walks), list(walks.values())))
    first = merge_maps(named_maps(["a", "b"], [walks["a"], walks["b"]]))
    later = merge_maps([first.map, *named_maps(["c"], [walks["c"]])])
    assert len(later.map) == pytest.approx(len(at_once.map), abs=3)
    assert_true(later.map, walks)


@pytest.mark.quick_cases("long keeper")
@pytest.mark.parametrize("names", [("x", "y"), ("y", "x")], ids=["short keeper", "long keeper"])
def test_what_two_paths_share_by_a_third_is_kept_once(names: tuple[str, str]) -> None:
    """Corridor A is on three paths, and the join of two of them is left out: both are joined to the third there."""
    legs: dict[str, list[Leg]] = {names[0]: [("A", 0, 25)], names[1]: [("A", 0, 25), ("B", 0, 10)]}
    legs["z"] = [("A", 0, 25), ("B", 0, 20)]
    walks = {name: TOWN.learnt(way, n, BEST) for n, (name, way) in enumerate(legs.items(), start=1)}

    def refuse(decision: Decision) -> Decision:
        return replace(decision, joined=decision.joined and "z" in (decision.one, decision.other))

    merged = merge_maps(named_maps(list(walks), list(walks.values())), confirm=refuse)
    assert sum(decision.joined for decision in merged.decisions) == 2
    assert len(merged.map) == pytest.approx(45, abs=4)
    assert_true(merged.map, walks)


@pytest.mark.slow
def test_the_order_of_maps_does_not_matter() -> None:
    """All orders of three maps, of which two are equally long."""
    ways: dict[str, list[Leg]] = {
        "x": [("A", 0, 18), ("B", 0, 15)],
        "y": [("B", 0, 18), ("C", 0, 15)],
        "z": [("C", 0, 15), ("A", 0, 15)],
    }
    maps = named_maps(list(ways), [TOWN.learnt(way, n, BEST) for n, way in enumerate(ways.values())])
    first = merge_maps(maps)
    assert sum(decision.joined for decision in first.decisions) >= 2
    for order in permutations(maps):
        merged = merge_maps(order)
        assert contents(merged.map) == contents(first.map)
        assert {normal(one) for one in merged.decisions} == {normal(one) for one in first.decisions}


def contents(map_: Map) -> dict[str, object]:
    """All that a map says, by names instead of numbers."""
    held = {
        name: (one.matrix.places.tobytes(), one.along.tobytes())
        for name, one in zip(map_.names, map_.sequences, strict=True)
    }
    runs = {
        path.name: [(map_.names[s], int(p)) for s, p in zip(path.sequences, path.places, strict=True)]
        for path in map_.paths
    }
    return {"held": held, "runs": runs}


def normal(decision: Decision) -> tuple[object, ...]:
    """A decision, whichever path is named first."""
    sides = (decision.one, decision.first), (decision.other, decision.second)
    return (*sorted(sides), decision.joined, decision.why)


@pytest.mark.parametrize("keeps", [False, True], ids=["gives way", "insists"])
def test_an_answer_holds_as_a_wish_does_and_what_it_turns_is_asked_again(keeps: bool) -> None:
    """The short stretch of B stands by the long one of A alone."""
    legs: dict[str, list[Leg]] = {
        "p": [("A", 0, 22), ("C", 0, 18), ("B", 0, 6), ("E", 0, 6)],
        "q": [("A", 0, 22), ("D", 0, 18), ("B", 0, 6), ("F", 0, 6)],
    }
    learnt = [TOWN.learnt(way, number, BEST) for number, way in enumerate(legs.values(), 1)]
    straight = [np.column_stack([one.along, np.zeros((len(one), 2))]) for one in learnt]
    walks = [replace(one, odometry=track) for one, track in zip(learnt, straight, strict=True)]
    maps = named_maps(list(legs), walks)
    long, short = merge_maps(maps).decisions
    assert (long.joined, short.joined) == (True, True)
    asked: list[tuple[int, bool]] = []

    def answer(decision: Decision) -> Decision:
        asked.append((decision.first[0], decision.joined))
        if decision.about(long):
            return replace(decision, joined=False, why="a person says no")
        return replace(decision, joined=True) if keeps else decision

    merged = merge_maps(maps, confirm=answer)
    assert asked == [(0, True), (40, True), (40, False)], "each once, and the short one again as nothing supports it"
    assert [one.joined for one in merged.decisions] == [False, keeps]
    if not keeps:
        wish = replace(long, joined=False, why="a person says no")
        assert merged.decisions == merge_maps(maps, wishes=[wish]).decisions


def test_a_person_has_the_last_word() -> None:
    def refuse(decision: Decision) -> Decision:
        return replace(decision, joined=False, why="a person says no")

    walks = [TOWN.learnt(A, 1, BEST), TOWN.learnt(B, 2, BEST)]
    merged = merge_maps(named_maps(["a", "b"], walks), confirm=refuse)
    assert [decision.why for decision in merged.decisions] == ["a person says no"]
    assert_same(merged.map, beside(named_maps(["a", "b"], walks)))


@pytest.mark.parametrize("even", ["a", "z"])
def test_a_wish_lays_its_stretches_beside_each_other_by_their_lengths(even: str) -> None:
    """Views a metre apart, and as many that crowd at the beginning of as long a way: each goes to the nearest one."""
    ways = {even: np.arange(11.0), "m": np.array([0, 0.2, 0.4, 0.6, 0.8, 1, 1.2, 1.4, 2, 6.2, 10])}
    seen = iter(np.eye(22, dtype=bool).reshape(2, 11, 22))  # nothing twice
    walks = [
        bits_sequence(bits_drive({"camera": next(seen)}, np.diff(way, prepend=0.0).tolist()), BEST)
        for way in ways.values()
    ]
    wish = Decision(even, "m", (0, 10), (0, 10), (10.0, 10.0), joined=True, why="told")
    merged = merge_maps(named_maps(list(ways), walks), wishes=[wish])
    (found,) = merged.found
    # Of paths of equally many places the first by name keeps its own.
    keeps, gives = (ways[name] for name in sorted(ways))
    assert found.views.tolist() == [[n, int(np.argmin(np.abs(gives - at)))] for n, at in enumerate(keeps)]


def beside_walls(seed: int, spots: Sequence[int], turns: Mapping[int, float] = MappingProxyType({})) -> list[View]:
    """A drive past walls that look otherwise at each spot, by a laser: a wide bend, but for some views' ``turns``."""
    rng, bearings = np.random.default_rng(seed), np.linspace(-np.pi / 2, np.pi / 2, 361)
    aside, views = np.maximum(np.abs(np.sin(bearings)), 1e-3), []
    for number, spot in enumerate(spots):
        ranges = np.minimum((1 + 0.6 * np.sin(spot**2 / 7)) / aside, 12 - 0.3 * (spot % 25)) + rng.normal(0, 0.01, 361)
        scan = Scan(ranges.clip(0.2, 30).astype(np.float32))
        turn = turns.get(number, 0.02 * (number > 0))
        views.append(View(float(number), {}, scan, distance=0.8 * (number > 0), turn=turn))
    return views


def test_joins_of_a_person_lay_paths_beside_each_other(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where nothing is found by itself: what lies beside a wish is, but not the wish again, nor what is refused.

    Between its 14th and its 22nd spot the one path goes straight on; the other goes round by the side of it.
    """
    monkeypatch.setattr(PairSearch, "overlaps", lambda self: [])
    straight, left = dict.fromkeys(range(14, 30), 0.0), np.pi / 2
    round_by = {**straight, 14: left, 18: -left, 25: -left, 29: left + 0.18}
    drives = beside_walls(0, range(36)), beside_walls(1, [*range(14), *range(100, 115), *range(22, 36)], round_by)
    maps = [learn(views, profile=BEST, name=name) for name, views in zip("ab", drives, strict=True)]
    one, other = (
        Decision("a", "b", first, second, (10.4, 10.4), joined=True, why="told")
        for first, second in (((0, 13), (0, 13)), ((22, 35), (29, 42)))
    )
    assert merge_maps(maps, SHORT_JOINS).decisions == ()
    more = merge_maps(maps, SHORT_JOINS, wishes=[one]).decisions
    assert one in more
    assert any(each.joined for each in more if each.why != "told")
    assert all(each.first[0] > 13 for each in more if each.why != "told")
    both = merge_maps(maps, SHORT_JOINS, wishes=[one, other]).decisions
    assert [(each.first, each.joined) for each in both] == [((0, 13), True), ((22, 35), True)]
    refused = merge_maps(maps, SHORT_JOINS, wishes=[one, replace(other, first=(14, 35), second=(14, 42), joined=False)])
    assert [(each.joined, each.why) for each in refused.decisions] == [(False, "told"), (True, "told")]
    assert refused.found[0].views[0].min() > 13


def test_searches_are_let_go_of_one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each holds tables of all pairs of places; with rounds they are asked again, and stay."""
    searches: list[weakref.ref[PairSearch]] = []
    held, found = [], PairSearch.overlaps

    def overlaps_of(search: PairSearch) -> list[Overlap]:
        searches.append(weakref.ref(search))
        held.append(sum(one() is not None for one in searches))
        return found(search)

    monkeypatch.setattr(PairSearch, "overlaps", overlaps_of)
    maps = named_maps(["a", "c", "e"], [TOWN.learnt([(name, 0, 12)], n, BEST) for n, name in enumerate("ACE")])
    merge_maps(maps)
    assert len(held) == 6
    assert max(held) <= 2
    held.clear()
    searches.clear()
    merge_maps(maps, OverlapSettings(rounds=1))
    assert max(held) == 6


def test_what_is_refused_for_want_of_evidence_alone_is_told_apart() -> None:
    walks = named_maps(["a", "b"], [TOWN.learnt(A, 1, BEST), TOWN.learnt(B, 2, BEST)])
    assert merge_maps(walks).unsupported == ()
    demanding = OverlapSettings(alone=1e6)
    merged = merge_maps(walks, demanding)
    (refused,) = merged.decisions
    assert not refused.joined
    assert merged.unsupported == (refused,)
    no = replace(refused, why="a person says so")
    assert merge_maps(walks, demanding, wishes=[no]).unsupported == (), "a person decided"
    assert merge_maps(walks, demanding, wishes=[replace(no, joined=True)]).unsupported == ()


def test_of_two_joins_that_contradict_each_other_with_like_evidence_neither_is_made() -> None:
    """Both paths go through A and through B, which one odometer takes for 40 m farther apart; a person may decide."""
    legs: list[list[Leg]] = [[("A", 0, 22), way, ("B", 0, 22)] for way in (("C", 0, 18), ("D", 0, 30))]
    learnt = [TOWN.learnt(way, number, BEST) for number, way in enumerate(legs, 1)]
    farther = [np.zeros(len(learnt[0])), np.where(np.arange(len(learnt[1])) > 30, 40.0, 0.0)]
    tracks = [
        np.column_stack([one.along + more, np.zeros((len(one), 2))]) for one, more in zip(learnt, farther, strict=True)
    ]
    maps = named_maps(["p", "q"], [replace(one, odometry=track) for one, track in zip(learnt, tracks, strict=True)])
    merged = merge_maps(maps)
    assert [one.joined for one in merged.decisions] == [False, False]
    contested, contradicted = sorted((one.why for one in merged.decisions), key=lambda why: "nearly as well" not in why)
    assert contested.startswith("others that contradict it would agree nearly as well; ")
    assert contradicted.startswith("other joins and the odometry contradict it; ")
    assert merged.unsupported == ()
    assert [one.why for one in merged.contested] == [contested]
    for one in merged.decisions:
        decided = merge_maps(maps, wishes=[replace(one, joined=True, why="a person knows")])
        assert [its.joined for its in decided.decisions if its.about(one)] == [True]
        assert decided.contested == ()


def test_short_stretches_are_objected_to() -> None:
    one, other = TOWN.learnt([("A", 0, 30), ("B", 0, 6)], 1, BEST), TOWN.learnt([("B", 0, 30)], 2, BEST)
    (found,) = overlaps(one, other, OverlapSettings(least=8))
    assert found.doubt.startswith("only ")
    assert found.doubt.endswith("valid is 8 m")


def test_maps_that_cannot_be_compared_are_refused() -> None:
    one = TOWN.learnt(A, profile=BEST)
    with pytest.raises(MapError, match="features are bits/camera; valid are those of the first map, bits/camera, bits"):
        merge_maps(named_maps(["a", "b"], [one, TOWN.learnt(A, profile=BEST, sensors=["camera"])]))
    with pytest.raises(MapError, match=r"profile\.features is .* valid is that of the first map"):
        merge_maps(named_maps(["a", "b"], [one, TOWN.learnt(A, profile=THESIS)]))
    with pytest.raises(MapError, match="path 'a' is there twice; valid are names of their own"):
        merge_maps(named_maps(["a", "a"], [one, one]))
