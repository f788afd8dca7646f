"""Tasks and what they judge, without any simulation."""

import math

import numpy as np
import pytest

from refseq.belief import belief_from
from refseq.planar import Pose
from refseq_bench.robots.robot import Shape
from refseq_bench.sim.envs.tasks.cross_door import BESIDE, FAR, NEAR, CrossDoorTask, DoorwayPlace
from refseq_bench.sim.envs.tasks.follow_corridor import ARRIVED, FollowCorridorTask
from refseq_bench.sim.envs.tasks.mission_goal import BehindDoor
from refseq_bench.sim.envs.tasks.reach_place import FARTHEST, NEAREST, ReachPlaceTask
from refseq_bench.sim.envs.tasks.recover import ASIDE, HERE, LED, OFF, SURE, TURNED, RecoverTask, belief_in
from refseq_bench.sim.envs.tasks.task import FAILURE, SUCCESS, Episode, Situation, TaskGround
from refseq_bench.sim.envs.worlds.rooms import FORMS, two_rooms

SHAPE = Shape(ahead=0.8, behind=0.3, half_width=0.36, height=1.4)
ROUTE = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 6.0]])
PLACES = np.array([(k, 0.0) for k in range(11)], float)
GROUND = TaskGround(two_rooms(0), ROUTE, SHAPE, PLACES)


def begun(task: FollowCorridorTask | CrossDoorTask | ReachPlaceTask | RecoverTask, seed: int = 0) -> Episode:
    return task.episode(GROUND, np.random.default_rng(seed))


def at(x: float, y: float, **more: object) -> Situation:
    return Situation(Pose(x, y, 0.0), **more)  # type: ignore[arg-type]


def test_progress_round_the_bend_is_rewarded_once_and_given_back_on_the_way_back() -> None:
    episode = begun(FollowCorridorTask())
    assert episode.begin(at(8.0, 0.2)) == pytest.approx(8.0)
    stops = [(9.5, -0.3), (10.1, 0.5), (10.0, 2.5), (10.0, 1.5)]
    judged = [episode.judge(at(*stop)) for stop in stops]
    assert [judgement.reward for judgement in judged] == pytest.approx([1.5, 1.0, 2.0, -1.0])
    assert not any(judgement.over for judgement in judged)


@pytest.mark.parametrize("task", [FollowCorridorTask(), ReachPlaceTask()])
def test_who_comes_near_the_lane_back_has_come_no_further_than_it_went(
    task: FollowCorridorTask | ReachPlaceTask,
) -> None:
    """The way comes back 1 m beside itself: half a metre ahead is worth half a metre, whichever lane is nearer."""
    hairpin = np.array([(x, 0.0) for x in range(11)] + [(x, 1.0) for x in range(10, -1, -1)], float)
    ground = TaskGround(two_rooms(0), hairpin, SHAPE, hairpin)
    drawn = (task.episode(ground, np.random.default_rng(seed)) for seed in range(200))
    episode = next(one for one in drawn if one.start.x < 7 and abs(one.start.y) < 0.3 and (one.goal or 17) >= 17)
    x = episode.start.x
    episode.begin(at(x, 0.0))
    episode.judge(at(x + 0.5, 0.6))
    rewards = [episode.judge(at(x + ahead, 0.6)).reward for ahead in (1.0, 1.5, 2.0)]
    assert rewards == pytest.approx([0.5, 0.5, 0.5])


def test_the_end_of_the_corridor_is_success() -> None:
    episode = begun(FollowCorridorTask())
    episode.begin(at(10.0, 5.0))
    assert not episode.judge(at(10.0, 6.0 - ARRIVED - 0.01)).over
    judged = episode.judge(at(10.0, 6.0 - ARRIVED + 0.01))
    assert (judged.success, judged.failure, judged.over) == (True, "", True)
    assert judged.reward == pytest.approx(SUCCESS + 0.02)


@pytest.mark.parametrize(
    ("situation", "failure"),
    [
        (at(10.0, 5.9, touches=True), "collision"),
        (at(10.0, 5.9, down="tipped over"), "tipped over"),
        (at(10.0, 5.9, touches=True, down="stuck wheel"), "stuck wheel"),
    ],
)
def test_a_failure_at_the_goal_is_a_failure(situation: Situation, failure: str) -> None:
    episode = begun(FollowCorridorTask())
    episode.begin(at(10.0, 5.0))
    judged = episode.judge(situation)
    assert (judged.success, judged.failure, judged.over) == (False, failure, True)
    assert judged.reward == pytest.approx(FAILURE + 0.9)


@pytest.mark.parametrize("form", range(len(FORMS)))
def test_starts_before_a_door_look_at_it_from_the_room(form: int) -> None:
    ground = TaskGround(two_rooms(form), ROUTE, SHAPE)
    for seed in range(20):
        start = CrossDoorTask().episode(ground, np.random.default_rng(seed)).start
        assert -FAR <= start.x <= -NEAR
        assert abs(start.y) <= 0.4
        assert abs(start.heading) <= math.radians(25) + 1e-9


def test_through_a_door_means_the_tail_is_out_of_the_wall() -> None:
    episode = begun(CrossDoorTask())
    thick = two_rooms(0).wall_named("front").thickness
    assert episode.begin(at(-1.5, 0.0)) == pytest.approx(1.5 + thick + SHAPE.behind)
    assert not episode.judge(at(thick + SHAPE.behind - 0.01, 0.0)).success
    assert episode.judge(at(thick + SHAPE.behind + 0.01, 0.0)).success


@pytest.mark.parametrize("side", [-1, 1])
def test_who_came_round_the_wall_is_not_through_the_door(side: int) -> None:
    """And neither is a mission that is to end behind it done: both ask the same."""
    doorway, episode = DoorwayPlace.of(GROUND.plan, GROUND.plan.door[0]), begun(CrossDoorTask())
    episode.begin(at(-1.5, 0.0))
    behind = doorway.deep + SHAPE.behind + 0.5
    goal = BehindDoor(doorway.middle, doorway, doorway.deep + SHAPE.behind)
    for aside, through in ((BESIDE + 0.01, False), (6.0, False), (BESIDE - 0.01, True)):
        there = at(behind, side * aside)
        assert (episode.judge(there).success, goal.reached(there)) == (through, through)


def test_the_way_through_a_door_leads_to_its_middle_first() -> None:
    episode = begun(CrossDoorTask())
    episode.begin(at(-1.5, 0.8))
    assert episode.judge(at(-1.5, 0.0)).reward == pytest.approx(math.hypot(1.5, 0.8) - 1.5)


def test_a_goal_lies_ahead_on_the_path() -> None:
    goals = set()
    for seed in range(60):
        episode = begun(ReachPlaceTask(), seed)
        assert episode.goal is not None
        assert min(NEAREST, episode.goal) - 0.2 <= episode.goal - episode.start.x <= FARTHEST
        goals.add(episode.goal)
    assert goals == set(range(4, 11))


def test_to_leave_the_path_or_pass_the_goal_costs_what_it_is_worth_to_come_back() -> None:
    episode = begun(ReachPlaceTask())
    goal = episode.goal
    assert goal is not None
    episode.begin(at(episode.start.x, 0.0))
    for x in np.arange(episode.start.x, goal - 1.5, 1.0):
        episode.judge(at(float(x), 0.0))
    episode.judge(at(goal - 1.5, 0.0))
    assert episode.judge(at(goal - 1.5, 0.7)).reward == pytest.approx(-0.7)
    assert episode.judge(at(goal - 1.5, 0.0)).reward == pytest.approx(0.7)
    assert episode.judge(at(goal - 1.0, 0.0)).remaining == pytest.approx(1.0)
    assert episode.judge(at(goal - 0.7, 0.0)).success


def test_what_speaks_for_the_truth_is_the_mass_around_it_that_is_not_lost() -> None:
    belief = belief_from(np.arange(1.0, 12.0), lost=0.25)
    here = [k for k in range(11) if abs(k - 4.2) <= HERE]
    assert here == [3, 4, 5]
    assert belief_in(belief, PLACES, Pose(4.2, 0.0, 0.0)) == pytest.approx(0.75 * (4 + 5 + 6) / 66)


def test_who_is_to_recover_was_led_some_way_and_is_set_down_on_the_path_or_off_it_looking_anywhere() -> None:
    episodes = [begun(RecoverTask(), seed) for seed in range(300)]
    led = np.array([one.led for one in episodes], float)
    assert np.ptp(led, axis=1) == pytest.approx(LED)
    assert (led.min() >= 0.0, led.max() <= GROUND.way.length) == (True, True)
    aside, turned = np.abs([(one.start.y, one.start.heading) for one in episodes]).T
    anywhere = turned > TURNED
    assert 0.38 < anywhere.mean() < 0.56  # half are off the path, of whom one in 18 looks along it by chance
    assert (aside[~anywhere] <= ASIDE).mean() > 0.9
    assert aside[anywhere].max() == pytest.approx(OFF, abs=0.05)


def test_a_sure_belief_in_the_wrong_place_is_worth_nothing() -> None:
    episode = begun(RecoverTask())
    wrong, right = belief_from(np.eye(11)[9]), belief_from(np.eye(11)[3], lost=0.05)
    assert episode.begin(at(3.0, 0.0, belief=wrong)) == 1.0
    assert not episode.judge(at(3.2, 0.0, belief=wrong)).over
    judged = episode.judge(at(3.2, 0.0, belief=right))
    assert judged.success
    assert judged.reward == pytest.approx(0.95 + SUCCESS)
    assert judged.remaining <= 1 - SURE
