"""What a lesson leaves: ``curve.csv``, ``curve.png`` and ``result.json``."""

import csv
import io
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from refseq.files import replace_text, replacing_at
from sim.envs.learning.evaluation import PLAYERS, Trial, margin, returns
from sim.envs.learning.ppo import TrainedPolicy
from sim.envs.learning.training_config import TASKS, TrainingConfig

RUNNING = 10
"""The curve is the mean of so many episodes, one after the other."""
LEARNT, CHANCE, PLAIN = "#d55e00", "#8a8a8a", "#2a8fd4"


def result(lesson: TrainingConfig, learnt: TrainedPolicy, trials: tuple[Trial, ...]) -> dict[str, Any]:
    """The figures: what was learnt, how long it took, what each player made of the same episodes, the margins."""
    played = returns(trials)
    return {
        "id": TASKS[lesson.task],
        "robots": lesson.robots,
        "seed": lesson.seed,
        "steps": learnt.steps,
        "seconds": round(learnt.seconds, 1),
        "episodes": len(learnt.practice),
        "learnt_in": lesson.learnt_in,
        "tried_in": lesson.tried_in,
        "mean_return": {name: float(played[name].mean()) for name in PLAYERS},
        "goals": {name: sum(one.success for one in trials if one.player == name) for name in PLAYERS},
        "of": lesson.episodes,
        "margin_over": {name: asdict(margin(played["learnt"], played[name])) for name in PLAYERS[1:]},
        "trials": [asdict(one) for one in trials],
    }


def write(folder: Path, lesson: TrainingConfig, learnt: TrainedPolicy, trials: tuple[Trial, ...]) -> None:
    """Write the three files into ``folder``."""
    replace_text(folder / "curve.csv", table(learnt))
    with replacing_at(folder / "curve.png") as path:
        curve(lesson, learnt, trials).savefig(path, dpi=120)
    replace_text(folder / "result.json", json.dumps(result(lesson, learnt, trials), indent=2) + "\n")


def table(learnt: TrainedPolicy) -> str:
    """A line an episode that was learnt from: steps of all robots, seconds, return, its own steps."""
    text = io.StringIO()
    lines = csv.writer(text, lineterminator="\n")
    lines.writerow(["steps", "seconds", "return", "length"])
    lines.writerows([one.steps, f"{one.seconds:.2f}", f"{one.returned:.4f}", one.length] for one in learnt.practice)
    return text.getvalue()


def curve(lesson: TrainingConfig, learnt: TrainedPolicy, trials: tuple[Trial, ...]) -> Figure:
    """Return against steps and against time: what was learnt from, and what the players made of other episodes."""
    figure = Figure(figsize=(10, 4), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    returned = np.array([one.returned for one in learnt.practice])
    _draw(left, np.array([one.steps for one in learnt.practice]), returned, learnt.steps, trials)
    _draw(right, np.array([one.seconds for one in learnt.practice]), returned, learnt.seconds, trials)
    left.set(xlabel="steps of all robots", ylabel="return of an episode")
    right.set(xlabel="time [s]")
    figure.suptitle(f"{TASKS[lesson.task]}, {lesson.robots} robots, seed {lesson.seed}")
    left.legend(loc="upper left", fontsize="small")
    return figure


def _draw(axes: Axes, when: NDArray[Any], returned: NDArray[np.float64], end: float, trials: tuple[Trial, ...]) -> None:
    played = returns(trials)
    low, high = np.quantile(played["random"], [0.05, 0.95])
    axes.axhspan(low, high, color=CHANCE, alpha=0.3, label="random, other worlds: 90 % of episodes")
    axes.axhline(played["ahead"].mean(), color=PLAIN, linestyle="--", label="always ahead, other worlds: mean")
    axes.plot(when, returned, ".", color=LEARNT, alpha=0.5, markersize=5, label="an episode learnt from")
    if len(returned) >= RUNNING:
        means = np.convolve(returned, np.full(RUNNING, 1 / RUNNING), "valid")
        axes.plot(when[RUNNING - 1 :], means, color=LEARNT, label=f"mean of the last {RUNNING}")
    axes.plot(end, played["learnt"].mean(), "D", color="black", label="learnt, other worlds: mean")
    axes.set_xlim(left=0)
    axes.grid(alpha=0.3)
