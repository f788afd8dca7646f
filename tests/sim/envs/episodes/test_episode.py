"""Episodes of the environments against the truth: what is rewarded, how they end, what is believed and said."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.wrappers import RecordEpisodeStatistics

import refseq_bench.sim.envs  # noqa: F401 - registers the ids
from refseq.map.localiser import Localiser
from refseq.view import View
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.envs.episodes.observations import by_place
from refseq_bench.sim.envs.robot_env import RobotEnv
from refseq_bench.sim.envs.tasks.recover import SURE, belief_in
from refseq_bench.sim.envs.tasks.task import FAILURE, SUCCESS
from refseq_bench.sim.envs.worlds.rooms import ROOMS
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.rendering.drivers import gl_backend
from tests.sim.envs.players import AlongPath, Corridor, at_random, play, through_the_door

STRAIGHT = "corridor:3"
SHORT = "corridor:10"
"""A corridor with a bend that is soon done."""


def made(name: str, **made_with: Any) -> RobotEnv:
    env = gym.make(f"refseq/{name}-v0", **made_with).unwrapped
    assert isinstance(env, RobotEnv)
    return env


# --- rewards and ends ---


def test_the_reward_is_the_progress_along_the_corridor() -> None:
    """The corridor's first leg runs along x: progress is x, however the robot swerves."""
    env = made("FollowCorridorTwist", world=STRAIGHT)
    _, info = env.reset(seed=1)
    start, total = info["pose"][0], 0.0
    for step in range(40):
        _, reward, ended, _, info = env.step(np.array([0.8 if step < 30 else -0.5, 0.3 * math.sin(step)], np.float32))
        total += reward
        assert not ended
        assert total == pytest.approx(info["pose"][0] - start, abs=1e-9)
    assert info["pose"][0] - start > 1.0


def test_the_odometer_tells_of_a_step_what_the_robot_went_seen_from_where_it_began() -> None:
    env = made("CrossDoorTwist")
    _, info = env.reset(seed=2)
    for _ in range(8):
        before = info["pose"]
        seen, *_, info = env.step(np.array([0.6, 0.8], np.float32))
    x, y, turn = info["pose"] - before
    cos, sin = math.cos(before[2]), math.sin(before[2])
    ahead, left = cos * x + sin * y, cos * y - sin * x
    assert min(ahead, turn) > 0.03
    assert seen["odometry"][2:] == pytest.approx([ahead, left, turn], abs=5e-3)


@pytest.mark.parametrize(("name", "ahead", "lasts"), [("CrossDoorTwist", (0.5, 0.0), 0.2), ("CrossDoor", 3, 1.0)])
def test_an_action_that_goes_on_lasts_as_long_as_the_page_says(name: str, ahead: Any, lasts: float) -> None:
    env = made(name)
    _, begun = env.reset(seed=2)
    for _ in range(2):
        *_, info = env.step(ahead)
    assert info["outcome"] == "running"
    assert info["time"] - begun["time"] == pytest.approx(2 * lasts)


def test_the_rewards_of_a_door_add_up_to_the_way_and_the_end() -> None:
    env = gym.make("refseq/CrossDoor-v0")
    _, info = env.reset(seed=0)
    to_go = info["distance_to_goal"]
    steps = play(env, through_the_door, 0)
    assert sum(step[0] for step in steps) == pytest.approx(to_go - steps[-1][3]["distance_to_goal"] + SUCCESS)


@pytest.mark.parametrize("robot", ["robuter", "segway_rmp"])
def test_backward_into_a_wall_is_a_collision(robot: str) -> None:
    """Nothing looks behind: the robot's own watch keeps it only from what is ahead."""
    env = made("CrossDoorTwist", robot=robot)
    env.reset(seed=2)
    for _ in range(60):
        _, reward, ended, truncated, info = env.step(np.array([-0.8, 0.0], np.float32))
        if ended:
            break
    assert (ended, truncated) == (True, False)
    assert (info["collision"], info["success"], info["failure"]) == (True, False, "collision")
    assert reward < FAILURE + 0.2
    assert info["pose"][0] < -2.5


@pytest.mark.quick_cases("robuter")
@pytest.mark.parametrize("robot", ["robuter", "segway_rmp"])
def test_forward_into_a_wall_it_is_stopped_and_says_so(robot: str) -> None:
    env = made("CrossDoorTwist", robot=robot)
    _, info = env.reset(seed=2)
    stopped = False
    for _ in range(80):
        off = math.remainder(math.pi - info["pose"][2], 2 * math.pi)  # to the wall in its back
        ahead = 0.5 if abs(off) < 0.1 else 0.0
        seen, _, ended, _, info = env.step(np.array([ahead, np.clip(2 * off, -1, 1)], np.float32))
        assert not ended
        stopped = stopped or bool(seen["stops"][0])
    assert stopped
    assert not info["collision"]
    assert seen["odometry"][0] == pytest.approx(0.0, abs=0.02)


def test_a_robot_that_is_pushed_over_has_failed() -> None:
    env = made("CrossDoorTwist", robot="segway_rmp")
    env.reset(seed=2)
    stage = env._run
    assert stage is not None
    stage.bench.data.xfrc_applied[stage.bench.model.body("segway_rmp/base").id, 3:] = (0.0, 500.0, 0.0)
    for _ in range(20):
        _, reward, ended, truncated, info = env.step(np.zeros(2, np.float32))
        if ended:
            break
    assert (ended, truncated, info["success"]) == (True, False, False)
    # Its body may come to lie on the floor before its electronics tell.
    assert info["failure"] in ("tipped over", "collision")
    assert abs(stage.bench.state.pitch) > math.radians(30)
    assert info["pose"][0] > -3.0  # not at the wall yet
    assert reward < 0


def test_broken_physics_ends_the_episode_and_no_missing_number_gets_out() -> None:
    env = made("CrossDoorTwist")
    env.reset(seed=2)
    stage = env._run
    assert stage is not None
    stage.bench.data.qvel[:] = np.nan
    seen, reward, ended, _, info = env.step(np.zeros(2, np.float32))
    assert ended
    assert info["failure"].startswith("physics: positions or velocities were no numbers")
    assert seen in env.observation_space
    assert all(np.isfinite(part).all() for part in (*seen.values(), info["pose"], reward))


def test_an_episode_is_cut_off_after_as_many_steps_as_were_asked_for() -> None:
    env = RecordEpisodeStatistics(gym.make("refseq/CrossDoorTwist-v0", max_episode_steps=7))
    env.reset(seed=0)
    flags = [env.step(np.zeros(2, np.float32))[2:] for _ in range(7)]
    assert [truncated for _, truncated, _ in flags] == [False] * 6 + [True]
    assert not any(ended for ended, _, _ in flags)
    assert flags[-1][2]["episode"]["l"] == 7


SCRIPTED: dict[str, tuple[Callable[[RobotEnv], Any], dict[str, Any]]] = {
    "FollowCorridor": (lambda env: Corridor(), {"world": SHORT}),
    "CrossDoor": (lambda env: through_the_door, {}),
    "ReachPlace": (AlongPath, {}),
    "Recover": (AlongPath, {}),
}


SEEDS = {"FollowCorridor": (0,), "CrossDoor": (1,), "ReachPlace": (3,), "Recover": (0,)}
"""Those whose episodes are soon over."""


@pytest.mark.quick_cases("CrossDoor")
@pytest.mark.parametrize("task", SCRIPTED)
def test_who_knows_what_to_do_succeeds_and_who_does_not_mostly_fails(task: str) -> None:
    player, made_with = SCRIPTED[task]
    env = gym.make(f"refseq/{task}-v0", **made_with)
    seeds = SEEDS[task]
    good = [play(env, player(env.unwrapped), seed) for seed in seeds]
    longest = max(map(len, good))
    assert all(steps[-1][3]["success"] and steps[-1][1] for steps in good)
    assert all(sum(step[0] for step in steps) > SUCCESS for steps in good)
    env = gym.make(f"refseq/{task}-v0", max_episode_steps=min(longest, 20), **made_with)
    lucky = [play(env, at_random(env, seed), seed)[-1][3]["success"] for seed in seeds]
    assert sum(lucky) <= len(lucky) / 2


# --- what is believed ---


def test_the_belief_is_that_of_a_localiser_that_is_given_the_same_views(monkeypatch: pytest.MonkeyPatch) -> None:
    env, views = made("ReachPlace", world=STRAIGHT, belief="places"), []
    update = Localiser.update

    def noted(localiser: Localiser, view: View) -> Any:
        views.append(view)
        return update(localiser, view)

    with monkeypatch.context() as watched:
        watched.setattr(Localiser, "update", noted)
        env.reset(seed=3)
        for _ in range(8):
            seen, *_ = env.step(0)
    assert len(views) > 3
    assert all(view.truth is None for view in views)
    assert views[2].distance == pytest.approx(0.85, abs=0.05)
    assert env._map is not None
    alone = Localiser(env._map)
    beliefs = [alone.update(view) for view in views]
    np.testing.assert_array_equal(seen["belief"], by_place(beliefs[-1]))
    assert seen["belief"].sum() == pytest.approx(1.0, abs=1e-5)
    assert env.places is not None
    assert len(seen["belief"]) == len(env.places) + 1


def test_what_a_mission_asks_comes_nearer_between_two_views_by_what_the_odometer_went() -> None:
    env, counted = made("MissionTwist", world=STRAIGHT, mission="[LD]"), 0
    seen, _ = env.reset(seed=3)
    for _ in range(12):
        before, believed = seen["asked"][0, 0], env.belief
        seen, *_ = env.step((1.0, 0.0))
        if env.belief is believed:
            assert before - seen["asked"][0, 0] == pytest.approx(math.hypot(*env.motion[:2]), abs=1e-3)
            counted += env.motion[0] > 0.05
    assert counted > 3


def test_a_robot_that_is_carried_off_begins_with_a_wrong_belief() -> None:
    """Beliefs from the led drive hold for the old place: over some episodes next to nothing speaks for the new one."""
    env = made("Recover", world=STRAIGHT)
    missing = [env.reset(seed=seed)[1]["distance_to_goal"] for seed in range(4)]
    assert float(np.median(missing)) > 0.5


def test_recovered_means_right_and_sure() -> None:
    env = gym.make("refseq/Recover-v0", world=STRAIGHT)
    unwrapped = env.unwrapped
    assert isinstance(unwrapped, RobotEnv)
    last = play(env, AlongPath(unwrapped), 0)[-1][3]
    stage, places = unwrapped._run, unwrapped.places
    assert last["success"]
    assert stage is not None
    assert stage.following is not None
    assert places is not None
    credence = belief_in(stage.following.belief, places[:, :2], stage.bench.pose)
    assert credence >= SURE
    assert last["distance_to_goal"] == pytest.approx(1 - credence)
    assert last["place_error"] < 1.3


# --- pictures ---


@pytest.mark.skipif(gl_backend() is None, reason="no OpenGL")
def test_pictures_change_nothing_that_happens() -> None:
    plain = made("CrossDoorTwist")
    shown = made("CrossDoorTwist", renderer="classic", render_mode="rgb_array")
    for env in (plain, shown):
        env.reset(seed=6)
    for step in range(5):
        action = np.array([0.4, 0.1 * step], np.float32)
        picture = shown.render()
        assert picture is not None
        assert (picture.shape, picture.dtype) == ((480, 640, 3), np.uint8)
        assert picture.std() > 5
        one, other = plain.step(action), shown.step(action)
        assert all(np.array_equal(one[0][key], other[0][key]) for key in one[0])
        assert one[1] == other[1]


@pytest.mark.skipif(gl_backend() is None, reason="no OpenGL")
def test_the_robot_is_shown_in_the_light_that_its_cameras_see() -> None:
    shown = []
    for seeing in ({}, {"cameras": ["camera-1"], "pixels": 16}):
        env = made("CrossDoorTwist", world="rooms:0", render_mode="rgb_array", **seeing)
        env.reset(seed=3)
        shown.append(env.render())
        env.close()
    np.testing.assert_array_equal(*shown)


@pytest.mark.skipif(gl_backend() is None, reason="no OpenGL")
def test_cameras_give_images_of_their_own() -> None:
    env = made("CrossDoorTwist", renderer="classic", cameras=["camera-1", "camera-2"])
    seen, _ = env.reset(seed=6)
    again, *_ = env.step(np.array([0.5, 0.5], np.float32))
    for name in ("camera-1", "camera-2"):
        assert (seen[name].shape, seen[name].dtype) == ((480, 640), np.uint8)
        assert not np.shares_memory(seen[name], again[name])
        assert seen[name].std() > 1
    assert not np.array_equal(seen["camera-1"], seen["camera-2"])
    assert seen in env.observation_space


# --- mistakes ---


MISTAKES: dict[str, tuple[dict[str, Any], str]] = {
    "robot": ({"robot": "pioneer"}, "unknown robot 'pioneer': valid are robuter, "),
    "world": ({"world": "moon"}, "unknown world 'moon'; known are annex, "),
    "room": ({"world": "rooms:9"}, "world 'rooms:9' is unknown; valid are rooms:0 to rooms:5"),
    "worlds": ({"world": []}, "is not valid for this task: valid is one or more"),
    "route": ({"route": "home"}, "unknown route 'home' in world 'rooms:0': valid are forward"),
    "light": ({"light": "dim"}, "dim"),
    "actions": ({"actions": "thoughts"}, "unknown actions 'thoughts': valid are behaviours, twist"),
    "camera": ({"cameras": ["camera-9"]}, "unknown camera of robot 'robuter' 'camera-9': valid are camera-1, camera-2"),
    "belief": ({"belief": "faith"}, "belief 'faith' is unknown: valid are summary, places"),
    "renderer": ({"renderer": "none"}, "unknown renderer 'none': valid are baked, filament, classic"),
    "task": ({"task": "dance"}, "unknown task 'dance': valid are follow-corridor, "),
    "render mode": ({"render_mode": "ansi"}, "unknown render mode 'ansi': valid are human, rgb_array"),
}


@pytest.mark.parametrize(("made_with", "line"), MISTAKES.values(), ids=MISTAKES)
def test_a_mistake_is_told_in_one_line(made_with: dict[str, Any], line: str) -> None:
    with pytest.raises(SimError) as told:
        RobotEnv(**{"task": "cross-door", "world": ["rooms:0"], **made_with})
    assert line in str(told.value)
    assert "\n" not in str(told.value)


def test_a_map_is_of_one_world() -> None:
    with pytest.raises(SimError, match="valid is one world, as there is one map"):
        RobotEnv("reach-place", ["laboratory", "annex"])


def test_a_world_without_an_open_door_is_told() -> None:
    env = made("CrossDoor", world="annex")
    with pytest.raises(SimError, match="world 'annex' has no door that is open by 80 degrees or more"):
        env.reset(seed=0)


def test_a_world_without_room_is_told_and_its_bench_given_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A table stands where episodes begin; the world is a plan of somebody's own."""
    closed: list[Bench] = []
    monkeypatch.setattr(Bench, "close", lambda bench: closed.append(bench))
    table = '[[furniture]]\nname = "table"\nkind = "table"\nat = [-1.7, 0]\nwidth = 2.5\ndepth = 3\nheight = 0.7\n'
    plan = tmp_path / "full.toml"
    plan.write_text(ROOMS.format(form=0, angle=90, hinge="start") + table + 'material = "plaster"\n')
    env = made("CrossDoor", world=str(plan))
    with pytest.raises(SimError, match="world 'rooms-0' has no room for 'robuter' at any of 100 starts"):
        env.reset(seed=0)
    assert len(closed) == 1


def test_options_are_none() -> None:
    with pytest.raises(SimError, match="options 'pose' are unknown"):
        made("CrossDoor").reset(options={"pose": 1})


@pytest.mark.parametrize(
    ("name", "action"),
    [("CrossDoor", 7), ("CrossDoor", -1), ("CrossDoorTwist", [np.nan, 0.0]), ("CrossDoorTwist", 1.0)],
)
def test_an_action_that_is_none_is_told(name: str, action: Any) -> None:
    env = made(name)
    env.reset(seed=0)
    with pytest.raises(SimError, match="is not valid; valid are"):
        env.step(action)


def test_a_step_before_the_reset_is_told() -> None:
    env = made("CrossDoorTwist")
    with pytest.raises(SimError, match="call reset first"):
        env.step(np.zeros(2, np.float32))
