"""Running a behaviour on a bench, until it ends or its time is up."""

from dataclasses import dataclass

from robots.behaviours import Behaviour, Outcome, Senses
from sim.bench import Bench


@dataclass(frozen=True, slots=True)
class Ended:
    """How a behaviour ended: its outcome and reason, and how long it took [s]."""

    outcome: Outcome
    why: str
    time: float


def run(bench: Bench, behaviour: Behaviour, *, timeout: float = 120.0) -> Ended:
    """Let ``behaviour`` steer until it ends; after ``timeout`` [s] of simulated time it has failed."""
    began = bench.time
    while bench.time - began < timeout:
        step = behaviour.step(Senses(bench.state, bench.scan(), bench.time))
        bench.drive(step.twist)
        if step.outcome is not Outcome.RUNNING:
            return Ended(step.outcome, step.why, bench.time - began)
    return Ended(Outcome.FAILED, f"not done after {timeout:g} s", bench.time - began)
