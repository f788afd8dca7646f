"""What scorers are told of a merged atlas: whose place each learnt view is at, and answers by learnt views."""

import json
from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq.belief import LOST, belief_from
from refseq.map.map import Map
from refseq.map.profile import BEST
from refseq_bench.scenarios.scoring.merging import Merging, by_views, merged_drives
from tests.refseq.walks import Leg, Town, apart

TOWN = Town()
# The second shares corridor B with the first, and gives C to the third, which then gives most of it to the fourth.
LEGS: Mapping[str, list[Leg]] = {
    "one": [("A", 0, 20), ("B", 0, 25)],
    "two": [("B", 0, 30), ("C", 0, 30)],
    "three": [("C", 0, 30), ("D", 0, 20)],
    "four": [("C", 4, 28)],
}


@pytest.fixture(scope="module")
def maps() -> dict[str, Map]:
    return {name: Map.of(TOWN.learnt(legs, seed, BEST), name) for seed, (name, legs) in enumerate(LEGS.items())}


Found = tuple[Map, Merging]


@pytest.fixture(scope="module")
def found(maps: dict[str, Map]) -> Found:
    return merged_drives(list(maps.values()), merging=True)


def poses(maps: Mapping[str, Map]) -> list:  # type: ignore[type-arg]
    return [pose for one in maps.values() for pose in one.poses]


def test_each_view_is_held_by_one_that_holds_itself(found: Found, maps: dict[str, Map]) -> None:
    atlas, merging = found
    assert merging.names == tuple(maps)
    assert merging.lengths == tuple(map(len, maps.values()))
    held = merging.held_by
    assert len(held) == sum(merging.lengths)
    assert held[held].tolist() == held.tolist()
    assert len(set(held.tolist())) == len(atlas) < len(held) - 60
    true = poses(maps)
    off = [apart(true[view], true[holder]) for view, holder in enumerate(held.tolist())]
    assert np.mean([one <= 1.5 for one in off]) > 0.95
    second, third, fourth = slice(45, 105), slice(105, 155), slice(155, 179)
    assert not (held[second] == np.arange(105)[second]).all()
    assert set(range(*fourth.indices(179))) & set(held[second].tolist()), "what was handed on twice"
    assert not set(held[third].tolist()) & set(range(105))


def test_the_atlas_lies_where_its_views_were_made(found: Found, maps: dict[str, Map]) -> None:
    """By the poses, which nothing that merges has looked at, a place is the view that it is said to be."""
    atlas, merging = found
    true = poses(maps)
    assert [true[view] for view in atlas.learnt] == list(atlas.poses)
    where = [atlas.poses[place] for path in atlas.paths for place in atlas.numbered(path)]
    assert [true[view] for view in merging.held_by] == where


def test_views_that_hold_themselves_are_what_was_decided(found: Found) -> None:
    """Each view taken out lies in a stretch that was joined, of the longer drive or of equals the later by name."""
    _, merging = found
    starts = dict(zip(merging.names, np.cumsum([0, *merging.lengths[:-1]]).tolist(), strict=True))
    lengths = dict(zip(merging.names, merging.lengths, strict=True))
    gone = set[int]()
    for one in merging.decisions:
        sides = (one.one, one.first), (one.other, one.second)
        name, span = max(sides, key=lambda side: (lengths[side[0]], side[0]))
        gone |= set(range(starts[name] + span[0], starts[name] + span[1] + 1)) if one.joined else set()
    assert set(np.flatnonzero(merging.held_by != np.arange(len(merging.held_by))).tolist()) == gone
    joined = [(one.one, one.other) for one in merging.decisions if one.joined]
    assert joined == [("one", "two"), ("two", "three"), ("two", "four"), ("three", "four")]


def test_sizes_are_those_of_the_files(
    found: Found, maps: dict[str, Map], tmp_path_factory: pytest.TempPathFactory
) -> None:
    atlas, merging = found
    folder = tmp_path_factory.mktemp("maps")

    def size(files: Mapping[str, Map]) -> int:
        for name, one in files.items():
            one.save(folder / f"{name}.refseq")
        return sum((folder / f"{name}.refseq").stat().st_size for name in files)

    assert merging.size == (size(maps), size({"merged": atlas}))
    assert merging.size[1] < merging.size[0]
    assert merging.seconds > 0


def test_unmerged_each_keeps_its_own(maps: dict[str, Map]) -> None:
    atlas, merging = merged_drives(list(maps.values()), merging=False)
    assert merging.decisions == ()
    assert merging.held_by.tolist() == list(range(sum(map(len, maps.values()))))
    assert merging.size == (sum(len(one.to_bytes()) for one in maps.values()), len(atlas.to_bytes()))
    assert atlas.sequences == tuple(one.sequence for one in maps.values())


# --- beliefs by views ---


def test_every_place_is_one_view(found: Found) -> None:
    atlas, merging = found
    for place in range(len(atlas)):
        belief = by_views(atlas, belief_from(np.eye(len(atlas))[place]))
        assert belief.best == np.flatnonzero(belief.places)[0] == atlas.learnt[place]
        assert merging.held_by[belief.best] == belief.best
        assert belief.path == (belief.best,)


@given(st.integers(0, 2**32), st.lists(st.integers(-1, 10**6), max_size=5), st.floats(0, 1))
def test_a_belief_keeps_all_that_it_says(found: Found, seed: int, path: list[int], lost: float) -> None:
    atlas, merging = found
    rng = np.random.default_rng(seed)
    steps = tuple(LOST if step < 0 else step % len(atlas) for step in path)
    given_ = belief_from(rng.random(len(atlas)) ** 8, lost, path=steps)
    belief = by_views(atlas, given_)
    assert len(belief.places) == len(merging.held_by)
    assert sorted(belief.places[belief.places > 0]) == sorted(given_.places[given_.places > 0])
    assert belief.places[belief.best] == given_.places[given_.best]
    assert (belief.lost, belief.entropy) == (given_.lost, given_.entropy)
    shares = rng.random(len(atlas)) * lost / len(atlas)
    after = by_views(atlas, replace(given_, lost_after=shares)).lost_after
    assert after is not None
    assert np.array_equal(after[atlas.learnt], shares)
    assert after.sum() == pytest.approx(shares.sum())
    true = atlas.poses
    ahead = dict(zip(atlas.learnt.tolist(), true, strict=True))
    assert [None if step == LOST else ahead[step] for step in belief.path] == [
        None if step == LOST else true[step] for step in steps
    ]


def test_the_places_of_a_drive_keep_their_order(found: Found) -> None:
    atlas, _ = found
    weights = np.arange(1.0, len(atlas) + 1)
    for name, first, end in zip(atlas.names, *zip(*pairwise(atlas.first.tolist()), strict=True), strict=True):
        assert (np.diff(atlas.learnt[first:end]) > 0).all(), name
    assert by_views(atlas, belief_from(weights)).best == atlas.learnt[-1]


# --- as text ---


def test_what_is_written_down_is_read_again(found: Found) -> None:
    for merging in (found[1], replace(found[1], decisions=())):
        content = json.loads(json.dumps(merging.to_dict()))
        again = Merging.from_dict(content)
        assert again.to_dict() == merging.to_dict()
        assert again.decisions == merging.decisions
        assert again.names == merging.names
        assert again.held_by.tolist() == merging.held_by.tolist()
        assert again.held_by.dtype == merging.held_by.dtype
        assert (again.lengths, again.size, again.seconds) == (merging.lengths, merging.size, merging.seconds)
    assert found[1].decisions, "there is something to read"
