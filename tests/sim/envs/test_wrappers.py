"""Gymnasium's own wrappers and vectors around the environments."""

from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.wrappers import FlattenObservation, RecordEpisodeStatistics, RecordVideo

import refseq_bench.sim.envs  # noqa: F401 - registers the ids
from refseq_bench.sim.rendering.drivers import gl_backend, vulkan_device

NAME = "refseq/CrossDoorTwist-v0"
BACK = np.array([-1.0, 0.0], np.float32)


def played(env: gym.Env[Any, Any], seed: int = 2) -> tuple[float, int, dict[str, Any]]:
    """Go backward until the episode ends; its return, its length, the last info."""
    env.reset(seed=seed)
    total, steps, over = 0.0, 0, False
    while not over:
        _, reward, ended, truncated, info = env.step(BACK)
        total, steps, over = total + float(reward), steps + 1, ended or truncated
    return total, steps, info


def test_an_id_can_be_made_without_importing_anything_first() -> None:
    env = gym.make(f"refseq_bench.sim.envs:{NAME}")
    assert env.spec is not None
    assert env.spec.id == NAME
    env.close()


def test_episode_statistics_count_what_was_rewarded() -> None:
    env = RecordEpisodeStatistics(gym.make(NAME))
    total, steps, info = played(env)
    assert info["episode"]["r"] == pytest.approx(total)
    assert info["episode"]["l"] == steps
    assert info["collision"]


def test_observations_can_be_made_flat() -> None:
    env = FlattenObservation(gym.make(NAME))
    seen, _ = env.reset(seed=0)
    assert seen.shape == (361 + 5 + 24 + 3,)
    assert seen.dtype == np.float32


def test_a_vector_begins_the_next_episode_by_itself() -> None:
    envs = gym.make_vec(NAME, num_envs=2, vectorization_mode="sync", max_episode_steps=3)
    envs.reset(seed=1)
    cut = [envs.step(np.zeros((2, 2), np.float32))[3].tolist() for _ in range(7)]
    assert cut == [[False] * 2, [False] * 2, [True] * 2, [False] * 2, [False] * 2, [False] * 2, [True] * 2]
    envs.close()


@pytest.mark.skipif(gl_backend() is None, reason="no OpenGL")
def test_every_frame_of_an_episode_can_be_kept() -> None:
    env = gym.make(NAME, renderer="classic", render_mode="rgb_array_list", max_episode_steps=4)
    _, steps, _ = played(env)
    frames = env.render()
    assert steps == 4
    assert len(frames) == 5
    assert not np.array_equal(frames[0], frames[-1])
    env.close()


@pytest.mark.skipif(gl_backend() is None, reason="no OpenGL")
def test_a_video_is_written(tmp_path: Path) -> None:
    pytest.importorskip("moviepy", reason="RecordVideo needs moviepy")
    env = RecordVideo(
        gym.make(NAME, renderer="classic", render_mode="rgb_array", max_episode_steps=3), str(tmp_path / "videos")
    )
    played(env)
    env.close()
    assert [path.suffix for path in (tmp_path / "videos").iterdir()] == [".mp4"]


@pytest.mark.quick_cases("CrossDoor")
@pytest.mark.skipif(vulkan_device() is None, reason="no Vulkan device")
@pytest.mark.parametrize("task", ["FollowCorridor", "CrossDoor", "ReachPlace"])
def test_there_is_light_where_pictures_are_taken(task: str) -> None:
    """By the photometric renderer, which makes black of what no lamp and no window lights."""
    env = gym.make(f"refseq/{task}-v0", render_mode="rgb_array")
    env.reset(seed=3)
    picture = np.asarray(env.render(), np.float64)
    env.close()
    assert 50 < picture.mean() < 220
    assert picture.std() > 15
