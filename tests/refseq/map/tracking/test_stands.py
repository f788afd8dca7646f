"""A robot that stands: its views are one, at every stage, and missing odometry is noticed where it moves."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import softmax

from refseq.belief import Belief, Stage, Timings
from refseq.fault import ODOMETRY, FaultKind
from refseq.inference.chain.chain import Chain, ChainSettings, Observation
from refseq.inference.chain.forward import ForwardFilter
from refseq.inference.chain.motion import MotionSettings
from refseq.inference.chain.path_filter import path_smoothed
from refseq.inference.chain.viterbi import SlidingViterbi
from refseq.map.learning import learn
from refseq.map.localiser import Localiser, localise, smoothed
from refseq.map.map import Map
from refseq.map.matcher import Measurement
from refseq.map.tracking.stands import Stands
from refseq.view import View
from tests.refseq.health.drives import drive

K = 7
REFERENCE, QUERY = drive(24, seed=1), drive(24, seed=2)
AT = 9
ONCE = "best+motion.stands_once=true"


@pytest.fixture(scope="module", params=["thesis", "best", "best+log_ratio.geometry=0"])
def map_(request: pytest.FixtureRequest) -> Map:
    """A map that knows no usual views: of those an odometer of zeros tells fewer."""
    return learn(REFERENCE, profile=f"{request.param}+motion.stands_once=true+log_ratio.usual=0")


@pytest.fixture(scope="module")
def once() -> Map:
    return learn(REFERENCE, profile=ONCE)


def ratios(values: Sequence[float], again: bool = False, distance: float = 1.0) -> list[Measurement]:
    told = np.array(values, np.float64)
    return [Measurement(softmax(told), distance, Timings(), told, again=again)]


@given(st.lists(st.lists(st.floats(-30, 30), min_size=3, max_size=3), min_size=1, max_size=6))
def test_the_views_of_a_stand_tell_their_mean(told: list[list[float]]) -> None:
    stands = Stands()
    stands.mean(ratios([5.0, 5.0, 5.0]))
    for number, one in enumerate(told):
        (found,) = stands.mean(ratios(one, again=number > 0, distance=0.7 if number == 0 else 0.0))
    assert found.log_ratio is not None
    np.testing.assert_allclose(found.log_ratio, np.mean(told, axis=0), atol=1e-9)
    np.testing.assert_allclose(found.likelihood, softmax(np.mean(told, axis=0)), atol=1e-9)
    assert found.distance == 0.7


def test_of_a_mixture_the_mean_is_that_of_the_logarithms_and_no_view_rules_out_alone() -> None:
    stands = Stands()
    one, other = (Measurement(np.array(p), 1.0, Timings(), None, -2.0) for p in ([0.8, 0.2, 0.0], [0.2, 0.2, 0.6]))
    stands.mean([one])
    (found,) = stands.mean([replace(other, again=True, log_average=-4.0)])
    assert found.log_ratio is None
    assert found.log_average == -3.0
    assert found.likelihood[0] == pytest.approx(2 * found.likelihood[1])
    assert 0 < found.likelihood[2] < 1e-100


def observations(rng: np.random.Generator, count: int) -> list[Observation]:
    return [Observation(float(rng.uniform(0, 2)), rng.normal(size=K), float(rng.normal())) for _ in range(count)]


def chain() -> Chain:
    return Chain(np.arange(float(K)), MotionSettings(), ChainSettings(window=4, run_out=3.0))


@pytest.mark.parametrize("decoder", [ForwardFilter, SlidingViterbi])
@pytest.mark.parametrize("at", [0, 1, 5])
def test_a_view_seen_again_takes_the_place_of_the_last_one(decoder: Callable[[Chain], ForwardFilter], at: int) -> None:
    rng = np.random.default_rng(at)
    seen, other = observations(rng, 8), observations(rng, 1)[0]
    plain, standing = decoder(chain()), decoder(chain())
    for number, one in enumerate(seen):
        wanted = plain.update(one)
        if number == at:
            standing.update(replace(other, distance=one.distance))
            found = standing.update(replace(one, again=True))
        else:
            found = standing.update(one)
        np.testing.assert_array_equal(found.places, wanted.places)
        np.testing.assert_array_equal(found.lost, wanted.lost)


def test_in_hindsight_the_views_of_a_stand_have_one_answer() -> None:
    rng = np.random.default_rng(3)
    seen, other = observations(rng, 5), observations(rng, 1)[0]
    with_stand = [*seen[:2], replace(other, distance=seen[2].distance), replace(seen[2], again=True), *seen[3:]]
    wanted, found = path_smoothed(seen, chain()), path_smoothed(with_stand, chain())
    assert len(found) == 6
    for number, k in enumerate([0, 1, 2, 2, 3, 4]):
        np.testing.assert_array_equal(found[number].places, wanted[k].places)


def with_stand(count: int) -> list[View]:
    """The drive, with one of its views seen so many times more, to the last bit."""
    more = [replace(QUERY[AT], distance=0.0, turn=0.0, time=QUERY[AT].time + 0.1 * (k + 1)) for k in range(count)]
    return [*QUERY[: AT + 1], *more, *QUERY[AT + 1 :]]


def close(one: Belief, other: Belief, within: float = 1e-9) -> None:
    np.testing.assert_allclose(one.places, other.places, atol=within)
    assert one.lost == pytest.approx(other.lost, abs=within)


@pytest.mark.quick_cases("chain")
@pytest.mark.parametrize("stage", Stage)
def test_a_standing_robot_is_as_sure_after_ten_views_as_after_one(once: Map, stage: Stage) -> None:
    plain, found = (localise(once, views, stages=[stage])[stage] for views in (QUERY, with_stand(9)))
    for belief in found[AT : AT + 10]:
        close(belief, plain[AT])
    for belief, wanted in zip(found[AT + 10 :], plain[AT + 1 :], strict=True):
        close(belief, wanted)


def test_unless_asked_each_view_of_a_stand_speaks_anew(once: Map) -> None:
    """The likeliest place gains by each view that says the same: by that a robot that looks about itself is found."""
    found = localise(learn(REFERENCE, profile="best"), with_stand(3), stages=[Stage.PRIOR])[Stage.PRIOR]
    plain = localise(once, with_stand(3), stages=[Stage.PRIOR])[Stage.PRIOR]
    np.testing.assert_array_equal(found[AT].places, plain[AT].places)
    assert found[AT + 3].places.max() > plain[AT + 3].places.max()


def test_in_hindsight_too(once: Map) -> None:
    plain, found = smoothed(once, QUERY), smoothed(once, with_stand(3))
    for belief, wanted in zip([*found[:AT], *found[AT + 3 :]], plain, strict=True):
        close(belief, wanted)


@pytest.mark.quick_cases("thesis")
def test_a_robot_that_stood_since_the_start_is_no_surer_either(map_: Map) -> None:
    localiser = Localiser(map_)
    first = QUERY[AT]
    beliefs = [localiser.update(replace(first, distance=0.0, turn=0.0, time=first.time + k)) for k in range(6)]
    if map_.profile.method.matching == "log_ratio":  # the mixture draws random components for each view
        # Keys are laid on places that the belief before names, and at the first view there is none.
        within = 1e-4 if map_.profile.log_ratio.geometry else 1e-9
        for belief in beliefs:
            close(belief, beliefs[0], within)
    assert len({len(belief.path) for belief in beliefs}) == 1


@pytest.mark.quick_cases("best")
def test_an_odometer_of_zeros_is_told_once_and_does_not_hold_the_robot(map_: Map) -> None:
    zeros = [replace(view, distance=0.0, turn=0.0) for view in QUERY]
    beliefs = localise(map_, zeros, stages=[Stage.CHAIN])[Stage.CHAIN]
    told = {fault for belief in beliefs for fault in belief.faults}
    assert [(fault.sensor, fault.kind, fault.since) for fault in told] == [(ODOMETRY, FaultKind.FROZEN, 1)]
    without = localise(map_, [replace(view, has_odometry=False) for view in zeros], stages=[Stage.CHAIN])[Stage.CHAIN]
    for belief, wanted in zip(beliefs, without, strict=True):
        np.testing.assert_array_equal(belief.places, wanted.places)
        assert belief.lost == wanted.lost
    assert [belief.best for belief in beliefs[-8:]] == list(range(16, 24))


def test_without_odometry_pictures_tell_a_robot_that_stands_at_the_end_of_its_path() -> None:
    """Else it would seem to go on, past the end, where places show nothing more."""
    map_ = learn(REFERENCE, profile="best", sensors=["camera-1", "camera-2"])
    arrived = [replace(view, scan=None, distance=0.0, turn=0.0, has_odometry=False) for view in QUERY]
    stood = [replace(arrived[-1], time=arrived[-1].time + k) for k in range(1, 11)]
    beliefs = localise(map_, [*arrived, *stood], stages=[Stage.CHAIN])[Stage.CHAIN]
    assert [belief.best for belief in beliefs[-11:]] == [23] * 11
    assert max(belief.lost for belief in beliefs[-10:]) <= beliefs[len(arrived) - 1].lost + 0.05
