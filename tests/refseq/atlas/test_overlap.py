"""The parts of what makes an overlap, against what can be counted out."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq.atlas.alignment import Alignment, align
from refseq.atlas.overlap import (
    SHORT_JOINS,
    LaidViews,
    Overlap,
    OverlapSettings,
    PairJudge,
    PairSearch,
    most_beyond,
    stretches,
    told_by,
)
from refseq.atlas.similarity import Translation, translated, view_similarity
from refseq.belief import Timings
from refseq.errors import MapError
from refseq.map.matcher import Measurement
from refseq.map.profile import BEST, profile_named
from tests.refseq.walks import Town

TOWN = Town()
values = st.lists(st.integers(-8, 8).map(lambda n: n / 4), min_size=0, max_size=12).map(np.array)


@given(values, st.sampled_from([-0.25, 0.0, 0.3, 1.0]))
def test_the_part_that_tells_most_is_the_best_of_all_parts(nats: np.ndarray, bar: float) -> None:
    found = most_beyond(nats, bar)
    sums = {(i, j): np.sum(nats[i:j] - bar) for i in range(len(nats) + 1) for j in range(i, len(nats) + 1)}
    assert sums[found.start, found.stop] == pytest.approx(max(sums.values()))


def test_nothing_tells_where_all_is_below_the_bar() -> None:
    found = most_beyond(np.array([0.1, 0.2, -3.0]), 0.3)
    assert found.start == found.stop


def test_what_is_told_is_the_mean_of_both_ways() -> None:
    profile = profile_named("best+log_ratio.tail=0")
    one, other = (TOWN.learnt([("A", 0, 20)], seed, profile, sensors=["camera"]) for seed in (1, 2))
    told = told_by(translated(one, other), translated(other, one))
    there, back = (np.log(view_similarity(*maps) * 20) for maps in ((one, other), (other, one)))
    pairs = np.array([[3, 3], [4, 9], [19, 0]])
    expected = [(there[i, j] + back[j, i]) / 2 for i, j in pairs]
    assert told("camera", pairs) == pytest.approx(expected)
    assert expected[0] > 0.5 > 0 > expected[1]


class _Likelihoods(Translation):
    """Views whose likelihoods of places are given, (K, L), as a mixture tells them; ``asked`` are the sensors asked."""

    def __init__(self, likelihoods: np.ndarray) -> None:
        object.__setattr__(self, "likelihoods", likelihoods)
        object.__setattr__(self, "asked", [])

    def measurements(self, *, sensors: Sequence[str] | None = None, seed: int = 0) -> Iterator[Measurement]:
        self.asked.append(sensors)  # type: ignore[attr-defined]
        return (Measurement(one, 0.5, Timings()) for one in self.likelihoods)  # type: ignore[attr-defined]


def test_a_path_beside_itself_is_asked_once() -> None:
    """Both ways are one, and as dear as all else."""
    way, pairs = _Likelihoods(np.full((3, 3), 0.1) + np.eye(3) * 0.7), np.array([[0, 0], [1, 2]])
    assert told_by(way, way)("camera", pairs) == pytest.approx(np.log([0.8 * 3, 0.1 * 3]))
    assert way.asked == [["camera"]]  # type: ignore[attr-defined]


@pytest.mark.parametrize("view", [0, 5, 11])
def test_one_view_that_a_place_takes_wholly_cuts_no_overlap_in_two(view: int) -> None:
    """Its likelihood of all other places may be 0 to the last bit; that is no certainty."""
    likelihoods = np.full((12, 12), 0.02 / 11) + np.eye(12) * 0.9
    certain = likelihoods.copy()
    certain[view] = np.eye(12)[view - 3]
    one, other = _Likelihoods(certain), _Likelihoods(likelihoods)
    pairs = np.column_stack([np.arange(12)] * 2)
    nats = told_by(one, other)("camera", pairs)
    assert np.isfinite(nats).all()
    assert nats[view] < nats[view - 1]
    assert most_beyond(np.delete(nats, view), 0.0) == slice(0, 11)
    assert most_beyond(nats, 0.0) == slice(0, 12)


@pytest.mark.parametrize(
    "settings",
    [
        lambda: OverlapSettings(sure=1.0),
        lambda: OverlapSettings(least=-1.0),
        lambda: OverlapSettings(surely=1.1),
        lambda: OverlapSettings(met=-0.1),
        lambda: OverlapSettings(stretched=0.5),
    ],
)
def test_settings_that_are_none_are_told(settings: Callable[[], OverlapSettings]) -> None:
    with pytest.raises(MapError, match=r"overlap\.\w+ is .*; valid is"):
        settings()


def test_a_frame_shows_what_the_places_hardly_tell() -> None:
    """Where a frame lays a stretch on another and is sure of it, less has to be told; where it does not, nothing is."""
    one, other = (TOWN.learnt([("A", 0, 30)], seed, BEST) for seed in (1, 2))
    search = PairSearch(one, other, SHORT_JOINS)
    laid = LaidViews(np.column_stack([one.along, np.zeros((30, 2))]), np.zeros(30))
    aside = LaidViews(laid.poses + np.array([0.0, 8.0, 0.0]), np.zeros(30))
    (found,) = search.beside(laid, laid)
    assert np.abs(np.diff(found.pairs, axis=1)).max() <= 1
    assert min(found.lengths) > 20
    assert found.doubt
    assert search.beside(laid, aside) == []
    assert search.beside(laid, laid, [found.pairs]) == []


@pytest.mark.parametrize(("striking", "asked"), [(np.inf, False), (4.5, True)])
def test_the_mean_of_both_ways_is_made_where_it_is_asked_for(striking: float, asked: bool) -> None:
    one, other = (TOWN.learnt([("A", 0, 30)], seed, BEST) for seed in (1, 2))
    search = PairSearch(one, other, OverlapSettings(striking=striking))
    assert [found.objection for found in search.overlaps()] == [""]
    assert ("nats" in vars(search._judge)) is asked


def test_a_frame_tells_the_less_the_less_sure_it_is() -> None:
    """At no distance by the logarithm of a variance: of 0.8² m², and with 0.4² m² more on either side."""
    one, other = (TOWN.learnt([("A", 0, 30)], seed, BEST) for seed in (1, 2))
    search = PairSearch(one, other, SHORT_JOINS)
    poses = np.column_stack([one.along, np.zeros((30, 2))])
    (sure,), (vague,) = (
        search.beside(laid, laid) for laid in (LaidViews(poses, np.full(30, sigma)) for sigma in (0.0, 0.4))
    )
    assert np.array_equal(sure.pairs, vague.pairs)
    assert (np.diff(sure.pairs, axis=1) == 0).all()
    lost = (sure.evidence - vague.evidence) / (sum(sure.lengths) / 2)
    assert lost == pytest.approx(np.log((0.8**2 + 2 * 0.4**2) / 0.8**2))


def test_a_stretch_ends_where_a_path_turns_back_or_goes_on_without_pairs() -> None:
    """Metres along either path; 3 m are bridged."""
    metres = np.arange(20.0)
    runs = {
        "goes on": [[(0, 5), (1, 6), (4, 6), (5, 9)]],
        "the other turns back": [[(0, 5), (1, 6)], [(2, 4), (3, 5)]],
        "the one turns back": [[(4, 5), (5, 6)], [(2, 7), (3, 8)]],
        "a gap in the one": [[(0, 5), (1, 6)], [(5, 7)]],
        "a gap in the other": [[(0, 5), (1, 6)], [(2, 10)]],
    }
    for name, expected in runs.items():
        pairs = np.array([pair for run in expected for pair in run])
        found = stretches(pairs, metres, metres, 3.0)
        assert [[tuple(pair) for pair in run.tolist()] for run in found] == expected, name
    assert stretches(np.zeros((0, 2), int), metres, metres, 3.0) == []


def test_views_behind_the_end_of_a_path_are_not_on_it() -> None:
    """Whatever the profile says of ends: the other path goes on for 10 m more, where all places are as likely."""
    path = TOWN.learnt([("A", 0, 20)], 1, replace(BEST, chain=replace(BEST.chain, exit_at_ends=False)))
    likelihoods = np.concatenate([np.full((20, 20), 0.1 / 19) + np.eye(20) * 0.9, np.full((10, 20), 0.05)])
    views = [Measurement(one, 1.0, Timings(), log_ratio=np.log(20 * one)) for one in likelihoods]
    translation: Any = SimpleNamespace(to=path, measurements=lambda: iter(views))
    found = align(translation)
    assert found.places[:20].tolist() == list(range(20))
    assert (found.on[:20] > 0.9).all()
    assert (found.on[23:] < 0.5).all()


def beside(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Pairs of views of one path and of the other, (n, 2)."""
    return np.column_stack([one, other]).round().astype(int)


def judged(
    pairs: np.ndarray, there: float = 1.0, back: float = 1.0, camera: float = 3.0, laser: float = 3.0
) -> Overlap:
    """An overlap of two paths with a view a metre, on each other as probably as ``there`` and ``back`` say.

    ``camera`` and ``laser`` tell so much for each view [nats].
    """
    path: Any = SimpleNamespace(along=np.arange(60.0), sensors={"camera", "laser"})
    ways = [Alignment(np.arange(60), np.full(60, on), np.full((60, 60), camera)) for on in (there, back)]
    told = {"camera": camera, "laser": laser}
    judge = PairJudge(path, path, *ways, lambda sensor, some: np.full(len(some), told[sensor]), OverlapSettings())
    return judge.overlap(pairs)


LONG, MIDDLING, SHORT = (beside(np.arange(n), np.arange(n)) for n in (20, 11, 5))
"""Stretches of 19 m, 10 m and 4 m."""


@pytest.mark.parametrize(
    "judging",
    [
        lambda: judged(LONG),
        lambda: judged(MIDDLING, camera=1.75),
        lambda: judged(LONG, laser=0.0),
        lambda: judged(LONG, there=0.96),
    ],
    ids=["long", "17.5 nats·m", "without the laser", "surely enough"],
)
def test_an_overlap_that_the_witnesses_tell_of_stands_by_itself(judging: Callable[[], Overlap]) -> None:
    found = judging()
    assert (found.objection, found.doubt) == ("", "")


@pytest.mark.parametrize(
    ("judging", "doubt"),
    [
        (lambda: judged(SHORT), "only 4.0 m long; valid is 5 m"),
        (lambda: judged(LONG, back=0.9), "on each other with probability 0.9000 only; valid is 0.95"),
        (lambda: judged(LONG, there=0.9), "on each other with probability 0.9000 only; valid is 0.95"),
        (lambda: judged(MIDDLING, camera=1.3), "told of by 13.0 nats·m only; valid is 17"),
        (lambda: judged(LONG, camera=1.2), "told of by 1.20 nats a view only; valid is 1.25"),
    ],
)
def test_an_overlap_below_a_bar_is_doubtful(judging: Callable[[], Overlap], doubt: str) -> None:
    """The bars of docs/atlas.md, one by one; the laser tells much each time and is no witness beside a camera."""
    found = judging()
    assert (found.objection, found.doubt) == ("", doubt)


@pytest.mark.parametrize(
    ("judging", "objection"),
    [
        (lambda: judged(SHORT[:3]), "only 2.0 m long; valid is 3 m"),
        (lambda: judged(LONG, back=0.7), "on each other with probability 0.7000 only; valid is 0.75"),
        (lambda: judged(LONG, there=0.7), "on each other with probability 0.7000 only; valid is 0.75"),
        (lambda: judged(LONG[::2]), "only 53% of the views lead to each other; valid is 60%"),
        (
            # 11 of 18 views of the one are enough, 11 of 23 of the other are not.
            lambda: judged(beside(np.linspace(0, 17, 11), np.linspace(0, 22, 11))),
            "only 48% of the views lead to each other; valid is 60%",
        ),
        (lambda: judged(beside(np.arange(8), np.arange(8) * 2)), "7.0 m beside 14.0 m: not the same way"),
        (lambda: judged(LONG, camera=0.2), "only 0.0 m of it tell anything: camera 0.20, laser 3.00 nats a view"),
    ],
)
def test_a_stretch_that_is_no_overlap_is_objected_to(judging: Callable[[], Overlap], objection: str) -> None:
    assert judging().objection == objection
