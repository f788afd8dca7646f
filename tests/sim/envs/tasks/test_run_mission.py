"""Missions as a task, without any simulation: progress, wrong switches and ends against the truth, what is drawn."""

import math
from dataclasses import replace

import numpy as np
import pytest

from refseq.belief import belief_from
from refseq.map.paths.annotations import DoorSide, PathDoor
from refseq.missions.language import parse_mission
from refseq.missions.plan import compiled
from refseq.planar import Pose
from refseq_bench.robots.robot import Shape
from refseq_bench.sim.envs.tasks.by_name import made_task
from refseq_bench.sim.envs.tasks.cross_door import OPEN
from refseq_bench.sim.envs.tasks.mission_draw import NEAREST, draw_mission
from refseq_bench.sim.envs.tasks.mission_goal import ARRIVED, WITHIN
from refseq_bench.sim.envs.tasks.run_mission import WRONG, RunMissionTask
from refseq_bench.sim.envs.tasks.task import FAILURE, SUCCESS, AskedOrder, Episode, Situation, TaskGround
from refseq_bench.sim.envs.worlds.rooms import ROOMS, two_rooms
from refseq_bench.sim.errors import SimError
from refseq_bench.worlds.plans.load import parse_plan
from tests.refseq.missions.on_a_line import way

SHAPE = Shape(ahead=0.8, behind=0.3, half_width=0.36, height=1.4)
ASIDE = -1.2
"""The path leads along the wall of the two rooms, so far before it; their open door is on its right after 10 m."""
PLACES = np.array([(ASIDE, k - 10.0) for k in range(21)])
DOORS = [PathDoor(5.0, DoorSide.LEFT, 0.9, passable=False), PathDoor(10.0, DoorSide.RIGHT, 0.9, passable=True)]
WAY = way(20.0, doors=DOORS)
GROUND = TaskGround(two_rooms(0), PLACES[[0, -1]], SHAPE, PLACES, WAY)
HERE = belief_from(np.eye(21)[3])
LOST = belief_from(np.ones(21), lost=0.9)
CROSS = "[LD_LDMC]"


def at(along: float, behaviour: str = "MN:1000", *, turned: float = 0.0, x: float = ASIDE, **more: object) -> Situation:
    pose = Pose(x, along - 10.0, math.pi / 2 + math.radians(turned))
    return Situation(pose, behaviour=behaviour, **{"belief": HERE} | more)  # type: ignore[arg-type]


def begun(mission: str, along: float = 0.0, behaviour: str = "MN:1000") -> Episode:
    """An episode in which the robot already does something, so far along the way."""
    episode = RunMissionTask(mission).episode(GROUND, np.random.default_rng(0))
    episode.begin(at(0.0, ""))
    for where in np.arange(0.5, along + 0.01, 0.5):
        episode.judge(at(float(where)))
    episode.judge(at(along, behaviour))
    return episode


def test_progress_is_the_way_to_the_last_landmark_and_through_its_door() -> None:
    episode = RunMissionTask(CROSS).episode(GROUND, np.random.default_rng(0))
    to_go = episode.begin(at(0.0, ""))
    deep = two_rooms(0).wall_named("front").thickness
    assert to_go == pytest.approx(8.8 + math.hypot(1.2, 1.2) + deep + SHAPE.behind)
    assert episode.judge(at(1.5)).reward == pytest.approx(1.5)
    assert episode.judge(at(1.0)).reward == pytest.approx(-0.5)


def test_who_comes_near_the_lane_back_has_come_no_further_than_it_went() -> None:
    """After 10 m the path comes back 1 m beside itself."""
    hairpin = np.concatenate([PLACES[:11], PLACES[10::-1][:10] - (1.0, 0.0)])
    ground = replace(GROUND, route=hairpin, places=hairpin)
    episode = RunMissionTask("[LI19]").episode(ground, np.random.default_rng(0))
    assert episode.begin(at(0.0, "")) == pytest.approx(19.0)
    for along in (1.5, 3.0):
        episode.judge(at(along))
    episode.judge(at(3.5, x=ASIDE - 0.6))
    rewards = [episode.judge(at(along, x=ASIDE - 0.6)).reward for along in (4.0, 4.5, 5.0)]
    assert rewards == pytest.approx([0.5, 0.5, 0.5])


def test_through_the_right_door_the_mission_is_done() -> None:
    episode = begun(CROSS, 8.8)
    for along, x in ((8.8, ASIDE), (9.4, -0.6), (10.0, 0.0)):
        assert not episode.judge(at(along, "MC:right", x=x)).over
    judged = episode.judge(at(10.0, "MC:right", x=0.6))
    assert judged.success
    assert judged.reward > SUCCESS
    assert episode.told == {"mission": CROSS, "wrong_switches": 0}


@pytest.mark.parametrize(
    ("behaviour", "along", "wrong"),
    [
        ("MC:right", 8.8, False),
        ("MC:right", 8.8 - WITHIN + 0.05, False),
        ("MC:right", 8.8 - WITHIN - 0.05, True),
        ("MC:left", 8.8, True),
        ("MT:90", 8.8, True),
        ("stop", 3.0, True),
    ],
)
def test_a_switch_is_wrong_where_the_plan_has_no_such_behaviour(behaviour: str, along: float, wrong: bool) -> None:
    episode = begun(CROSS, along)
    before = episode.told["wrong_switches"]
    assert before == 0
    judged = episode.judge(at(along, behaviour))
    assert judged.reward == pytest.approx(-WRONG if wrong else 0.0)
    assert episode.told["wrong_switches"] == int(wrong)
    assert episode.judge(at(along, behaviour)).reward == pytest.approx(0.0)  # to go on with it is no switch


def test_twists_are_no_behaviours_and_so_none_is_a_wrong_switch() -> None:
    episode = RunMissionTask(CROSS).episode(GROUND, np.random.default_rng(0))
    episode.begin(at(0.0, ""))
    assert [episode.judge(at(along, "")).reward for along in (0.5, 0.5, 1.0)] == pytest.approx([0.5, 0.0, 0.5])
    assert episode.told["wrong_switches"] == 0


def test_who_is_lost_may_stand_and_who_has_not_begun_stands_anyway() -> None:
    episode = RunMissionTask(CROSS).episode(GROUND, np.random.default_rng(0))
    episode.begin(at(0.0, ""))
    assert episode.judge(at(0.0, "stop")).reward == 0.0
    episode = begun(CROSS, 3.0)
    episode.judge(at(3.0, belief=LOST))
    assert episode.judge(at(3.0, "stop")).reward == pytest.approx(0.0)


def test_a_mission_that_ends_at_a_door_ends_when_the_robot_stands_there() -> None:
    episode = begun("[LD]", 5.0 - ARRIVED + 0.1)
    assert not episode.judge(at(5.0 - ARRIVED + 0.1)).over
    assert not begun("[LD]", 5.0 - ARRIVED - 0.1).judge(at(5.0 - ARRIVED - 0.1, "stop", stands=True)).over
    assert episode.judge(at(5.0 - ARRIVED + 0.1, "stop", stands=True)).success
    assert episode.told["wrong_switches"] == 0


@pytest.mark.parametrize(("turn", "faced"), [("MT90", 90), ("MT180", 180), ("MT270", -90)])
def test_a_turn_is_done_when_the_robot_stands_turned(turn: str, faced: float) -> None:
    episode = begun(f"[LI7{turn}]", 7.0, f"MT:{turn[2:]}")
    assert not episode.judge(at(7.0, f"MT:{turn[2:]}", turned=faced)).over
    assert not episode.judge(at(7.0, f"MT:{turn[2:]}", turned=faced / 2, stands=True)).over
    assert not episode.judge(at(7.0 - WITHIN - 0.1, f"MT:{turn[2:]}", turned=faced, stands=True)).over
    assert episode.judge(at(7.0, f"MT:{turn[2:]}", turned=faced, stands=True)).success


def test_a_collision_is_a_failure_as_in_all_tasks() -> None:
    judged = begun(CROSS, 3.0).judge(at(3.0, touches=True))
    assert (judged.success, judged.failure, judged.reward) == (False, "collision", FAILURE)


def test_what_is_asked_leaves_out_landmarks_that_are_only_passed() -> None:
    asked = begun(CROSS).asked
    assert asked == (AskedOrder(0.0, "MN"), AskedOrder(8.8, "MC:right"))
    assert begun("[LD_LD]").asked == (AskedOrder(0.0, "MN"), AskedOrder(10.0, "stop"))


# --- what is drawn ---


def test_every_mission_that_is_drawn_can_be_read_and_compiled_and_all_kinds_are() -> None:
    rng = np.random.default_rng(1)
    drawn = [str(draw_mission(WAY, [1], rng)) for _ in range(300)]
    plans = [compiled(parse_mission(text), WAY) for text in drawn]
    assert min(plan.goal for plan in plans) >= NEAREST
    ends = {text.rpartition("_")[2].rstrip("]").lstrip("[") for text in drawn}
    assert {"LD", "LDMC", "LDMT90", "LDMT180", "LDMT270"} <= ends
    assert {end.partition("M")[0] for end in ends} == {"LD", *(f"LI{k}" for k in range(4, 21))}
    crossings = [text for text in drawn if text.endswith("MC]")]
    assert set(crossings) == {CROSS}
    assert 30 < len(crossings) < 100  # a fifth of 300


def test_doors_that_are_shut_are_never_crossed() -> None:
    rng = np.random.default_rng(1)
    assert not any(str(draw_mission(WAY, [], rng)).endswith("MC]") for _ in range(200))


def test_the_same_seed_draws_the_same_mission_and_start() -> None:
    one, again, other = (RunMissionTask().episode(GROUND, np.random.default_rng(seed)) for seed in (5, 5, 6))
    assert (one.start, one.told) == (again.start, again.told)
    assert (one.start, one.told) != (other.start, other.told)


# --- what is asked wrongly ---


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({"mission": "[LX]"}, r"mission '\[LX\]', column 2: 'LX\]'; valid is a landmark: LD, LI, LO, LA"),
        ({"mission": 7}, r"mission 7 is not valid; valid is a string such as '\[LD_LDMC\]'"),
        ({"mission": "[LD_LD_LD]"}, r"mission \[LD_LD_LD\], step 3: no door behind 10.0 m; the way has 2 doors"),
        ({"mission": "[LDMC]"}, r"LDMC: door on the left, 5.0 m: no door there is open in world 'rooms-0'"),
        ({"mission": "[LA1]"}, "nobody has said where LA1 is"),
        ({"landmarks": {"LA1": 3.0}}, "landmarks are for a mission of your own"),
        (
            {"mission": "[LA3]", "landmarks": ["LA3"]},
            r"landmarks \['LA3'\] is not valid; valid is a table such as \{'LA3': 'end'\}",
        ),
        ({"mission": "[LA3]", "landmarks": "end"}, "landmarks 'end' is not valid; valid is a table"),
        ({"mission": "[LA3]", "landmarks": {3: "end"}}, "landmarks: 3 at 'end' is not valid; valid is a name"),
        ({"mission": "[LA3]", "landmarks": {"LA3": None}}, "landmarks: 'LA3' at None is not valid; valid is a name"),
        ({"rout": "round"}, "unknown keyword 'rout' of RunMissionTask: valid are mission, landmarks"),
    ],
)
def test_it_is_told_in_one_line(asked: dict[str, object], message: str) -> None:
    with pytest.raises(SimError, match=message) as told:
        made_task("run-mission", asked).check(GROUND)
    assert "\n" not in str(told.value)


def test_a_door_that_is_ajar_is_none_to_cross() -> None:
    ajar = parse_plan(ROOMS.format(form=0, angle=OPEN - 1, hinge="start"), "rooms:0")
    ground = replace(GROUND, plan=ajar)
    with pytest.raises(SimError, match=r"door on the right, 10\.0 m: no door there is open in world 'rooms-0'"):
        RunMissionTask(CROSS).check(ground)
    drawn = [RunMissionTask().episode(ground, np.random.default_rng(seed)).told["mission"] for seed in range(40)]
    assert not [mission for mission in drawn if "MC" in mission]


def test_behaviours_of_a_mission_are_actions_where_it_asks_for_them() -> None:
    assert "MW:right,1" not in RunMissionTask(CROSS).behaviours
    task = RunMissionTask("[LD_LA1MW]", {"LA1": 7.0})
    assert "MW:right,1" in task.behaviours
    asked = task.episode(GROUND, np.random.default_rng(0)).asked
    assert asked[1:] == (AskedOrder(7.0, "MW:right,1"), AskedOrder(20.0, "stop"))
