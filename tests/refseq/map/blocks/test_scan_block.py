"""The scan as a block of its own: where words fail, between places, and silent along bare walls."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby
from operator import itemgetter

import numpy as np
import pytest
from scipy.stats import mannwhitneyu, norm

from refseq.belief import Belief, Stage, belief_from
from refseq.errors import MapError
from refseq.inference.matching.log_ratio import Calibration
from refseq.map.blocks import scan_block
from refseq.map.blocks.few_places import FewPlaces, beside, beyond_nearest, pairs_elsewhere
from refseq.map.blocks.scan_block import (
    NEAR,
    NOTHING,
    SURE,
    ScanBlock,
    better,
    falls,
    far_along,
    known_scans,
    scores,
    scores_screened,
)
from refseq.map.growth.adding import add_drive
from refseq.map.learning import learn
from refseq.map.localiser import Localiser, localise, smoothed
from refseq.map.map import Map
from refseq.map.matcher import Matcher
from refseq.map.poses_beside import PosesBeside
from refseq.map.profile import BEST, Profile
from refseq.planar import Pose
from refseq.scan_matching.fit import FARTHEST, LaidScan, ScanFit, fitted, laid_scan
from refseq.scan_matching.screen import Screen
from refseq.view import LASER, Scan, View
from tests.refseq.map.test_poses_beside import LATER, drive
from tests.refseq.rooms import cast, rectangle

FEW, WORDS = "best+log_ratio.screened=0", "best+log_ratio.scans=0"
REFERENCE = [Pose(1.0 + 0.85 * k, 0.0, 0.0) for k in range(28)]


@pytest.fixture(scope="module")
def asked() -> Map:
    """A map whose scans are asked of few places, as they are beside cameras."""
    return learn(drive(REFERENCE), profile=FEW)


@pytest.fixture(scope="module")
def views() -> list[View]:
    return drive(LATER)


def weighing(map_: Map, poses: PosesBeside) -> FewPlaces:
    return FewPlaces(map_, [ScanBlock(map_, poses, map_.sensors)])


def right(map_: Map, views: list[View]) -> int:
    """Answers of the chain that are right."""
    return right_of(localise(map_, views, stages=[Stage.CHAIN])[Stage.CHAIN])


def right_of(beliefs: list[Belief]) -> int:
    """Answers at the nearest place or the next one, of a robot 0.2 m aside and turned by 9°."""
    return sum(belief.lost <= 0.5 and abs(belief.best - k - 0.35) < 1 for k, belief in enumerate(beliefs))


def test_scans_find_what_words_fixed_to_the_robot_do_not(asked: Map, views: list[View]) -> None:
    words = learn(drive(REFERENCE), profile=WORDS)
    assert right(asked, views) >= 18
    assert right(words, views) <= 10


def test_nothing_is_weighed_unless_asked_for(views: list[View]) -> None:
    map_ = learn(drive(REFERENCE), profile=WORDS)
    poses = PosesBeside(map_)
    poses.take(views[3].scan)
    measured = Matcher(map_).match(views[3])
    assert weighing(map_, poses).weighed(measured, None)[0] is measured[0]


@pytest.mark.parametrize(
    ("settings", "sensors", "most"),
    [
        ("", {LASER}, (6, 200)),
        ("", {LASER, "camera"}, (6, 0)),
        ("+log_ratio.screened=0", {LASER}, (6, 0)),
        ("+log_ratio.scans=0", {LASER}, (0, 0)),
        ("+log_ratio.scans=0+log_ratio.scans_alone=6", {LASER}, (6, 200)),
        ("+log_ratio.scans=0+log_ratio.scans_alone=6", {LASER, "camera"}, (0, 0)),
        ("+log_ratio.scans_alone=7+log_ratio.screened=5", {LASER}, (7, 5)),
    ],
)
def test_scans_are_asked_for_with_cameras_or_only_without(
    settings: str, sensors: set[str], most: tuple[int, int]
) -> None:
    map_ = learn(drive(REFERENCE[:8]), profile=f"best{settings}")
    block = ScanBlock(map_, PosesBeside(map_), sensors)
    assert (block.most, block.screened) == most


def test_few_places_are_weighed_and_no_other_changes(asked: Map, views: list[View]) -> None:
    poses = PosesBeside(asked)
    poses.take(views[3].scan)
    (measured,) = Matcher(asked).match(views[3])
    last = belief_from(np.exp(-np.abs(np.arange(28) - 20.0)))
    (weighed,) = weighing(asked, poses).weighed([measured], last)
    assert measured.log_ratio is not None
    assert weighed.log_ratio is not None
    changed = set(np.flatnonzero(weighed.log_ratio != measured.log_ratio).tolist())
    assert len(changed) <= 6
    assert changed >= {20, 21, 22}  # the last belief, carried on by 0.85 m
    assert weighed.likelihood == pytest.approx(np.exp(weighed.log_ratio) / np.exp(weighed.log_ratio).sum())
    assert weighed.timings.matching > measured.timings.matching


def test_where_a_scan_lies_along_its_place_is_not_where_it_lies_beside_it(asked: Map, views: list[View]) -> None:
    """The robot goes 0.2 m beside it all the way, which is the same for all of them."""
    poses = PosesBeside(asked)
    for number, view in enumerate(views[:8]):
        poses.take(view.scan)
        places = number, number + 1
        for place, fit in zip(places, poses.fits(places), strict=True):
            assert view.truth is not None
            assert fit is not None
            assert fit.motion[0] == pytest.approx(view.truth.x - REFERENCE[place].x, abs=0.03)


def at(along: float, score: float) -> ScanFit:
    """A scan that lies so far along [m]."""
    return ScanFit(np.array([along, 0.0, 0.0]), np.eye(3), 1.0, score)


def test_scores_fall_towards_the_next_place_and_a_stand_tells_nothing_of_that() -> None:
    assert falls([at(0.8, 0.6), at(-0.8, 0.8), at(0.01, 0.9), None, at(0.5, 0.9)]) == pytest.approx(0.25)
    assert falls([None, at(0.01, 0.9)]) == 0.0


def test_a_robot_between_places_scores_as_one_at_a_place() -> None:
    """Of the same walls: each place takes 0.3 a metre from a scan, up to the middle between two."""
    same = [at(0.0, 0.9), at(0.2, 0.84), at(-0.4, 0.78)]
    assert scores(same, 0.3, 0.425) == pytest.approx([0.9] * 3)
    assert scores([at(0.8, 0.66), None], 0.3, 0.425) == pytest.approx([0.66 + 0.3 * 0.425, NOTHING])


def test_the_nearest_of_neighbours_loses_nothing_for_its_distance() -> None:
    """Places 0 and 1 are beside each other, place 2 beside none of them."""
    beside = np.array([[True, True, False], [True, True, False], [False, False, True]])

    def farther(fits: list[ScanFit | None], beside: np.ndarray) -> np.ndarray:
        return beyond_nearest(far_along(fits), beside)

    assert farther([at(0.3, 1.0), at(-0.5, 1.0), at(0.4, 1.0)], beside) == pytest.approx(
        [0.0, (0.5**2 - 0.3**2) / 2 / NEAR**2, 0.0]
    )
    assert farther([None, at(-0.5, 1.0), None], beside) == pytest.approx(np.zeros(3))
    assert farther([], np.zeros((0, 0), bool)).shape == (0,)


def test_scores_are_better_where_more_than_chance_brings_are_higher() -> None:
    """As SciPy's test of Mann and Whitney has it, one-sided, at two standard deviations."""
    rng = np.random.default_rng(0)
    answers = set()
    for shift in (-1.0, 0.0, 0.2, 0.3, 0.4, 0.5, 1.0):
        own, others = np.round(rng.normal(shift, 1.0, 40), 2), np.round(rng.normal(0.0, 1.0, 200), 2)
        p = mannwhitneyu(own, others, alternative="greater", method="asymptotic", use_continuity=False).pvalue
        assert better(own, others) == (p < norm.sf(SURE)), shift
        answers.add(better(own, others))
    assert answers == {True, False}
    assert better(np.zeros(1), np.ones(1))


def test_places_learnt_while_the_laser_was_away_do_not_count(asked: Map) -> None:
    """No scan is no bad fit: what the others tell stays as it is."""
    views = [view if k % 4 < 2 else replace(view, scan=None) for k, view in enumerate(drive(REFERENCE))]
    known = known_scans(learn(views, profile=BEST, sensors=[LASER]))
    assert known.tells == known_scans(asked).tells
    assert known.fall == pytest.approx(known_scans(asked).fall, abs=0.15)


def test_scans_of_places_too_far_apart_to_lie_on_each_other_tell_as_well() -> None:
    """Logs of a metre a view were asked by words alone: no scan lay on the one before, as none did elsewhere."""
    sparse = [Pose(1.0 + 1.1 * k, 0.0, 0.0) for k in range(22)]
    map_ = learn(drive(sparse), profile=BEST, sensors=[LASER])
    assert map_.usual_step > FARTHEST
    assert known_scans(map_).tells
    later = drive([Pose(one.x + 0.4, one.y + 0.2, 0.15) for one in sparse])
    words = learn(drive(sparse), profile=WORDS, sensors=[LASER])
    assert right(map_, later) > right(words, later)


@pytest.mark.parametrize("step", [0.85, 1.1])
def test_where_all_scans_are_alike_they_say_nothing(step: float) -> None:
    """A corridor without a door: what one score brings more than another is noise, and no reason to be lost."""
    bare = rectangle(0, -1.2, 90, 1.2)
    rng = np.random.default_rng(1)
    poses = [Pose(28.0 + step * k, 0.0, 0.0) for k in range(36)]
    views = [View(float(k), scan=cast(bare, one, rng=rng), distance=step * bool(k)) for k, one in enumerate(poses)]
    map_ = learn(views, profile=BEST)
    assert not known_scans(map_).tells
    beside = PosesBeside(map_)
    beside.take(views[20].scan)
    assert ScanBlock(map_, beside, {LASER}).log_ratios(np.arange(36)).tolist() == [0.0] * 36


def test_a_robot_half_way_between_places_may_as_well_be_at_its_own_as_at_a_like_one() -> None:
    """Pillars every five and a half places: half-way between two is right at a place of the next pillar."""
    pillars = [(x, y, x, 0.6 * y) for x in np.arange(3.0, 57.0, 5.5 * 0.85).tolist() for y in (1.2, -1.2)]
    walls = [*rectangle(0, -1.2, 58, 1.2), *pillars]

    def drawn(start: float, count: int) -> list[View]:
        poses = [Pose(start + 0.85 * k, 0.0, 0.0) for k in range(count)]
        return [View(float(k), scan=cast(walls, pose), distance=0.85 * bool(k)) for k, pose in enumerate(poses)]

    map_ = learn(drawn(1.0, 64), profile=BEST)
    poses = PosesBeside(map_)
    block = ScanBlock(map_, poses, {LASER})
    own = like = 0.0
    for number, view in enumerate(drawn(1.0 + 20.5 * 0.85, 8), 20):
        poses.take(view.scan)
        told = block.log_ratios(np.array([number, number + 1, number - 5, number + 6]))
        own, like = own + told[:2].max(), like + told[2:].max()
    assert own >= like  # -4 and 9 where scores are compared as they are


def test_places_elsewhere_average_no_more_than_one(asked: Map, views: list[View]) -> None:
    """The promise, on another drive: a ratio above x is had by a place elsewhere in no more than 1 of x cases."""
    poses, zero = PosesBeside(asked), belief_from(np.ones(28))
    (measured,) = Matcher(asked).match(views[0])
    flat = replace(measured, log_ratio=np.zeros(28))
    ratios = []
    block = weighing(asked, poses)
    for number, view in enumerate(views):
        poses.take(view.scan)
        order = np.roll(np.arange(28), -(number + 8)) % 28
        (weighed,) = block.weighed([replace(flat, log_ratio=-1e-9 * order)], zero)
        assert weighed.log_ratio is not None
        far = np.abs(np.arange(28) - number) > 5
        ratios += np.exp(weighed.log_ratio[far & (np.abs(weighed.log_ratio) > 1e-6)]).tolist()
    assert len(ratios) > 20
    assert np.mean(ratios) < 1.2


def test_places_elsewhere_that_are_screened_average_no_more_than_one(views: list[View]) -> None:
    """The same promise, of all places: a third that words might name, and others that are laid where most is met."""
    map_ = learn(drive(REFERENCE), profile=BEST)
    poses, every, ratios = PosesBeside(map_), np.arange(len(map_)), list[float]()
    block = ScanBlock(map_, poses, {LASER})
    for number, view in enumerate(views):
        poses.take(view.scan)
        named, others = every[number % 3 :: 3], np.setdiff1d(every, every[number % 3 :: 3])
        asked = np.concatenate([named, others])
        ratios += np.exp(block.log_ratios(named, others)[np.abs(asked - number) > 5]).tolist()
    assert max(ratios) > 1
    assert np.mean(ratios) < 1.2


@pytest.mark.parametrize("profile", [FEW, BEST], ids=["few", "screened"])
def test_stages_and_localisers_agree(profile: Profile | str, views: list[View]) -> None:
    asked = learn(drive(REFERENCE), profile=profile)
    told = localise(asked, views[:5])
    for stage in Stage:
        alone = Localiser(asked, stage=stage)
        for view, belief in zip(views[:5], told[stage], strict=True):
            assert alone.update(view).places.tobytes() == belief.places.tobytes()
        alone.reset()
        assert alone.update(views[0]).places.tobytes() == told[stage][0].places.tobytes()


def test_a_scan_that_shows_no_walls_speaks_against_no_place(asked: Map) -> None:
    """Neither a view's in which nothing came back, nor that of a place which was learnt while the laser was away."""
    views = drive(REFERENCE)
    gappy = learn([replace(view, scan=None) if k == 10 else view for k, view in enumerate(views)], profile=BEST)
    poses = PosesBeside(gappy)
    poses.take(views[10].scan)
    told = ScanBlock(gappy, poses, {LASER}).log_ratios(np.array([3, 10, 11]))
    assert (told[0] < 0, told[1]) == (True, 0.0)
    nothing = replace(views[3], scan=Scan(np.full(361, np.inf, np.float32)))
    after = Localiser(asked)
    for view in views[:3]:
        before = after.update(view)
    assert after.update(nothing).lost <= before.lost + 0.05


def test_scans_elsewhere_are_laid_once_a_map(views: list[View], monkeypatch: pytest.MonkeyPatch) -> None:
    laid: list[LaidScan] = []

    def counted(pairs: Sequence[tuple[LaidScan, LaidScan]], *about: np.ndarray) -> list[ScanFit | None]:
        laid.extend(seen for _, seen in pairs)
        return fitted(pairs, *about)

    monkeypatch.setattr(scan_block, "fitted", counted)
    map_ = learn(drive(REFERENCE), profile=FEW)
    first, second = (Localiser(map_).update(views[3]) for _ in range(2))
    pairs = len(list(pairs_elsewhere(map_, scan_block.VIEWS, scan_block.PLACES)))
    assert len(laid) == pairs + len(REFERENCE) - 1 > 0
    assert first.places.tobytes() == second.places.tobytes()
    Localiser(replace(map_)).update(views[3])
    assert len(laid) == 2 * (pairs + len(REFERENCE) - 1)


def test_of_screened_places_the_scan_is_laid_on_those_where_most_beams_meet(
    views: list[View], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The others count as places on which it does not lie."""
    monkeypatch.setattr(scan_block, "OPEN", 1)
    map_ = learn(drive(REFERENCE), profile=BEST)
    every = np.arange(len(map_))
    for number, view in enumerate(views[:6]):
        poses = PosesBeside(map_)
        poses.take(view.scan)
        told = ScanBlock(map_, poses, {LASER}).log_ratios(every[:0], every)
        laid = poses.most_met(every.tolist(), 6)
        nowhere = scores_screened(map_).log_ratios(np.array([NOTHING]))
        assert told[np.setdiff1d(every, laid)] == pytest.approx(np.repeat(nowhere, len(map_) - 6))
        assert {number, number + 1} & set(laid)
        assert told.argmax() in {number, number + 1}
        assert told.max() > 1.0


def test_a_place_that_words_name_has_the_mean_of_both_ratios(views: list[View]) -> None:
    """Of its score whatever meets there, as among few places, and of its score where most beams meet; or of nothing."""
    map_ = learn(drive(REFERENCE), profile=BEST)
    every, named = np.arange(len(map_)), np.array([3, 5, 20])
    asked = np.concatenate([named, np.setdiff1d(every, named)])
    poses = PosesBeside(map_)
    poses.take(views[4].scan)
    told = ScanBlock(map_, poses, {LASER}).log_ratios(asked[:3], asked[3:])
    known, met = known_scans(map_), np.isin(asked, poses.most_met(asked.tolist(), 12))
    assert 0 < met[3:].sum() < len(asked) - 3
    fits = [fit if n < 3 or met[n] else None for n, fit in enumerate(poses.fits(asked.tolist()))]
    its = scores(fits, known.fall, known.half)
    ratios = np.exp(scores_screened(map_).log_ratios(np.where(met, its, NOTHING)))
    ratios[:3] = (ratios[:3] + np.exp(known.elsewhere.log_ratios(its[:3]))) / 2
    assert told == pytest.approx(np.log(ratios) - beyond_nearest(far_along(fits), beside(map_, asked)))


def test_scores_elsewhere_are_those_of_views_that_are_asked_as_others_are(
    asked: Map, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Brute force: each view on the few of its far places where most beams meet; nothing at all others."""
    monkeypatch.setattr(scan_block, "OPEN", 1)
    monkeypatch.setattr(scan_block, "VIEWS", 3)
    monkeypatch.setattr(scan_block, "MANY", 9)
    known, many = asked.once(known_scans), scores_screened(asked)
    elsewhere = []
    for view, pairs in groupby(pairs_elsewhere(asked, 3, 9), key=itemgetter(0)):
        poses, scan = [laid_scan(asked.scan(place)) for _, place in pairs], laid_scan(asked.scan(view))
        assert scan is not None
        shares = Screen(scan).shares(poses).tolist()
        fits = fitted(
            [(there, scan) for _, there in sorted(zip(shares, poses, strict=True), key=lambda one: -one[0])[:6]]
        )
        elsewhere += [*scores(fits, known.fall, known.half).tolist(), *[NOTHING] * 3]
    assert len(elsewhere) == 3 * 9
    at = np.linspace(-1.2, 1.2, 49)
    assert many.log_ratios(at) == pytest.approx(Calibration(np.array(elsewhere)).log_ratios(at))


def test_hindsight_asks_scans_as_well(asked: Map, views: list[View]) -> None:
    assert right_of(smoothed(asked, views)) >= right(asked, views) >= 18


def test_a_drive_beside_the_path_is_added_by_its_scans(asked: Map, views: list[View]) -> None:
    """By words alone hardly a view of it is found."""
    assert add_drive(asked, views).placed >= 18
    with pytest.raises(MapError, match="are found on the map"):
        add_drive(learn(drive(REFERENCE), profile=WORDS), views)


def test_maps_of_before_do_not_ask() -> None:
    content = BEST.to_dict()
    del content["log_ratio"]["scans"]
    del content["log_ratio"]["scans_alone"]
    assert Profile.from_dict(content) == replace(BEST, log_ratio=replace(BEST.log_ratio, scans=0, scans_alone=0))
