"""Learners on the environments: Stable-Baselines3 trains, torchrl's check of specs passes (extra ``rl``)."""

import csv
import json
import sys
import warnings
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from typer.testing import CliRunner

import refseq_bench.sim.envs
from refseq_bench.sim.envs.learning.evaluation import PLAYERS, EvaluationEpisode, margin, random_player, returns
from refseq_bench.sim.envs.learning.files import curve, table
from refseq_bench.sim.envs.learning.ppo import Practice, TrainedPolicy, learn
from refseq_bench.sim.envs.learning.sectors import Sectors
from refseq_bench.sim.envs.learning.training_config import TrainingConfig
from refseq_bench.sim.envs.train import app, main
from refseq_bench.sim.errors import SimError

WITHOUT_MAP = tuple(name for name in refseq_bench.sim.envs.IDS if "Corridor" in name or "Door" in name)
WITH_MAP = "refseq/ReachPlace-v0"
LESSON = ["CrossDoorTwist", "--world", "rooms:0", "--held-out", "rooms:1", "--robots", "2", "--episodes", "2"]


def needs(package: str) -> None:
    pytest.importorskip(package, reason=f"{package} is of the extra rl, which is not installed")


# --- with the extra ---


@pytest.mark.parametrize("name", [*WITHOUT_MAP, WITH_MAP])
def test_stable_baselines_has_nothing_to_say_against_it(name: str) -> None:
    needs("stable_baselines3")
    from stable_baselines3.common.env_checker import check_env

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gym.make(name))
        check_env(Sectors(gym.make(name)))


@pytest.mark.parametrize("name", [*WITHOUT_MAP, WITH_MAP])
def test_torchrl_finds_its_specs_kept(name: str) -> None:
    needs("torchrl")
    from torchrl.envs import GymWrapper
    from torchrl.envs.utils import check_env_specs

    env = GymWrapper(gym.make(name))
    check_env_specs(env, seed=1)
    env.close()


def test_a_short_training_runs_and_leaves_its_files(tmp_path: Path) -> None:
    needs("stable_baselines3")
    ran = CliRunner().invoke(app, [*LESSON, "--steps", "256", "-o", str(tmp_path / "new" / "ppo")])
    assert ran.exit_code == 0, ran.output
    folder = tmp_path / "new" / "ppo"
    assert {path.name for path in folder.iterdir()} == {"curve.csv", "curve.png", "policy.zip", "result.json"}
    result = json.loads((folder / "result.json").read_text())
    assert result["id"] == "refseq/CrossDoorTwist-v0"
    assert result["steps"] == 256
    assert (result["learnt_in"], result["tried_in"]) == (["rooms:0"], ["rooms:1"])
    episodes = [EvaluationEpisode(**episode) for episode in result["evaluation"]]
    assert [episode.player for episode in episodes] == [player for player in PLAYERS for _ in range(2)]
    assert {(episode.world, episode.seed) for episode in episodes} == {("rooms:1", 1_000_000), ("rooms:1", 1_000_001)}
    played = returns(tuple(episodes))
    assert result["margin_over"]["random"]["mean"] == pytest.approx((played["learnt"] - played["random"]).mean())
    rows = list(csv.DictReader((folder / "curve.csv").open()))
    assert len(rows) == result["episodes"]
    assert (folder / "curve.png").read_bytes().startswith(b"\x89PNG")
    assert "margin over random: " in ran.output


def test_it_ends_by_the_clock(tmp_path: Path) -> None:
    """A second is over before the workers have started: it learns nothing, and writes what it has."""
    needs("stable_baselines3")
    learnt = learn(TrainingConfig("CrossDoorTwist", seconds=1.0, robots=1), tmp_path / "policy.zip")
    assert learnt.steps == 1
    assert learnt.seconds >= 1.0
    assert (tmp_path / "policy.zip").is_file()


def test_worlds_that_there_are_not_are_told_before_anything_is_learnt(tmp_path: Path) -> None:
    needs("stable_baselines3")
    for wrong in (
        TrainingConfig("CrossDoor", worlds=("rooms:99",)),
        TrainingConfig("CrossDoor", held_out=("rooms:99",)),
    ):
        with pytest.raises(SimError, match="rooms:99"):
            learn(wrong, tmp_path / "policy.zip")
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_a_lesson_that_ends_by_its_steps_gives_the_same_policy_again(tmp_path: Path) -> None:
    needs("stable_baselines3")
    from stable_baselines3 import PPO

    lessons = [
        TrainingConfig("CrossDoorTwist", steps=512, robots=2, seed=seed, worlds=("rooms:0",)) for seed in (3, 3, 4)
    ]
    weights, practised = [], []
    for number, config in enumerate(lessons):
        path = tmp_path / f"{number}.zip"
        practised.append([(one.steps, one.returned) for one in learn(config, path).practice])
        weights.append(PPO.load(path, device="cpu").policy.state_dict())
    first, again, other = weights
    assert all((first[key] == again[key]).all() for key in first)
    assert not all((first[key] == other[key]).all() for key in first)
    assert practised[0] == practised[1]


@pytest.mark.slow
def test_ppo_learns_to_follow_corridors_better_than_chance(tmp_path: Path) -> None:
    """By steps and not by the clock, so that a busy machine learns as much."""
    needs("stable_baselines3")
    asked = ["FollowCorridorTwist", "--steps", "15000", "--seconds", "7200", "--robots", "2", "--seed", "1"]
    ran = CliRunner().invoke(app, [*asked, "--episodes", "6", "--at-least", "20", "-o", str(tmp_path)])
    assert ran.exit_code == 0, ran.output


# --- without it ---


def test_the_extra_is_named_where_it_is_missing(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.setitem(sys.modules, "stable_baselines3", None)
    monkeypatch.setattr(sys, "argv", ["train", *LESSON, "-o", str(tmp_path / "ppo")])
    with pytest.raises(SystemExit) as left:
        main()
    assert left.value.code == 2
    said = capsys.readouterr().err
    assert said == "error: Stable-Baselines3 is not installed; valid is the extra rl: pip install '.[rl]' in a clone\n"
    assert not list(tmp_path.iterdir())


def test_what_it_is_asked_wrongly_is_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.setattr(sys, "argv", ["train", "Fly", "-o", str(tmp_path / "ppo")])
    with pytest.raises(SystemExit) as left:
        main()
    assert left.value.code == 2
    assert capsys.readouterr().err.startswith("error: unknown task 'Fly': valid are FollowCorridor, ")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("at_least", "code"), [("4.9", 0), ("5.1", 1)])
def test_a_margin_below_what_is_asked_ends_with_one(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, at_least: str, code: int
) -> None:
    made = {"learnt": 6.0, "random": 1.0, "ahead": 8.0}
    episodes = tuple(
        EvaluationEpisode(player, "rooms:1", i, made[player] + i, 9, False) for player in PLAYERS for i in range(2)
    )
    monkeypatch.setattr("refseq_bench.sim.envs.train.stable_baselines", lambda: None)
    monkeypatch.setattr("refseq_bench.sim.envs.train.learn", lambda config, policy: TrainedPolicy((), 1, 1.0))
    monkeypatch.setattr("refseq_bench.sim.envs.train.evaluate", lambda config, policy: episodes)
    ran = CliRunner().invoke(app, [*LESSON, "--at-least", at_least, "-o", str(tmp_path)])
    assert ran.exit_code == code
    assert "margin over random: 5.00, 95 % from 5.00 to 5.00" in ran.output
    assert {path.name for path in tmp_path.iterdir()} == {"curve.csv", "curve.png", "result.json"}


def test_the_margin_is_that_of_pairs() -> None:
    """What makes episodes differ from each other is the same for both, and does not blur it."""
    rng = np.random.default_rng(5)
    lengths, gains = rng.uniform(40, 120, 30), rng.normal(7.0, 1.0, 30)
    found = margin(lengths + gains, lengths)
    assert found.mean == pytest.approx(gains.mean())
    assert found.low < 7.0 < found.high
    error = gains.std(ddof=1) / np.sqrt(30)
    assert (found.high - found.low) / 2 == pytest.approx(1.96 * error, rel=0.15)


def test_the_curve_holds_every_episode() -> None:
    practice = tuple(Practice(100 * i, 1.5 * i, float(i), 50) for i in range(1, 31))
    episodes = tuple(EvaluationEpisode(player, "hallway", i, i - 3.0, 9, False) for player in PLAYERS for i in range(4))
    learnt = TrainedPolicy(practice, 3000, 45.0)
    rows = list(csv.reader(table(learnt).splitlines()))
    assert rows[0] == ["steps", "seconds", "return", "length"]
    assert [[float(cell) for cell in row] for row in rows[1:]] == [[100 * i, 1.5 * i, i, 50] for i in range(1, 31)]
    steps, clock = curve(TrainingConfig("CrossDoor"), learnt, episodes).axes
    for axes, last in ((steps, 3000), (clock, 45.0)):
        dots, means = axes.lines[1:3]
        assert np.asarray(dots.get_xdata())[-1] == last
        assert len(np.asarray(dots.get_ydata())) == 30
        assert np.asarray(means.get_ydata())[0] == pytest.approx(5.5)  # of 1 to 10


@pytest.mark.parametrize(("world", "where"), [("rooms:0", "same worlds, other episodes"), ("rooms:1", "other worlds")])
def test_the_legend_tells_where_the_players_played(world: str, where: str) -> None:
    episodes = tuple(EvaluationEpisode(player, world, i, i - 3.0, 9, False) for player in PLAYERS for i in range(4))
    held_out = () if world == "rooms:0" else (world,)
    config = TrainingConfig("CrossDoor", worlds=("rooms:0",), held_out=held_out)
    (legend,) = curve(config, TrainedPolicy((), 3000, 45.0), episodes).legends
    said = [text.get_text() for text in legend.get_texts()]
    assert [text for text in said if f", {where}: " in text] == [text for text in said if " world" in text]
    assert len([text for text in said if " world" in text]) == 3


class NoEpisode(gym.Env[int, np.ndarray]):
    """Has actions, and numbers to draw an episode from."""

    action_space = gym.spaces.Box(-1, 1, (2,), np.float64)


def test_random_actions_are_not_the_numbers_that_draw_the_episode() -> None:
    firsts = []
    for seed in (1_000_000, 1_000_000, 1_000_001):
        env = NoEpisode()
        env.reset(seed=seed)
        act = random_player(env, seed)
        firsts.append([act(None, {}).tolist() for _ in range(4)])
        assert firsts[-1] != env.np_random.uniform(-1, 1, (4, 2)).tolist()
    assert firsts[0] == firsts[1] != firsts[2]
