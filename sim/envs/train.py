"""Learn a task with PPO, and try what was learnt: ``python -m refseq_bench.sim.envs.train FollowCorridor -o out/ppo``.

Needs the extra ``rl``. Exit codes: 0 done; 1 the margin over chance is below what was asked; 2 bad input, in one line.
"""

import sys
from pathlib import Path
from typing import Annotated

import typer

from refseq.freed_memory import keep_freed_memory
from refseq.threads import sum_in_one_thread
from refseq_bench.sim.envs.learning.evaluation import evaluate, margin, returns
from refseq_bench.sim.envs.learning.files import write
from refseq_bench.sim.envs.learning.ppo import learn, stable_baselines
from refseq_bench.sim.envs.learning.training_config import TrainingConfig
from refseq_bench.sim.errors import SimError

BELOW, BAD_INPUT = 1, 2
app = typer.Typer(pretty_exceptions_enable=False, add_completion=False)


@app.command()
def train(
    task: Annotated[str, typer.Argument(help="Such as FollowCorridorTwist: an id without refseq/ and -v0.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="A folder for all files; made if there is none.")],
    seconds: Annotated[float, typer.Option(help="Learn so long by the clock, start-up counted in.")] = 600.0,
    steps: Annotated[int, typer.Option(help="Learn for so many steps at most.")] = 10_000_000,
    robots: Annotated[int, typer.Option(help="So many at a time, each in a process of its own.")] = 4,
    seed: Annotated[int, typer.Option(help="Of episodes, of first weights, and of actions while learning.")] = 0,
    world: Annotated[list[str] | None, typer.Option(help="Learn in this one; may be repeated.")] = None,
    held_out: Annotated[
        list[str] | None, typer.Option(help="Try it in this one, not learnt in; may be repeated.")
    ] = None,
    episodes: Annotated[int, typer.Option(help="Try so many.")] = 16,
    taught: Annotated[int, typer.Option(help="In missions: imitate the executor in so many episodes first.")] = 0,
    at_least: Annotated[float | None, typer.Option(help="Exit with 1 below this margin over chance.")] = None,
) -> None:
    """Learn a task with PPO; then what was learnt, chance, and going ahead play the same episodes, new to all of them.

    They are in other worlds where it is learnt in corridors as drawn, or --held-out names some; else in the same ones.
    """
    config = TrainingConfig(
        task, seconds, steps, robots, seed, tuple(world or ()), tuple(held_out or ()), episodes, taught
    )
    stable_baselines()
    _make(output)
    policy = output / "policy.zip"
    learnt = learn(config, policy)
    print(f"learnt: {learnt.steps} steps, {len(learnt.practice)} episodes, {learnt.seconds:.0f} s", flush=True)
    evaluated = evaluate(config, policy)
    write(output, config, learnt, evaluated)
    played = returns(evaluated)
    for name, returned in played.items():
        goals = sum(one.success for one in evaluated if one.player == name)
        print(f"{name:8s} mean return {returned.mean():7.2f}, {goals} of {episodes} at the goal")
    found = margin(played["learnt"], played["random"])
    print(f"margin over random: {found.mean:.2f}, 95 % from {found.low:.2f} to {found.high:.2f}")
    if at_least is not None and found.mean < at_least:
        raise typer.Exit(BELOW)


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise SimError(f"{folder}: is not a folder to write into: {error.strerror}") from None


def main() -> None:
    """Run the command line; a known error is one line and exit code 2."""
    # Workers are to take a core each, and not each all of them.
    sum_in_one_thread()
    keep_freed_memory()
    try:
        app()
    except SimError as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(BAD_INPUT)


if __name__ == "__main__":
    main()
