"""The parts of what makes an overlap, against what can be counted out."""

from collections.abc import Callable, Iterator, Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq.atlas.overlap import SHORT_JOINS, LaidViews, OverlapSettings, PairSearch, most_beyond, told_by
from refseq.atlas.similarity import Translation, translated, view_similarity
from refseq.belief import Timings
from refseq.errors import MapError
from refseq.map.matcher import Measurement
from refseq.map.profile import BEST
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
    one, other = (TOWN.learnt([("A", 0, 20)], seed, BEST, sensors=["camera"]) for seed in (1, 2))
    told = told_by(translated(one, other), translated(other, one))
    there, back = (np.log(view_similarity(*maps) * 20) for maps in ((one, other), (other, one)))
    pairs = np.array([[3, 3], [4, 9], [19, 0]])
    expected = [(there[i, j] + back[j, i]) / 2 for i, j in pairs]
    assert told("camera", pairs) == pytest.approx(expected)
    assert expected[0] > 0.5 > 0 > expected[1]


class _Likelihoods(Translation):
    """Views whose likelihoods of places are given, (K, L), as a mixture tells them."""

    def __init__(self, likelihoods: np.ndarray) -> None:
        object.__setattr__(self, "likelihoods", likelihoods)

    def measurements(self, *, sensors: Sequence[str] | None = None, seed: int = 0) -> Iterator[Measurement]:
        return (Measurement(one, 0.5, Timings()) for one in self.likelihoods)  # type: ignore[attr-defined]


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
