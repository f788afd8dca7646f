"""Leaders on ways that are laid out by hand: true places, and answers in the places of a map of several drives."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from refseq.belief import Belief, belief_from
from refseq.missions.path import MissionPath
from refseq.missions.plan import as_learnt
from refseq.missions.true_way import TrueWay
from refseq.planar import Pose
from refseq.view import View
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.methods.reference import Reference
from refseq_bench.scenarios.missions.leader import (
    InPlaces,
    Journey,
    KnownDrives,
    Leader,
    along_reference,
    over_several,
    positions,
)
from tests.refseq.missions.on_a_line import way
from tests.support import corridor_drive

COUNT = 6


def truths(views: Sequence[View]) -> NDArray[np.float64]:
    found = [view.truth for view in views]
    assert all(found)
    return np.array([[one.x, one.y] for one in found if one is not None])


@pytest.fixture(scope="module")
def views() -> list[View]:
    return corridor_drive(np.random.default_rng(0), COUNT, size=120)


@pytest.fixture(scope="module")
def drives(views: list[View]) -> list[Reference]:
    """One along the corridor, and one back in another part of the building."""
    away = [
        replace(view, truth=Pose(40.0 - 0.85 * number, 7.0, np.pi), distance=0.85 if number else 0.0)
        for number, view in enumerate(corridor_drive(np.random.default_rng(5), 5 * COUNT, size=120)[-COUNT:])
    ]
    return [Reference(views), Reference(away)]


def one_way(method: str, drive: Reference, *, localised: bool) -> Leader:
    return along_reference(method, KnownDrives.alone(method, drive), localised=localised, seed=1)


def there_and_back(method: str, drives: Sequence[Reference], journey: Journey, *, localised: bool) -> Leader:
    known = KnownDrives.merged(method, dict(zip(["there", "back"], drives, strict=True)), merge=False)
    return over_several(method, known, journey, localised=localised, seed=1)


def bent(told: dict[int, str] | None = None) -> TrueWay:
    """A way of 10 m that goes 5 m east, then north, odometry 2 % too long."""
    found = way(10.0, told=told)
    places = np.stack([np.minimum(found.along, 5.0), np.maximum(found.along - 5.0, 0.0)], axis=1)
    return TrueWay(MissionPath(found.places, found.along * 1.02, found.behaviours, found.doors), places)


def test_true_places_lie_on_the_way_at_its_own_metres() -> None:
    ground = bent()
    for place, along in zip(ground.places, ground.way.along, strict=True):
        assert ground.position(along) == pytest.approx(place)
    assert ground.position(2.5 * 1.02) == pytest.approx([2.5, 0.0])
    assert ground.position(99.0) == pytest.approx([5.0, 5.0])


def test_a_stretch_is_all_between_its_ends() -> None:
    ground = bent()
    assert ground.stretch(3.5 * 1.02, 6.5 * 1.02) == pytest.approx(
        np.array([[3.5, 0.0], [4.0, 0.0], [5.0, 0.0], [5.0, 1.0], [5.0, 1.5]])
    )
    assert ground.stretch(4.0, 4.0).shape == ground.stretch(4.0, 3.0).shape == (1, 2)


def test_an_order_that_ends_by_itself_begins_at_one_place_and_others_on_their_stretch() -> None:
    ground = bent({0: "MW:right,1", 4: "MT:90", 5: "MN:0"})
    plan = as_learnt(ground.way)
    sizes = {order.behaviour[:2]: len(ground.where(plan, number)) for number, order in enumerate(plan.orders)}
    assert sizes["MT"] == 1
    assert sizes["MW"] == 5, "the four places before the turn and its own"
    assert ground.where(plan, 0)[0] == pytest.approx([0.0, 0.0])


@pytest.mark.parametrize(("along", "heading"), [(2.0, 0.0), (5.1, np.pi / 4), (8.0, np.pi / 2), (10.2, np.pi / 2)])
def test_it_looks_along_the_way(along: float, heading: float) -> None:
    assert bent().pose(along).heading == pytest.approx(heading)


def test_the_nearest_is_the_nearest_of_all() -> None:
    ground = bent()
    assert ground.nearest(Pose(2.4, -0.7, 1.0)) == pytest.approx(2 * 1.02)
    assert ground.nearest(Pose(9.0, 3.2, 0.0)) == pytest.approx(8 * 1.02)


def test_views_that_do_not_know_where_they_were_are_told(views: list[View]) -> None:
    assert positions(views) == pytest.approx(truths(views))
    with pytest.raises(ScenarioError, match="valid in a mission is a simulated drive"):
        positions([*views[:2], replace(views[2], truth=None)])


@pytest.mark.parametrize("method", ["thesis/chain", "hamming"])
def test_along_one_drive_a_leader_finds_the_views_that_it_learnt(method: str, views: list[View]) -> None:
    drive = Reference(views)
    blind = one_way(method, drive, localised=False)
    assert blind.localiser is None
    leader = one_way(method, drive, localised=True)
    assert leader.ground.places == pytest.approx(truths(views))
    assert leader.ground.way.length == pytest.approx(0.85 * (COUNT - 1))
    assert leader.localiser is not None
    assert leader.localiser.update(views[3]).best == 3


class Fixed:
    """A localiser that answers always the same."""

    def __init__(self, belief: Belief) -> None:
        self.belief, self.resets = belief, 0

    def reset(self) -> None:
        self.resets += 1

    def update(self, view: View) -> Belief:
        del view
        return self.belief


def test_beliefs_of_views_are_summed_up_at_their_places(views: list[View]) -> None:
    held = np.array([0, 1, 2, 1, 0, 4], np.intp)  # nothing was learnt of place 3 alone
    after = np.array([0.01, 0.0, 0.0, 0.0, 0.02, 0.03])
    inner = Fixed(replace(belief_from(np.arange(1.0, 7.0)), path=(5, 3, -1), lost_after=after))
    found = InPlaces(inner, held, 5).update(views[0])
    own = inner.belief.places
    assert found.places == pytest.approx([own[0] + own[4], own[1] + own[3], own[2], 0.0, own[5]])
    assert found.places.sum() + found.lost == pytest.approx(1.0)
    assert (found.best, found.path) == (4, (4, 1, -1))
    assert found.lost_after == pytest.approx([0.03, 0.0, 0.0, 0.0, 0.03])
    InPlaces(inner, held, 5).reset()
    assert inner.resets == 1


@pytest.mark.parametrize("goal", [None, 2.5])
def test_over_several_drives_it_goes_from_near_the_start_to_the_goal(
    drives: list[Reference], goal: float | None
) -> None:
    journey = Journey(Pose(38.2, 7.1, np.pi), "back", goal)
    leader = there_and_back("hamming", drives, journey, localised=True)
    last = COUNT - 1 if goal is None else 3
    assert leader.ground.places == pytest.approx(truths(drives[1].views)[2 : last + 1])
    assert leader.ground.way.length == pytest.approx(0.85 * (last - 2))
    assert leader.ground.way.places.tolist() == [COUNT + k for k in range(2, last + 1)]
    assert isinstance(leader.localiser, InPlaces)
    for drive, of_drive in enumerate(drives):
        found = leader.localiser.update(of_drive.views[4])
        assert found.best == drive * COUNT + 4
        assert len(found.places) == 2 * COUNT


def test_with_our_own_localiser_it_answers_in_the_map_itself(drives: list[Reference]) -> None:
    journey = Journey(Pose(1.0, 0.0, 0.0), "there", None)
    blind = there_and_back("thesis/uniform", drives, journey, localised=False)
    assert blind.localiser is None
    leader = there_and_back("thesis/uniform", drives, journey, localised=True)
    assert leader.localiser is not None
    found = leader.localiser.update(drives[1].views[3]).places
    assert len(found) == 2 * COUNT
    assert found[COUNT:].sum() > 0.9, "the drive back, whose views are others"
    assert leader.ground.places == pytest.approx(truths(drives[0].views))


def test_who_looks_the_other_way_begins_on_the_drive_that_went_there(views: list[View]) -> None:
    back = [
        replace(view, truth=Pose(one.x, one.y, np.pi))
        for view, one in zip(views, [view.truth for view in views][::-1], strict=True)
        if one is not None
    ]
    drives = [Reference(views), Reference(back)]
    start = Pose(1.0 + 0.85 * 4, 0.0, np.pi)
    leader = there_and_back("hamming", drives, Journey(start, "back", None), localised=False)
    assert leader.ground.way.places[0] == COUNT + 1


def test_where_it_is_at_the_goal_already_it_stays(drives: list[Reference]) -> None:
    start = Pose(40.0, 7.0, np.pi)
    leader = there_and_back("hamming", drives, Journey(start, "back", 0.0), localised=False)
    assert leader.ground.places == pytest.approx(np.array([[start.x, start.y]]))
    assert leader.ground.way.length == 0.0
