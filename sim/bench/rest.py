"""Bring a robot on a bench to rest."""

from collections.abc import Callable

from refseq_bench.robots import Twist
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.control_period import CONTROL_PERIOD

STOPPING = (1.0, 5.0)
"""A robot has so long to come to rest, at least and at most [s]: choices."""


def come_to_rest(bench: Bench, each: Callable[[], object] | None = None) -> None:
    """Tell the robot to stand until it does, within ``STOPPING``; ``each`` is called after every control period."""
    least, most = (round(seconds / CONTROL_PERIOD) for seconds in STOPPING)
    for number in range(most):
        if number >= least and bench.state.stands:
            return
        bench.drive(Twist())
        if each is not None:
            each()
