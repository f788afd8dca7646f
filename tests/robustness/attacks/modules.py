"""Modules of a robot that are killed in the midst of a mission, while time goes by as it does."""

import math
import os
import secrets
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from unittest import SkipTest

import numpy as np

from refseq.access.listener import free_port
from refseq.access.policy import LOOPBACK, AccessPolicy
from refseq.modules.heads import Parts
from refseq.modules.link import opened
from refseq.modules.messages import STEPS, Step, head_of
from refseq.modules.process import Role
from tests.robustness.attack import Attack, Attempt, register
from tests.robustness.commands import PATIENCE, PROGRAM, ROOT, desk, until

MAP = "offices.refseq"
WORDS = {
    Role.ROBOT: f"robot {MAP} --renderer none --realtime",
    Role.CONTROL: "control",
    Role.LOCALISER: f"localiser {MAP}",
    Role.MISSION: f"mission {MAP} [LA1] --landmark LA1=8",
    Role.VIEWER: f"viewer {MAP} --rrd watched.rrd",
}
UNDER_WAY = (1.0, 6.0)
"""Ways of the odometer behind which a module is killed [m]: the mission has 8 m."""
NOTICED = 1.0
"""Seconds in which it is noticed."""
STANDING = 1e-3
"""A robot that goes less in a control period stands [m]."""
ARRIVES = 300.0
"""Seconds that a mission of 8 m may take on a busy machine."""


@cache
def mapped() -> Path:
    """A folder with a map of the corridor of the offices, as the laser saw it once."""
    command = [sys.executable, "-c", PROGRAM]
    drive = "record offices --behaviours MN:14 --sensors laser --renderer none -o offices.mcap"
    for words in (drive, f"learn offices.mcap --profile best -o {MAP}"):
        subprocess.run([*command, *words.split()], cwd=desk(), env=_environment(""), check=True, capture_output=True)
    return desk()


def _environment(token: str) -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "1", "REFSEQ_TOKEN": token}


@dataclass
class Crew:
    """The processes of a robot's modules, and what one who listens hears: steps and who is gone, and when [s]."""

    policy: AccessPolicy
    folder: Path
    running: dict[Role, "subprocess.Popen[bytes]"] = field(default_factory=dict)
    steps: list[tuple[float, Step]] = field(default_factory=list)
    gone: dict[str, float] = field(default_factory=dict)
    there: dict[str, float] = field(default_factory=dict)

    def start(self, role: Role) -> None:
        """Start a module; what it says goes into a file."""
        words = ["module", *WORDS[role].split(), "--port", str(self.policy.port)]
        with (self.folder / f"{role}.txt").open("ab") as said:
            self.running[role] = subprocess.Popen(
                [sys.executable, "-c", PROGRAM, *words],
                cwd=mapped(),
                env=_environment(self.policy.token),
                stdout=said,
                stderr=subprocess.STDOUT,
            )

    def heard(self, parts: Parts) -> None:
        """Take a step of the robot."""
        self.steps.append((time.monotonic(), head_of(Step, parts)))

    def changed(self, role: str, there: bool) -> None:
        """Take who is there, and who is gone."""
        (self.there if there else self.gone).setdefault(role, time.monotonic())

    def first(self, since: float, holds: Callable[[Step], bool]) -> float:
        """The time of the first step since some time for which something holds [s]; inf while there is none."""
        return next((at for at, step in list(self.steps) if at > since and holds(step)), math.inf)

    def taken_over(self, role: Role) -> float:
        """The time from when a module was there until the robot was commanded again [s]; inf before."""
        there = self.there.get(role, math.inf)
        return self.first(there, goes) - there if there < math.inf else math.inf

    def said(self) -> str:
        """The last words of all, in a line."""
        lines = {role: (self.folder / f"{role}.txt").read_text().splitlines()[-2:] for role in self.running}
        return "; ".join(f"{role}: {' / '.join(last)}" for role, last in lines.items())


@contextmanager
def crew_in(folder: Path) -> Iterator[Crew]:
    """A whole crew under way, ended behind the block."""
    crew = Crew(AccessPolicy(LOOPBACK, free_port(), secrets.token_hex(16)), folder)
    try:
        for role in WORDS:
            crew.start(role)
        with opened(crew.policy, serves=False, waits=lambda _line: None) as link:
            link.subscribe(STEPS, crew.heard)
            link.watch(crew.changed)
            yield crew
    finally:
        for process in crew.running.values():
            process.kill()
            process.wait()


def killed(role: Role, seed: int, folder: Path) -> Attempt:
    """Kill a module somewhere on the way, start another one when the robot stands, and wait until it has arrived."""
    try:
        import zenoh  # noqa: F401
    except ImportError:
        raise SkipTest("modules need eclipse-zenoh") from None
    way = np.random.default_rng(seed).uniform(*UNDER_WAY)
    figures: dict[str, float] = {}
    with crew_in(folder) as crew:
        if not until(lambda: bool(crew.steps) and crew.steps[-1][1].travelled > way, PATIENCE):
            return Attempt(f"it does not come to {way:.1f} m: {crew.said()}")
        told = _kill(crew, role, figures) or _arrival(crew)
        return Attempt(f"{told}: {crew.said()}" if told else None, figures)


def _kill(crew: Crew, role: Role, figures: dict[str, float]) -> str | None:
    """Kill a module, and start another one when the robot stands; a viewer is not missed."""
    crew.gone.clear(), crew.there.clear()
    crew.running[role].kill()
    at = time.monotonic()
    until(lambda: role in crew.gone, 10.0)
    figures["s until noticed"] = crew.gone.get(role, math.inf) - at
    if role is Role.VIEWER:
        crew.running.pop(role).wait()
    else:
        if role is not Role.ROBOT:
            until(lambda: stopped(crew, at) < math.inf, 10.0)
            figures |= {"s until it stood": stopped(crew, at) - at, "m until it stood": way_between(crew, at)}
        crew.start(role)
        until(lambda: crew.taken_over(role) < math.inf, PATIENCE)
        figures["s from when it is there until it took over"] = crew.taken_over(role)
    if math.inf in figures.values():
        return "it was not noticed, the robot drove on, or nobody took over"
    if role is Role.VIEWER and crew.first(at, lambda step: bool(step.held)) < math.inf:
        return "the robot stood for a viewer"
    return "it was noticed late" if figures["s until noticed"] > NOTICED else None


def _arrival(crew: Crew) -> str | None:
    """Wait until the mission is over; None where it was completed."""
    if not until(lambda: crew.running[Role.ROBOT].poll() is not None, ARRIVES):
        return "it does not arrive"
    codes = {role: one.wait(30) for role, one in crew.running.items() if role is not Role.VIEWER}
    return f"they ended with {codes}" if any(codes.values()) else None


def goes(step: Step) -> bool:
    """True where the robot was commanded."""
    return not step.held and step.command is not None


def stopped(crew: Crew, since: float) -> float:
    """The time when the robot first stood after some time [s]; inf before."""
    before = None
    for at, step in list(crew.steps):
        if at > since and before is not None and math.dist(step.truth[:2], before.truth[:2]) < STANDING:
            return at
        before = step
    return math.inf


def way_between(crew: Crew, since: float) -> float:
    """The way from some time until the robot stood [m]."""
    until_then = stopped(crew, since)
    poses = [step.truth[:2] for at, step in crew.steps if since <= at <= until_then]
    return sum(map(math.dist, poses, poses[1:]))


PROMISES = {
    Role.ROBOT: "is noticed within a second, and the mission is driven from its begin with the next",
    Role.VIEWER: "is noticed within a second, and the robot drives on",
}
for part in WORDS:
    usual = "is noticed within a second, the robot stands, and another one takes over where it was"
    register(
        Attack(
            f"kill-module-{part}", "modules", f"A module {part} that is killed {PROMISES.get(part, usual)}",
            5, 0, lambda seed, folder, part=part: killed(part, seed, folder),
        )
    )  # fmt: skip
