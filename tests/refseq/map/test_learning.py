"""Maps without a way are refused; a drive whose motion nobody measured is localised all the same."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from refseq.belief import Stage
from refseq.errors import MapError, ViewError
from refseq.map.learning import learn
from refseq.map.localiser import localise
from refseq.map.map import Map
from refseq.map.paths.annotations import Annotations
from refseq.map.profile import BEST
from refseq.view import View
from tests.support import corridor_drive


@pytest.fixture(scope="module")
def views() -> list[View]:
    return corridor_drive(np.random.default_rng(1), count=24, size=96)


@pytest.fixture(scope="module")
def map_(views: list[View]) -> Map:
    return learn(views, profile=BEST, sensors=["forward"])


def unmeasured(views: Sequence[View]) -> list[View]:
    return [replace(view, distance=0.0, turn=0.0, has_odometry=False) for view in views]


@pytest.mark.parametrize(
    ("count", "measured", "message"),
    [
        (6, False, "a map would have 6 places over 0.0 m: there is no odometry on any topic"),
        (6, True, "a map would have 6 places over 0.0 m: the odometry never moves"),
        (1, True, "a map would have 1 place over 0.0 m: the drive holds a single view, or thinning left one"),
    ],
)
def test_a_map_without_a_way_is_refused_with_the_cause(
    views: list[View], count: int, measured: bool, message: str
) -> None:
    still = [replace(view, distance=0.0, has_odometry=measured) for view in views[:count]]
    with pytest.raises(MapError) as caught:
        learn(still)
    assert str(caught.value) == f"{message}; valid are two views or more with odometry between them"


@pytest.mark.parametrize("words", ["go @home", "follow;MT@nan", "MT:90@0.31; MN:5@inf"])
def test_a_behaviour_that_begins_nowhere_is_refused(views: list[View], words: str) -> None:
    told = [*views[:3], replace(views[3], behaviour=words), *views[4:6]]
    with pytest.raises(ViewError) as caught:
        learn(told, sensors=["laser"])
    valid = "valid is as MT:90@0.31; MN:5, with metres behind an @"
    assert str(caught.value) == f"view 3 at 6 s: behaviour is {words!r}; {valid}"
    with pytest.raises(ValueError, match=r"^annotations: "):
        Annotations(("", words))


@pytest.mark.quick_cases("thesis")
@pytest.mark.parametrize("profile", ["thesis", "best"])
def test_a_drive_whose_motion_nobody_measured_moves_on(views: list[View], map_: Map, profile: str) -> None:
    known = map_ if profile == "best" else learn(views, profile=profile, sensors=["forward"])
    query = corridor_drive(np.random.default_rng(2), count=24, size=96, brightness=0.8)
    found = [belief.best for belief in localise(known, unmeasured(query))[Stage.CHAIN]]
    assert np.abs(np.array(found[4:]) - np.arange(4, 24)).max() <= 1


@pytest.mark.parametrize("stride", [1, 2])
def test_blind_views_without_odometry_spread_and_do_not_stay(map_: Map, stride: int) -> None:
    """After certain views, some in which nothing is seen: the belief may be anywhere up to two steps a view ahead."""
    query = unmeasured(corridor_drive(np.random.default_rng(2), count=24, size=96))
    seen = [*query[4:10], *[replace(view, images={}, scan=None) for view in query[10:14:stride]]]
    beliefs = localise(map_, seen)[Stage.CHAIN]
    before, after = beliefs[5].places, beliefs[-1].places
    centre = [float(np.average(np.arange(24), weights=places / places.sum())) for places in (before, after)]
    assert centre[1] > centre[0] + 1 / stride
    spread = [int((places > 0.02 * places.max()).sum()) for places in (before, after)]
    assert spread[1] > spread[0]
