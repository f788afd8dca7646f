"""Write the results of a training run: ``curve.csv``, ``curve.png`` and ``result.json``."""

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
from refseq_bench.sim.envs.learning.evaluation import EXECUTOR, EvaluationEpisode, margin, returns
from refseq_bench.sim.envs.learning.ppo import TrainedPolicy
from refseq_bench.sim.envs.learning.training_config import TASKS, TrainingConfig

RUNNING = 10
"""The curve is the mean of so many episodes, one after the other."""
LEARNT, CHANCE, PLAIN, TACTICAL = "#d55e00", "#8a8a8a", "#2a8fd4", "#009e73"


def result(config: TrainingConfig, learnt: TrainedPolicy, episodes: tuple[EvaluationEpisode, ...]) -> dict[str, Any]:
    """The figures: what was learnt, how long it took, what each player made of the same episodes, the margins."""
    played = returns(episodes)
    return {
        "id": TASKS[config.task],
        "robots": config.robots,
        "seed": config.seed,
        "taught": config.taught,
        "steps": learnt.steps,
        "seconds": round(learnt.seconds, 1),
        "episodes": len(learnt.practice),
        "learnt_in": config.learnt_in,
        "tried_in": config.tried_in,
        "mean_return": {name: float(returned.mean()) for name, returned in played.items()},
        "goals": {name: sum(one.success for one in episodes if one.player == name) for name in played},
        "of": config.episodes,
        "margin_over": {
            name: asdict(margin(played["learnt"], returned)) for name, returned in played.items() if name != "learnt"
        },
        "evaluation": [asdict(one) for one in episodes],
    }


def write(folder: Path, config: TrainingConfig, learnt: TrainedPolicy, episodes: tuple[EvaluationEpisode, ...]) -> None:
    """Write the three files into ``folder``."""
    replace_text(folder / "curve.csv", table(learnt))
    with replacing_at(folder / "curve.png") as path:
        curve(config, learnt, episodes).savefig(path, dpi=120)
    replace_text(folder / "result.json", json.dumps(result(config, learnt, episodes), indent=2) + "\n")


def table(learnt: TrainedPolicy) -> str:
    """A line an episode that was learnt from: steps of all robots, seconds, return, its own steps."""
    text = io.StringIO()
    lines = csv.writer(text, lineterminator="\n")
    lines.writerow(["steps", "seconds", "return", "length"])
    lines.writerows([one.steps, f"{one.seconds:.2f}", f"{one.returned:.4f}", one.length] for one in learnt.practice)
    return text.getvalue()


def curve(config: TrainingConfig, learnt: TrainedPolicy, episodes: tuple[EvaluationEpisode, ...]) -> Figure:
    """Return against steps and against time: what was learnt from, and what the players made of other episodes."""
    figure = Figure(figsize=(10, 4.5), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    returned = np.array([one.returned for one in learnt.practice])
    where = "other worlds" if config.tried_elsewhere else "same worlds, other episodes"
    _draw(left, np.array([one.steps for one in learnt.practice]), returned, learnt.steps, episodes, where)
    _draw(right, np.array([one.seconds for one in learnt.practice]), returned, learnt.seconds, episodes, where)
    left.set(xlabel="steps of all robots", ylabel="return of an episode")
    right.set(xlabel="time [s]")
    robots = "1 robot" if config.robots == 1 else f"{config.robots} robots"
    taught = f", {config.taught} episodes imitated" if config.taught else ""
    figure.suptitle(f"{TASKS[config.task]}, {robots}{taught}, seed {config.seed}")
    # Below both: what was learnt may lie anywhere, in a corner too where it was only imitated.
    figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize="small")
    return figure


def _draw(
    axes: Axes,
    when: NDArray[Any],
    returned: NDArray[np.float64],
    end: float,
    episodes: tuple[EvaluationEpisode, ...],
    where: str,
) -> None:
    played = returns(episodes)
    low, high = np.quantile(played["random"], [0.05, 0.95])
    axes.axhspan(low, high, color=CHANCE, alpha=0.3, label=f"random, {where}: 90 % of episodes")
    axes.axhline(played["ahead"].mean(), color=PLAIN, linestyle="--", label=f"always ahead, {where}: mean")
    if EXECUTOR in played:
        axes.axhline(played[EXECUTOR].mean(), color=TACTICAL, linestyle=":", label="the executor: mean")
    if len(returned):
        axes.plot(when, returned, ".", color=LEARNT, alpha=0.5, markersize=5, label="an episode learnt from")
    if len(returned) >= RUNNING:
        means = np.convolve(returned, np.full(RUNNING, 1 / RUNNING), "valid")
        axes.plot(when[RUNNING - 1 :], means, color=LEARNT, label=f"mean of the last {RUNNING}")
    axes.plot(end, played["learnt"].mean(), "D", color="black", clip_on=False, label=f"learnt, {where}: mean")
    axes.set_xlim(0, 1.05 * max(end, 1))
    axes.grid(alpha=0.3)
