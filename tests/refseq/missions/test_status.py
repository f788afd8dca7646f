"""The table of a mission's transitions: taken by missions of every kind, complete, and drawn as it is."""

import random
from itertools import chain
from pathlib import Path

import pytest

from refseq.missions.diagram import ARROWS, STATES, state_diagram
from refseq.missions.executor import Executor, ExecutorSettings
from refseq.missions.plan import Order, Plan
from refseq.missions.status import TRANSITIONS, Status
from refseq.missions.tasks import Call, Task, Wait
from tests.refseq.missions.on_a_line import flat, lost, seen_at, way

DRAWING = Path(__file__).parents[3] / "docs" / "images" / "mission-states.svg"
TABLE = {(source, target) for source, targets in TRANSITIONS.items() for target in targets}
PATH = way(12.0)
BEHAVIOURS = ("MN", "MN", "MT:90", "MW:left,0.8,5")


def random_plan(rng: random.Random) -> Plan:
    """Up to four orders, some of them turns, some with tasks, anywhere on the way."""
    ats = sorted([0.0, *(rng.choice((rng.uniform(0, 12), 4.0)) for _ in range(rng.randint(0, 3)))])
    tasks = (Wait(1.0), Call("c"))

    def some() -> tuple[Task, ...]:
        return tuple(rng.sample(tasks, rng.choice((0, 0, 1, 2))))

    orders = tuple(
        Order(at, rng.choice(BEHAVIOURS), f"step {number}", some(), rng.choice((None, 20.0)))
        for number, at in enumerate(ats)
    )
    return Plan(PATH, orders, rng.choice((12.0, ats[-1])), some())


def random_mission(rng: random.Random) -> None:
    """Run a mission to which anything may happen at any time."""
    executor = Executor(random_plan(rng), localised=rng.random() < 0.8, settings=ExecutorSettings(patience=12.0))
    time = travelled = 0.0
    x, script = 0.0, "right"
    while not executor.status.over and time < 200.0:
        time += rng.choice((0.5, 1.0))
        if not executor.do.halt:
            travelled, x = travelled + 0.4, x + 0.4
        x = rng.uniform(0, 14) if rng.random() < 0.02 else x
        script = rng.choice(("right", "right", "lost", "flat")) if rng.random() < 0.05 else script
        executor.move(time, travelled)
        beliefs = {"right": seen_at(PATH.along, x), "lost": lost(13), "flat": flat(13)}
        executor.believe(beliefs[script])
        if executor.status is Status.AT_TASK and rng.random() < 0.3:
            rng.choice((executor.done, executor.done, executor.pause, executor.abort))()
        elif executor.status.moving and rng.random() < 0.1:
            executor.ended(rng.random() < 0.9, "so")
        elif executor.status is Status.PAUSED and rng.random() < 0.4:
            executor.resume()
        elif rng.random() < 0.06:
            rng.choice((executor.pause, executor.pause, executor.abort))()


RARE = (1495, 153, 1520, 689, 21, 66, 234, 425, 1698, 18, 20, 22, 23, 38, 59, 64, 306)
"""Seeds of missions that take every transition; where missions have changed, those after them are asked as well."""


@pytest.mark.quick_cases("rare")
@pytest.mark.parametrize("first", [RARE, ()], ids=["rare", "all"])
def test_missions_take_every_transition_of_the_table_and_no_other(
    monkeypatch: pytest.MonkeyPatch, first: tuple[int, ...]
) -> None:
    taken: set[tuple[Status, Status]] = set()
    become = Executor._become

    def traced(self: Executor, status: Status, what: str) -> None:
        taken.add((self.status, status))
        become(self, status, what)

    monkeypatch.setattr(Executor, "_become", traced)
    for seed in chain(first, range(3000)):
        random_mission(random.Random(seed))
        if taken == TABLE:
            break
    assert taken == TABLE


def test_states_that_nothing_follows_are_those_in_which_a_mission_is_over() -> None:
    over = {Status.COMPLETED, Status.FAILED, Status.ABORTED}
    assert {status for status in Status if status.over} == over
    assert set(TRANSITIONS) == set(Status)
    reached = {Status.LOCALISING}
    while more := {target for source, target in TABLE if source in reached} - reached:
        reached |= more
    assert reached == set(Status)


def test_the_drawing_shows_the_table() -> None:
    assert set().union(*(arrow.transitions for arrow in ARROWS)) == TABLE
    assert set(STATES) == set(Status)
    assert DRAWING.read_text() == state_diagram(), "python -m refseq.missions.diagram > docs/images/mission-states.svg"
