"""A robot's check judges what its trials measured: here they measure what they are told to."""

import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from refseq_bench.scenarios.robot_checks import check
from refseq_bench.scenarios.robot_checks.check import Finding, findings, findings_table
from refseq_bench.sim.acceptance import trials
from refseq_bench.sim.acceptance.trials import Braking, Pushed, Track

SPEED, ACCELERATION = 0.8, 0.4
BRAKING = SPEED**2 / (2 * ACCELERATION)


class Robot:
    """A bench without a simulation, of a robot with these limits."""

    def __init__(self, period: float = 0.05) -> None:
        self.robot = SimpleNamespace(limits=SimpleNamespace(speed=SPEED, acceleration=ACCELERATION))
        self.control = SimpleNamespace(period=period)

    def __enter__(self) -> "Robot":
        return self

    def __exit__(self, *_: object) -> None:
        pass


def track(*, along: float = 0.0, aside: float = 0.0, turned: float = 0.0) -> Track:
    """A robot that went so far and turned so much."""
    return Track(np.arange(2.0), np.array([[0.0, 0.0], [along, aside]]), np.array([0.0, turned]), np.zeros(2))


SOUND: dict[str, Any] = {
    "straight": (10.0, track(along=10.01, aside=-0.02)),
    "turn": (2 * math.pi, track(along=0.01, turned=2 * math.pi * 0.99)),
    "braking": Braking(SPEED, BRAKING + 0.1, 2.2),
    "standing": track(along=0.01),
    "energy_growth": 0.001,
    "balances": True,
    "push": Pushed(math.radians(12), 0.9, 0.01, True),
    "first_move": -0.02,
    "times_real_time": 35.0,
}
"""Measurements of trials of a sound robot, one that balances."""


@pytest.fixture
def tried(monkeypatch: pytest.MonkeyPatch) -> Callable[..., list[Finding]]:
    """Findings on a robot whose trials measure what a sound one's do, but for those given."""

    def tried(period: float = 0.05, **measured: Any) -> list[Finding]:
        monkeypatch.setattr(check, "empty_floor", lambda: None)
        monkeypatch.setattr(check, "_bench", lambda name, floor: Robot(period))
        for name, value in (SOUND | measured).items():
            monkeypatch.setattr(trials, name, lambda *_, value=value: value)
        return list(findings("any"))

    return tried


def test_a_sound_robot_is_good_in_all_trials(tried: Callable[..., list[Finding]]) -> None:
    found = tried()
    assert [one.verdict for one in found] == [*["good"] * 10, "not judged"]
    assert all(one.low <= one.measured <= one.high for one in found)


def test_only_a_robot_that_balances_is_pushed(tried: Callable[..., list[Finding]]) -> None:
    on_casters, balancing = tried(balances=False), tried()
    only = {one.what for one in balancing} - {one.what for one in on_casters}
    assert only == {
        "push of 50 N s on the mast, pitch",
        "away from its place 15 s later",
        "first move when told to go ahead",
    }


@pytest.mark.parametrize(
    ("measured", "bad"),
    [
        ({"straight": (10.0, track(along=10.06))}, "straight on"),
        ({"straight": (10.0, track(along=9.94))}, "straight on"),
        ({"straight": (10.0, track(along=10.0, aside=0.06))}, "straight on, to the side"),
        ({"straight": (10.0, track(along=10.0, aside=-0.06))}, "straight on, to the side"),
        ({"turn": (6.28, track(turned=6.28 * 1.03))}, "turn about itself"),
        ({"turn": (6.28, track(along=0.02, aside=0.02, turned=6.28))}, "turn, moved away"),
        ({"braking": Braking(SPEED, BRAKING + 0.31 * SPEED, 3.0)}, "stop from 0.80 m/s in"),
        ({"braking": Braking(SPEED, 0.98 * BRAKING, 1.0)}, "stop from 0.80 m/s in"),
        ({"standing": track(along=0.03)}, "stands 60 s, farthest off"),
        ({"energy_growth": 0.02}, "energy won in 60 s at rest"),
        ({"push": Pushed(math.radians(46), 0.9, 0.01, True)}, "push of 50 N s on the mast, pitch"),
        ({"push": Pushed(math.radians(12), 0.9, 0.01, False)}, "push of 50 N s on the mast, pitch"),  # it lies
        ({"push": Pushed(math.radians(12), 0.9, 0.03, True)}, "away from its place 15 s later"),
        ({"first_move": 0.0}, "first move when told to go ahead"),
    ],
)
def test_each_fault_is_found_by_its_trial_alone(
    tried: Callable[..., list[Finding]], measured: dict[str, Any], bad: str
) -> None:
    assert [one.what for one in tried(**measured) if one.verdict == "BAD"] == [bad]


def test_a_slow_machine_is_told_and_not_judged(tried: Callable[..., list[Finding]]) -> None:
    last = tried(times_real_time=0.5)[-1]
    assert (last.good, last.verdict, last.expected) == (True, "not judged", "at least 20")
    assert tried(period=0.01)[-1].expected == "at least 10"


def test_a_table_tells_all_of_them(tried: Callable[..., list[Finding]]) -> None:
    found = tried(energy_growth=0.02)
    table = findings_table("wheelie", found)
    rows = [list(map(str, row)) for row in zip(*(column.cells for column in table.columns), strict=True)]
    assert len(rows) == len(found)
    assert ["energy won in 60 s at rest", "0.020", "at most 0.01", "J", "BAD"] in rows
    assert ["straight on, to the side", "-0.020", "-0.050 to 0.050", "m", "good"] in rows
    assert ["turn about itself", "356.4", "352.8 to 367.2", "°", "good"] in rows
