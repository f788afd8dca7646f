"""Familiarisation by behaviours: the robot runs them one after another, and views are taken on the way (card X3).

A view is taken where each behaviour begins, so that a mission can begin it there again, and where the last one ends.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from robots.behaviours import Outcome
from robots.behaviours.written import Choice, make, parse
from sim.behaving import frame_of, running
from sim.bench import CONTROL_PERIOD, Bench
from sim.doors import doors_seen
from sim.errors import StuckError
from sim.recorder import PATIENCE, Moved, Taken, Trigger


def parsed(behaviours: Sequence[str], robot: str) -> tuple[Choice, ...]:
    """Behaviours as they are written. Raises ``RobotsError`` for one that the robot of that name cannot do."""
    import robots

    choices, frame = tuple(map(parse, behaviours)), frame_of(robots.load(robot))
    for choice in choices:
        make(choice, frame, doors_seen)
    return choices


def tour_and_sense(
    bench: Bench, behaviours: Sequence[str], trigger: Trigger, *, timeout: float = PATIENCE
) -> Iterator[Taken]:
    """Let the robot run behaviours; yields the views as they are taken, their progress by the odometer [m].

    Raises ``StuckError`` for a behaviour that fails, or when all have not ended within ``timeout`` [s] of simulated
    time; ``RobotsError`` for one that cannot be read.
    """
    choices, frame = parsed(behaviours, bench.robot.name), frame_of(bench.robot)
    gone = 0.0
    for number, choice in enumerate(choices, 1):
        yield Taken(replace(bench.sense(), behaviour=choice.text), bench.odometry, gone)
        moved, before = Moved(), bench.odometry
        for moment in running(bench, make(choice, frame, doors_seen), timeout=timeout - bench.time):
            if moment.step.outcome is Outcome.FAILED:
                raise StuckError(f"behaviour {number}, {choice.text}, failed after {gone:.1f} m: {moment.step.why}")
            now = bench.odometry
            moved.add(before, now, CONTROL_PERIOD)
            before = now
            if trigger.fires(moved):
                gone += moved.distance
                yield Taken(bench.sense(), bench.odometry, gone)
                moved = Moved()
        gone += moved.distance
    yield Taken(bench.sense(), bench.odometry, gone)
