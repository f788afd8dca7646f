from itertools import pairwise, product

import numpy as np
import pytest

from refseq.belief import Stage
from refseq.inference.matching.incidence import IncidenceMatrix
from refseq.inference.matching.place_distance import PlaceDistances
from refseq.map.compact import alike_runs, common_features, compact
from refseq.map.localiser import localise
from refseq.map.profile import BEST, THESIS, Profile
from tests.refseq.rooms import bits_drive, bits_map

RNG = np.random.default_rng(5)
STOPS = np.repeat(RNG.random((12, 40)) < 0.2, 3, axis=0)
"""A robot that a timer triggers: it looks three times at each of twelve places, 10 cm apart."""
STEPS = [0.0, *np.tile([0.1, 0.1, 2.5], 12)[:-1].tolist()]


def fewest_runs(distances: PlaceDistances, along: np.ndarray, alike: float, within: float) -> int:
    """Number of runs of the best of all ways to cut the places into runs."""
    K, best = len(along), len(along)
    for cuts in product((False, True), repeat=K - 1):
        starts = [0, *(k + 1 for k, cut in enumerate(cuts) if cut), K]
        runs = [range(a, b) for a, b in pairwise(starts)]
        if all(
            distances.between(i, j) <= alike and abs(along[i] - along[j]) <= within
            for run in runs
            for i, j in product(run, run)
        ):
            best = min(best, len(runs))
    return best


@pytest.mark.parametrize("seed", range(5))
def test_runs_are_the_fewest_of_all_ways_to_cut(seed: int) -> None:
    rng = np.random.default_rng(seed)
    sequence = bits_map(bits_drive({"a": rng.random((9, 6)) < 0.5}, [0.0, *rng.uniform(0.1, 1, 8)])).sequence
    distances = PlaceDistances(sequence.matrix)
    for alike, within in ((0.4, 9.0), (0.8, 1.5), (1.0, 9.0)):
        runs = alike_runs(distances, sequence.along, alike, within)
        assert [place for run in runs for place in run] == list(range(9))
        assert len(runs) == fewest_runs(distances, sequence.along, alike, within)


@pytest.mark.parametrize("profile", [THESIS, BEST])
def test_places_that_look_the_same_become_one_and_answers_stay(profile: Profile) -> None:
    views = bits_drive({"a": STOPS}, STEPS)
    whole = bits_map(views, profile)
    small = compact(whole, alike=0.0)
    assert [len(run) for run in small.runs[0]] == [3] * 12
    for stage, beliefs in localise(whole, views).items():
        for before, after in zip(beliefs, localise(small.map, views, stages=[stage])[stage], strict=True):
            np.testing.assert_allclose(after.places, before.places, atol=1e-12)


def test_the_odometer_tells_tied_places_apart() -> None:
    views = bits_drive({"a": STOPS ^ (RNG.random(STOPS.shape) < 0.02)}, STEPS)
    small = compact(bits_map(views), alike=0.6, within=0.5)
    assert len(small.runs[0]) < len(views) / 2
    found = localise(small.map, views, stages=[Stage.CHAIN])[Stage.CHAIN]
    along = small.map.sequence.along
    assert max(abs(along[one.best] - along[k]) for k, one in enumerate(found) if k > 2) <= 0.21


def test_a_run_shows_its_central_place_and_what_two_show() -> None:
    shown = [{0, 1, 2, 3}, {0, 1, 2, 4}, {0, 1, 3, 4, 5}, {0, 2, 3}, {6, 7}, {6, 8}]
    columns = [{"a": np.array(sorted(one))} for one in shown]
    distances = PlaceDistances(IncidenceMatrix.from_columns(columns, {"a": 9}))
    found = {first: set(common_features(distances, range(first, stop)).tolist()) for first, stop in ((0, 4), (4, 5))}
    assert found == {0: {0, 1, 2, 3, 4}, 4: {6, 7}}


def test_no_run_is_longer_than_asked() -> None:
    views = bits_drive({"a": np.ones((7, 3), bool)})
    assert [len(run) for run in compact(bits_map(views), within=2.0).runs[0]] == [3, 3, 1]
    assert len(compact(bits_map(views), within=0.0).runs[0]) == 7
