"""A robot's check: what it does on an empty floor beside what it should."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from refseq_bench import robots
from refseq_bench.scenarios.tables import TextTable
from refseq_bench.sim.acceptance import trials
from refseq_bench.sim.acceptance.floor import empty_floor
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.worlds.build import World

STRAIGHT, ANGLE = 10.0, 360.0
STANDING = 60.0
IMPULSE = 50.0
"""Commands of the trials: [m], [deg], [s], [N·s]."""
SHORT, ASIDE = 0.005, 0.05
"""Tolerance of the straight's end, of its length, and to the side [m]: choices."""
TURN_OFF, CREPT = 0.02, 0.02
"""Tolerance of the turn, of its angle, and of its place [m]: choices; wheels scrub."""
REACTION = 0.3
"""Time from the command to stop until the robot slows as it can [s]: the line's 5 Hz, the time to lean; a choice."""
STILL = 0.02
"""A robot that stands keeps within this [m]."""
WARMER = 0.01
"""Energy that a robot at rest may win, of sums of noise [J]: a choice."""
TIPPED = 45.0
"""Beyond this pitch [deg] a RMP switches off."""
BACK = -0.005
"""A robot that balances first rolls back by at least this [m]: a choice, ten times what the wheels give at rest."""
FASTER, FASTER_AT_100_HZ = 20.0, 10.0
"""Least speed of a simulation on one core, in times real time; less where the electronics tick so often."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One trial: what was ``measured`` in ``unit``, and from ``low`` to ``high`` where it should be.

    It is only told, and not ``judged``, where it depends on the machine and on what else runs there.
    """

    what: str
    measured: float
    unit: str
    low: float = -math.inf
    high: float = math.inf
    judged: bool = True

    @property
    def good(self) -> bool:
        """True where it is as it should be, or is not judged."""
        return not self.judged or self.low <= self.measured <= self.high

    @property
    def verdict(self) -> str:
        """Verdict in a word."""
        if not self.judged:
            return "not judged"
        return "good" if self.good else "BAD"

    @property
    def expected(self) -> str:
        """Where it should be, in words."""
        if math.isinf(self.low):
            return f"at most {self.high:g}"
        return f"at least {self.low:g}" if math.isinf(self.high) else f"{_shown(self.low)} to {_shown(self.high)}"


def findings(name: str) -> Iterator[Finding]:
    """Try the robot called ``name``, each time anew."""
    floor = empty_floor()
    yield from _driving(name, floor)
    yield _braking(name, floor)
    with _bench(name, floor) as bench:
        yield Finding(
            f"stands {STANDING:g} s, farthest off", trials.standing(bench, STANDING).excursion, "m", high=STILL
        )
    with _bench(name, floor) as bench:
        yield Finding(f"energy won in {STANDING:g} s at rest", trials.energy_growth(bench, STANDING), "J", high=WARMER)
    with _bench(name, floor) as bench:
        balancing = trials.balances(bench)
    if balancing:
        yield from _balancing(name, floor)
    with _bench(name, floor) as bench:
        least = FASTER_AT_100_HZ if bench.control.period < 0.015 else FASTER
        yield Finding("simulated over real time", trials.times_real_time(bench), "×", low=least, judged=False)


def _driving(name: str, floor: World) -> Iterator[Finding]:
    with _bench(name, floor) as bench:
        asked, track = trials.straight(bench, STRAIGHT)
        yield Finding("straight on", track.along, "m", *_about(asked, SHORT))
        yield Finding("straight on, to the side", track.aside, "m", -ASIDE, ASIDE)
    with _bench(name, floor) as bench:
        asked, track = trials.turn(bench, math.radians(ANGLE))
        yield Finding("turn about itself", math.degrees(track.turned), "°", *_about(math.degrees(asked), TURN_OFF))
        yield Finding("turn, moved away", math.hypot(track.along, track.aside), "m", high=CREPT)


def _braking(name: str, floor: World) -> Finding:
    with _bench(name, floor) as bench:
        found = trials.braking(bench)
        least = trials.braking_distance(bench.robot.limits, found.speed)
    what = f"stop from {found.speed:.2f} m/s in"
    return Finding(what, found.distance, "m", (1 - SHORT) * least, least + REACTION * found.speed)


def _balancing(name: str, floor: World) -> Iterator[Finding]:
    with _bench(name, floor) as bench:
        found = trials.push(bench, IMPULSE)
        pitch = math.degrees(found.pitch) if found.stands else 90.0
        yield Finding(f"push of {IMPULSE:g} N s on the mast, pitch", pitch, "°", high=TIPPED)
        yield Finding("away from its place 15 s later", found.off, "m", high=STILL)
    with _bench(name, floor) as bench:
        yield Finding("first move when told to go ahead", trials.first_move(bench), "m", high=BACK)


def _about(value: float, share: float) -> tuple[float, float]:
    return (1 - share) * value, (1 + share) * value


def _bench(name: str, floor: World) -> Bench:
    return Bench(floor, robots.load(name), settings=BenchSettings(renderer=RendererKind.NONE, cameras=()))


def findings_table(name: str, found: list[Finding]) -> TextTable:
    """All trials of one robot, for a terminal of 80 characters."""
    table = TextTable("trial", ">measured", ">should be", "", "verdict", title=name, wraps=("trial",))
    for row in found:
        table.add_row(row.what, _shown(row.measured), row.expected, row.unit, row.verdict)
    return table


def _shown(value: float) -> str:
    """A value to the millimetre, or a tenth of what counts in hundreds; no minus before a zero."""
    digits = 3 if abs(value) < 100 else 1
    return f"{value:z.{digits}f}"
