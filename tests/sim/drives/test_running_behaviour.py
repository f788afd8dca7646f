"""The behaviour that runs for an order: begun by its number, and halted without growing impatient."""

import numpy as np

from refseq.view import Scan
from refseq_bench import robots
from refseq_bench.robots import Cause, RobotState, Stop
from refseq_bench.robots.behaviours import BehaviourOutcome, Senses
from refseq_bench.robots.behaviours.guarded import PATIENCE
from refseq_bench.sim.drives.behaviour_runner import RunningBehaviour, description_of

FREE = Scan(np.full(361, np.inf, np.float32))


def stopped(time: float) -> Senses:
    return Senses(RobotState(time=time, stops=(Stop(Cause.SONAR, "0.30 m ahead", 0.0),)), FREE, time)


def test_time_in_which_it_is_halted_is_none_of_its_patience() -> None:
    running = RunningBehaviour(description_of(robots.load("robuter")))
    assert running.step(1, "MN:5", stopped(0.0)).outcome is BehaviourOutcome.RUNNING
    running.halted(600.0)
    assert running.step(1, "MN:5", stopped(600.0 + PATIENCE / 2)).outcome is BehaviourOutcome.RUNNING
    assert running.step(1, "MN:5", stopped(600.1 + PATIENCE)).outcome is BehaviourOutcome.FAILED
    assert running.step(2, "MN:5", stopped(601.0 + PATIENCE)).outcome is BehaviourOutcome.RUNNING
