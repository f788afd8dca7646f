"""Familiarisation by behaviours: the robot runs them one after another, and views are taken on the way (card X3).

A view is taken where each behaviour begins, so that a mission can begin it there again, and where the last one ends.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from refseq_bench.robots.behaviours import BehaviourOutcome
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.control_period import CONTROL_PERIOD
from refseq_bench.sim.drives.behaviour_runner import behaviour_in, description_of, running
from refseq_bench.sim.drives.operator import PATIENCE
from refseq_bench.sim.drives.recorder import RecordedView
from refseq_bench.sim.drives.trigger import Moved, Trigger
from refseq_bench.sim.errors import StuckError


def run_and_sense(
    bench: Bench, behaviours: Sequence[str], trigger: Trigger, *, timeout: float = PATIENCE
) -> Iterator[RecordedView]:
    """Let the robot run behaviours; yields the views as they are taken, their progress by the odometer [m].

    Raises ``StuckError`` for a behaviour that fails, or when all have not ended within ``timeout`` [s] of simulated
    time from now on; ``RobotsError`` for one that cannot be read.
    """
    description, gone, began = description_of(bench.robot), 0.0, bench.time
    for words in behaviours:
        behaviour_in(words, description)  # all can be read before the robot moves
    for number, words in enumerate(behaviours, 1):
        yield RecordedView(replace(bench.sense(), behaviour=words), bench.odometry, gone)
        moved, before = Moved(), bench.odometry
        for sample in running(bench, behaviour_in(words, description), timeout=timeout, since=began):
            now = bench.odometry
            moved.add(before, now, CONTROL_PERIOD)
            before = now
            if sample.step.outcome is BehaviourOutcome.FAILED:
                way = gone + moved.distance
                raise StuckError(f"behaviour {number}, {words}, failed after {way:.1f} m: {sample.step.why}")
            # Where a behaviour ends the next view is taken at once, as that of what follows.
            if sample.step.outcome is BehaviourOutcome.RUNNING and trigger.fires(moved):
                gone += moved.distance
                yield RecordedView(bench.sense(), bench.odometry, gone)
                moved = Moved()
        gone += moved.distance
    yield RecordedView(bench.sense(), bench.odometry, gone)
