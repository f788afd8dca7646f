"""Views weighed by what those before brought at their places: a way off the path through a corridor of like walls."""

import math
from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq.atlas.decision import Decision
from refseq.atlas.merge import merge_maps
from refseq.belief import Belief, Stage, Timings, belief_from
from refseq.inference.matching.log_ratio import log_calibrated
from refseq.map.learning import learn
from refseq.map.localiser import Localiser, localise, smoothed
from refseq.map.map import Map, beside
from refseq.map.matcher import Measurement
from refseq.map.profile import BEST
from refseq.map.tracking.usual import UsualViews, too_little
from refseq.view import View
from tests.refseq.rooms import bits_drive, bits_map
from tests.support import CAMERAS, corridor_drive, texture

COUNT, LEFT = 32, 18
"""Views of the path, and the one at which the robot leaves it."""


def corridor(first: int, seed: int) -> list[View]:
    """A drive along walls that look as they do from ``first`` [m] on; its scans are those of all such corridors."""
    rng = np.random.default_rng(seed)
    return [
        replace(view, images={name: noisy(texture(first + 0.85 * number, 96, 1.0, camera), 3.0, rng)
                              for camera, name in enumerate(CAMERAS)})
        for number, view in enumerate(corridor_drive(rng, count=COUNT, size=3))
    ]  # fmt: skip


def noisy(image: np.ndarray, sigma: float, rng: np.random.Generator) -> np.ndarray:
    return (image + rng.normal(0, sigma, image.shape)).clip(0, 255).astype(np.uint8)


PATH, LATER, ELSEWHERE = corridor(0, 1), corridor(0, 7), corridor(500, 9)


def learnt(usual: int, name: str = "", views: list[View] = PATH) -> Map:
    # Drives here are put together of two corridors: pictures would tell at once that the robot was carried.
    return learn(views, profile=f"best+log_ratio.usual={usual}+chain.carried=0", name=name)


@pytest.fixture(scope="module")
def maps() -> tuple[Map, Map]:
    """A map that does not ask what is usual, and one that does."""
    return learnt(0), learnt(100)


def chain(map_: Map, views: list[View]) -> list[Belief]:
    return localise(map_, views, stages=[Stage.CHAIN])[Stage.CHAIN]


def lost(beliefs: list[Belief]) -> np.ndarray:
    return np.array([belief.lost for belief in beliefs])


usual_views = st.lists(st.floats(-2, 8), max_size=60)


@given(usual_views, st.lists(st.floats(-5, 10), min_size=1, max_size=20))
def test_the_less_a_view_brings_the_more_speaks_against_a_place(usual: list[float], brought: list[float]) -> None:
    brought = sorted(brought)
    against = too_little(np.array(usual), np.array(brought))
    assert (against >= 0).all()
    assert all(one >= other for one, other in pairwise(against))
    for value, found in zip(brought, against, strict=True):
        share = (1 + sum(one <= value for one in usual)) / (len(usual) + 1)
        assert found == pytest.approx(max(0.0, float(log_calibrated(np.array([share]))[0])))


def test_nothing_is_unusual_before_anything_was_seen_and_what_most_bring_never_is() -> None:
    assert too_little(np.zeros(0), np.array([-9.0, 9.0])).tolist() == [0.0, 0.0]
    usual = np.arange(100.0)
    assert too_little(usual, np.array([50.0, 99.0])).tolist() == [0.0, 0.0]
    assert too_little(usual, np.array([-1.0]))[0] > 1.0


def test_nothing_speaks_against_a_place_that_was_not_asked() -> None:
    against = too_little(np.arange(100.0), np.array([np.nan, -1.0]))
    assert against[0] == 0 < against[1]


def test_in_another_corridor_the_robot_says_sooner_that_it_is_lost(maps: tuple[Map, Map]) -> None:
    drive = [*LATER[:LEFT], *ELSEWHERE[LEFT:]]
    plain, asking = (lost(chain(map_, drive)) for map_ in maps)
    assert (asking[:LEFT] < 0.5).all()
    assert LEFT < np.argmax(asking > 0.5) < np.argmax(plain > 0.5)


def test_in_a_map_of_several_paths_what_is_usual_is_that_of_the_path_it_is_on(maps: tuple[Map, Map]) -> None:
    drive = [*LATER[:LEFT], *ELSEWHERE[LEFT:]]
    other = corridor(1000, 3)[:12]
    plain, asking = (
        lost(chain(beside([learnt(usual, "far", other), map_.named("here")]), drive))
        for usual, map_ in zip((0, 100), maps, strict=True)
    )
    assert (asking[:LEFT] < 0.5).all()
    assert LEFT < np.argmax(asking > 0.5) < np.argmax(plain > 0.5)


def test_hindsight_does_not_ask_what_is_usual(maps: tuple[Map, Map]) -> None:
    drive = [*LATER[:LEFT], *ELSEWHERE[LEFT : LEFT + 3], *LATER[LEFT + 3 :]]
    plain, asking = (lost(smoothed(map_, drive)) for map_ in maps)
    np.testing.assert_allclose(asking, plain, atol=1e-12)


def test_along_its_path_it_answers_as_before(maps: tuple[Map, Map]) -> None:
    plain, asking = (chain(map_, LATER) for map_ in maps)
    assert [belief.best for belief in asking] == [belief.best for belief in plain]
    assert (lost(asking) < 0.1).all()


def test_a_picture_is_compared_with_those_of_no_less_noise(maps: tuple[Map, Map]) -> None:
    """The lamps fail: what is seen in bare noise is less than ever, and tells nothing of a way off the path."""
    rng = np.random.default_rng(3)
    dark = [
        replace(view, images={name: noisy(image // 16, 20.0, rng) for name, image in view.images.items()})
        for view in LATER
    ]
    drive = [*LATER[:LEFT], *dark[LEFT : LEFT + 1]]
    plain, asking = (lost(chain(map_, drive)) for map_ in maps)
    assert asking[-1] == pytest.approx(plain[-1], abs=0.02)


def test_after_a_reset_nothing_is_usual(maps: tuple[Map, Map]) -> None:
    localiser = Localiser(maps[1])
    for view in LATER[:LEFT]:  # sure of the last one as well
        localiser.update(view)
    localiser.reset()
    again = [localiser.update(view) for view in ELSEWHERE[:5]]
    assert lost(again).tolist() == lost(chain(maps[1], ELSEWHERE[:5])).tolist()


@pytest.mark.slow
def test_the_views_of_a_stand_are_one(maps: tuple[Map, Map]) -> None:
    """However long it stands at one place: what is usual is that of the drive."""
    stand = [replace(LATER[12], distance=0.0, turn=0.0) for _ in range(150)]
    short = chain(maps[1], [*LATER[:13], *LATER[13:LEFT], *ELSEWHERE[LEFT : LEFT + 2]])
    long = chain(maps[1], [*LATER[:13], *stand, *LATER[13:LEFT], *ELSEWHERE[LEFT : LEFT + 2]])
    np.testing.assert_allclose(lost(long[-2:]), lost(short[-2:]), atol=1e-3)


def both(brought: float) -> dict[str, np.ndarray]:
    """Log ratios that two cameras bring, everywhere the same."""
    return {f"sift/{camera}": np.full(COUNT, brought) for camera in CAMERAS}


@pytest.mark.parametrize("alone", [True, False])
def test_a_sensor_that_is_asked_alone_is_not_doubted(maps: tuple[Map, Map], alone: bool) -> None:
    """A camera's words and dense words are one sensor: before a bare wall both bring little."""
    usual, places = UsualViews(maps[1]), np.eye(COUNT)[3]
    names = ("sift/forward", "dense/forward") if alone else ("sift/forward", "sift/lateral")
    rich = Measurement(places, 0.85, Timings(), np.zeros(COUNT), by_block=dict.fromkeys(names, np.full(COUNT, 4.0)))
    for _ in range(40):
        usual.weighed([rich])
        usual.remember([rich], belief_from(places, 0.0))
    poor = replace(rich, by_block=dict.fromkeys(names, np.full(COUNT, -1.0)))
    against = usual.weighed([poor])[0].log_ratio
    assert against.tolist() == [0.0] * COUNT if alone else (against < 0).all()


def test_what_is_not_sure_is_not_remembered(maps: tuple[Map, Map]) -> None:
    """Views of elsewhere, whose places the chain doubts, leave no mark on what is usual."""
    usual = UsualViews(maps[1])
    places = np.zeros(COUNT)
    places[3] = 1.0
    measured = [Measurement(places, 0.85, Timings(), np.zeros(COUNT), by_block=both(4.0))]
    spread = np.full(COUNT, 1 / COUNT)
    for weights, doubt in ((places, 0.02), (spread, 0.0)):
        usual.remember(measured, belief_from(weights, doubt))
        assert usual.weighed(measured)[0].log_ratio.tolist() == [0.0] * COUNT
    usual.remember(measured, belief_from(places, 0.0))
    poorer = [replace(measured[0], by_block=both(-1.0))]
    for _ in range(40):
        usual.weighed(measured)
        usual.remember(measured, belief_from(places, 0.0))
    assert (usual.weighed(poorer)[0].log_ratio < 0).all()
    assert usual.weighed([replace(poorer[0], by_block={})])[0].log_ratio.tolist() == [0.0] * COUNT


def test_what_holds_though_words_may_tell_nothing_is_not_doubted(maps: tuple[Map, Map]) -> None:
    """A scan fits by lamplight as by day: it is added to doubted words, and does not go down with them."""
    usual, places = UsualViews(maps[1]), np.eye(COUNT)[3]
    view = Measurement(places, 0.85, Timings(), np.zeros(COUNT), by_block=both(4.0))
    for _ in range(40):
        usual.weighed([view])
        usual.remember([view], belief_from(places, 0.0))
    words = replace(view, by_block=both(-1.0))
    scan = np.linspace(-1.5, 1.5, COUNT)
    with_scan = replace(words, log_ratio=scan, never_blind=scan)
    (doubted,), (both_told,) = usual.weighed([words]), usual.weighed([with_scan])
    assert doubted.log_ratio is not None
    assert both_told.log_ratio is not None
    assert (doubted.log_ratio < 0).all()
    assert both_told.log_ratio == pytest.approx(doubted.log_ratio + scan)


SEEING = replace(BEST, log_ratio=replace(BEST.log_ratio, usual=100, blind=0.0))
"""Views are never blind, so that log ratios add up."""
PLACE = np.eye(COUNT)[3]
STRAIGHT = bits_map(bits_drive({"camera": np.eye(COUNT, dtype=bool)}), SEEING)


def against(
    usually: Mapping[str, float],
    brought: Mapping[str, float],
    power: float = 1.0,
    places: np.ndarray = PLACE,
    map_: Map = STRAIGHT,
) -> np.ndarray:
    """Log ratios by what blocks ``brought``, after 40 views at the same place to which they brought what is usual."""
    usual = UsualViews(map_)
    view = Measurement(places, 0.85, Timings(), np.zeros(COUNT), power=power)
    rich, poor = (
        replace(view, by_block={key: np.full(COUNT, nats) for key, nats in of.items()}) for of in (usually, brought)
    )
    for _ in range(40):
        usual.weighed([rich])
        usual.remember([rich], belief_from(places, 0.0))
    return usual.weighed([poor])[0].log_ratio


RICH, POOR = ({"sift/forward": nats, "sift/lateral": nats} for nats in (4.0, -1.0))


def test_less_than_all_views_before_brought_has_a_p_value_of_one_in_so_many() -> None:
    """In 41 views none brought as little: p = 1/41, which the mean of all power calibrators makes a ratio."""
    p = 1 / 41
    ratio = (1 - p + p * math.log(p)) / (p * math.log(p) ** 2)
    assert against(RICH, POOR) == pytest.approx(-2 * math.log(ratio))
    assert against(RICH, RICH) == pytest.approx(0.0)


def test_blocks_that_err_together_speak_against_a_place_with_less_power() -> None:
    assert against(RICH, POOR, power=0.5) == pytest.approx(against(RICH, POOR) / 2)


def test_a_block_that_was_not_asked_at_its_place_has_nothing_usual() -> None:
    found = against({**RICH, "dense/forward": math.nan}, {**POOR, "dense/forward": -1.0})
    assert found == pytest.approx(against(RICH, POOR))


@pytest.mark.parametrize(("beside", "remembered"), [(4, True), (2, True), (5, False)])
def test_a_place_is_sure_where_it_and_its_neighbours_hold_the_belief(beside: int, remembered: bool) -> None:
    shared = 0.55 * PLACE + 0.45 * np.eye(COUNT)[beside]
    assert (against(RICH, POOR, places=shared) < 0).all() == remembered


@pytest.mark.parametrize(("at", "remembered"), [(2, True), (4, False)])
def test_a_place_behind_a_stretch_that_was_given_away_is_no_neighbour(at: int, remembered: bool) -> None:
    """Views 4 to 7 of the path are places of another: its places 3 and 4 lie 5 m apart."""
    other = bits_map(bits_drive({"camera": np.eye(COUNT, dtype=bool)[4:8]}), SEEING)
    joined = Decision("other", "path", (0, 3), (4, 7), (0.0, 0.0), joined=True, why="by a person")
    map_ = merge_maps([STRAIGHT.named("path"), other.named("other")], wishes=[joined]).map
    assert [len(one) for one in map_.sequences] == [COUNT - 4, 4]
    shared = 0.55 * PLACE + 0.45 * np.eye(COUNT)[at]
    assert (against(RICH, POOR, places=shared, map_=map_) < 0).all() == remembered
