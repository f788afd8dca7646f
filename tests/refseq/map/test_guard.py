from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from refseq.belief import LOST, Stage
from refseq.fault import FaultKind
from refseq.map.guard import SensorGuard
from refseq.map.learning import learn
from refseq.map.localiser import Localiser, smoothed
from refseq.map.map import Map
from refseq.map.matcher import Matcher
from refseq.map.tracking.trackers import tracker_for
from refseq.view import LASER
from tests.refseq.health.drives import drive, from_view

REFERENCE = [replace(view, images={}) for view in drive(30, seed=1)]
QUERY = [replace(view, images={}) for view in drive(30, seed=2)]


@cache
def learnt() -> Map:
    """A map that is asked as the bare matcher answers."""
    return learn(REFERENCE, profile="best+log_ratio.scans=0+log_ratio.usual=0+log_ratio.fixes=0")


START = 10


def beliefs(views):
    localiser = Localiser(learnt())
    return [localiser.update(view) for view in views]


def test_without_a_fault_the_answers_are_those_of_the_bare_matcher_to_the_last_bit():
    matcher, tracker = Matcher(learnt()), tracker_for(Stage.CHAIN, learnt())
    for view, belief in zip(QUERY, beliefs(QUERY), strict=True):
        bare = tracker.update(matcher.match(view))
        np.testing.assert_array_equal(bare.places, belief.places)
        assert (bare.lost, bare.path, bare.faults) == (belief.lost, belief.path, belief.faults)
        assert belief.faults == ()


def test_a_robot_whose_only_sensor_is_ill_is_lost_until_it_is_well():
    stuck = from_view(QUERY, START, lambda view, last: replace(view, scan=last.scan))
    found = beliefs([*stuck[: START + 6], *QUERY[START + 6 :]])
    ill = [k for k, belief in enumerate(found) if belief.faults]
    assert START < ill[0] <= START + 2
    assert ill[-1] < START + 9
    assert all(found[k].lost == 1.0 and found[k].path[-1] == LOST for k in ill)
    assert found[-1].lost < 0.5


def test_in_hindsight_views_tell_of_their_faults_too():
    """Of a stuck laser's views those before it was well again are where later views put them."""
    stuck = from_view(QUERY, START, lambda view, last: replace(view, scan=last.scan))
    healed = [*stuck[: START + 6], *QUERY[START + 6 :]]
    on_the_way, hindsight = beliefs(healed), smoothed(learnt(), healed)
    assert [belief.faults for belief in hindsight] == [belief.faults for belief in on_the_way]
    ill = [k for k, belief in enumerate(hindsight) if belief.faults]
    assert ill
    assert all(hindsight[k].lost < 0.5 and abs(hindsight[k].best - k) <= 1 for k in ill)


def test_in_hindsight_a_robot_that_never_sees_again_is_lost_as_on_the_way():
    stuck = from_view(QUERY, START, lambda view, last: replace(view, scan=last.scan))
    on_the_way, hindsight = beliefs(stuck), smoothed(learnt(), stuck)
    blind = [k for k, belief in enumerate(on_the_way) if belief.faults]
    assert blind[-1] == len(stuck) - 1
    assert all(hindsight[k].lost == 1.0 and hindsight[k].path[-1] == LOST for k in blind)
    assert all(not belief.faults and belief.lost < 0.5 for belief in hindsight[: blind[0]])


def test_ill_odometry_has_no_part_in_the_motion():
    guard = SensorGuard(learnt())
    doubled = from_view(QUERY, START, lambda view, _: replace(view, distance=2 * view.distance, turn=2 * view.turn))
    for view in doubled[: START + 4]:
        (measured,) = guard.match(view)
    assert [fault.kind for fault in guard.view_faults.faults] == [FaultKind.DOUBLED]
    assert np.isnan(measured.distance)
    assert view.sensors == {LASER}


def test_stamps_that_go_back_are_told_and_change_nothing_else():
    back = from_view(QUERY, START, lambda view, _: replace(view, time=view.time - 100))
    for well, ill in zip(beliefs(QUERY), beliefs(back), strict=True):
        np.testing.assert_array_equal(well.places, ill.places)
        assert well.lost == ill.lost
    assert any(belief.faults for belief in beliefs(back))


def test_a_reset_localiser_has_no_fault():
    localiser = Localiser(learnt())
    for view in from_view(QUERY, START, lambda view, last: replace(view, scan=last.scan))[: START + 3]:
        belief = localiser.update(view)
    assert belief.faults
    localiser.reset()
    assert localiser.update(QUERY[0]).faults == ()


@pytest.mark.quick_cases("camera-1")
@pytest.mark.parametrize("name", ["camera-1", "camera-2"])
def test_a_sensor_that_the_map_does_not_have_leaves_the_robot_where_it_is(name):
    query = [replace(one, images={name: two.images[name]}) for one, two in zip(QUERY, drive(30, seed=2), strict=True)]
    black = from_view(query, START, lambda view, _: replace(view, images={name: np.zeros_like(view.images[name])}))
    for well, ill in zip(beliefs(QUERY), beliefs(black), strict=True):
        np.testing.assert_array_equal(well.places, ill.places)
        assert ill.lost == well.lost
