"""Sensors that fail on the way: declared within 2 s or 2 m, and no wrong fix that the healthy drive did not have."""

import random
import subprocess
import sys
from collections.abc import Callable, Sequence
from functools import lru_cache
from itertools import islice
from pathlib import Path

from refseq.belief import LOST_ABOVE, Belief, Stage
from refseq.fault import CLOCK, ODOMETRY, FaultKind
from refseq.health.monitor import HealthMonitor
from refseq.logs import read_recording
from refseq.map.learning import learn
from refseq.map.localiser import localise
from refseq.map.map import Map
from refseq.view import LASER, View
from refseq_bench.sim.drives.signal_faults import SignalFault, SignalFaultKind, with_signal_fault
from tests.refseq.health.drives import drive
from tests.robustness.attack import Attack, Attempt, register
from tests.robustness.table import ROOT

STORE = ROOT / "out/robustness-drives"
WORLDS = {
    "offices": ("--light", "noon", "--light", "late-evening", "--change", "few"),
    "laboratory": ("--light", "16:00", "--light", "18:00", "--change", "few"),
}
"""Judged in these; the thresholds were chosen in annex and on real logs (docs/sensor-faults.md)."""

BEFORE, AFTER = 8, 9
"""Views that are localised before a fault begins, and from then on."""

WRONG = 2.0
"""A fix is wrong when it is farther from the truth than this [m]."""

IN_TIME = 2.0
"""Seconds or metres from the first ill view within which a fault is to be declared."""

FAULTS: dict[str, tuple[tuple[SignalFaultKind, dict[str, object]], set[tuple[str, FaultKind]]]] = {
    "black-camera": (
        (SignalFaultKind.CAMERA_BLANK, {"camera": "camera-1"}),
        {("camera-1", FaultKind.BLANK)},
    ),
    "frozen-camera": (
        (SignalFaultKind.CAMERA_FROZEN, {"camera": "camera-2"}),
        {("camera-2", FaultKind.FROZEN)},
    ),
    "exchanged-cameras": (
        (SignalFaultKind.CAMERAS_EXCHANGED, {"camera": "camera-1", "other": "camera-2"}),
        {("camera-1", FaultKind.EXCHANGED), ("camera-2", FaultKind.EXCHANGED)},
    ),
    "dazzled-laser": ((SignalFaultKind.LASER_BLIND, {"bearing": -45.0}), {(LASER, FaultKind.BLIND)}),
    "stuck-laser": ((SignalFaultKind.LASER_FROZEN, {}), {(LASER, FaultKind.FROZEN)}),
    "upside-down-laser": ((SignalFaultKind.LASER_MIRRORED, {}), {(LASER, FaultKind.MIRRORED)}),
    "lost-odometry": ((SignalFaultKind.ODOMETRY_LOST, {}), {(ODOMETRY, FaultKind.LOST)}),
    "doubled-odometry": ((SignalFaultKind.ODOMETRY_DOUBLED, {}), {(ODOMETRY, FaultKind.DOUBLED)}),
    "frozen-odometry": ((SignalFaultKind.ODOMETRY_FROZEN, {}), {(ODOMETRY, FaultKind.FROZEN)}),
    "reversed-odometry": ((SignalFaultKind.ODOMETRY_REVERSED, {}), {(ODOMETRY, FaultKind.REVERSED)}),
    "stamps-back": ((SignalFaultKind.CLOCK_JUMPING, {"seconds": -5.0}), {(CLOCK, FaultKind.JUMPING)}),
    "stamps-ahead": ((SignalFaultKind.CLOCK_JUMPING, {"seconds": 86_400.0}), {(CLOCK, FaultKind.JUMPING)}),
}


@lru_cache
def drives(world: str) -> tuple[Path, list[View]]:
    """The reference and the query drive of a world, recorded once by the fast renderer."""
    options = WORLDS[world]
    route = ("--route", "round", "--turn", "30") if world == "laboratory" else ()
    STORE.mkdir(parents=True, exist_ok=True)
    files = STORE / f"{world}-reference.mcap", STORE / f"{world}-query.mcap"
    for seed, (file, given) in enumerate(zip(files, (options[:2], options[2:]), strict=True), start=1):
        if not file.exists():
            words = ["record", world, "-o", file, "--renderer", "classic", "--seed", str(seed), *given, *route]
            begin = "from refseq_bench.scenarios.cli.app import main; main()"
            subprocess.run([sys.executable, "-c", begin, *map(str, words)], cwd=ROOT, check=True, capture_output=True)
    return files[0], list(read_recording(files[1]).views)


@lru_cache
def map_of(world: str, profile: str) -> Map:
    """The map of a world's reference drive."""
    return learn(read_recording(drives(world)[0]).views, profile=profile)


@lru_cache
def healthy(world: str, profile: str, start: int) -> list[Belief]:
    """The answers to the healthy views around a start."""
    return answers(map_of(world, profile), around(drives(world)[1], start))


def around(views: Sequence[View], start: int) -> list[View]:
    """Views from a little before a start to a little behind it."""
    return list(views[max(0, start - BEFORE) : start + AFTER])


def answers(map_: Map, views: Sequence[View]) -> list[Belief]:
    """The chain's answers."""
    return localise(map_, views, stages=[Stage.CHAIN])[Stage.CHAIN]


def fault_from(views: Sequence[View], start: int, name: str) -> list[View]:
    """The same views with a fault from one of them on."""
    kind, options = FAULTS[name][0]
    way = sum(abs(view.distance) for view in views[: start + 1])
    return list(with_signal_fault(views, SignalFault(kind, at=way - 1e-6, **options), start))


def judged(name: str, views: Sequence[View], start: int, faults: Sequence[set[tuple[str, FaultKind]]]) -> Attempt:
    """Tell whether a fault that began at ``start`` was declared in time."""
    wanted = FAULTS[name][1]
    first = next((k for k in range(start, len(views)) if wanted <= faults[k]), None)
    if first is None:
        return Attempt(f"not declared within {len(views) - start} views; told {set().union(*faults[start:]) or 'none'}")
    metres = sum(abs(view.distance) for view in views[start + 1 : first + 1])
    seconds = views[first].time - views[start].time
    figures = {"m": metres, "s": seconds}
    late = metres > IN_TIME and seconds > IN_TIME
    return Attempt(f"declared after {metres:.1f} m and {seconds:.1f} s" if late else None, figures)


def attack_on_localiser(name: str) -> Callable[[int, Path], Attempt]:
    """One try: a world, a method and a start by the seed."""

    def attempt(seed: int, folder: Path) -> Attempt:
        rng = random.Random(seed)
        world, profile = rng.choice(list(WORLDS)), rng.choice(["best", "thesis"])
        whole = drives(world)[1]
        start = rng.randrange(4, len(whole) - AFTER)
        views, begin = around(whole, start), min(start, BEFORE)
        told = f"{world}, {profile}, view {start}"
        (folder / "case.txt").write_text(told)
        found = answers(map_of(world, profile), fault_from(views, begin, name))
        wrong = wrong_fixes(map_of(world, profile), views, found, healthy(world, profile, start))
        attempt = judged(name, views, begin, [{(f.sensor, f.kind) for f in belief.faults} for belief in found])
        fell = " and ".join(filter(None, [attempt.fell, f"{wrong} wrong fixes" if wrong else None]))
        return Attempt(f"{told}: {fell}" if fell else None, {**attempt.figures, "wrong fixes": float(wrong)})

    return attempt


def wrong_fixes(map_: Map, views: Sequence[View], found: Sequence[Belief], before: Sequence[Belief]) -> int:
    """Answers that are wrong and sure, where those to the healthy views are not."""

    def wrong(belief: Belief, view: View) -> bool:
        pose = map_.poses[belief.best]
        assert pose is not None
        assert view.truth is not None
        apart = ((pose.x - view.truth.x) ** 2 + (pose.y - view.truth.y) ** 2) ** 0.5
        return belief.lost < LOST_ABOVE and apart > WRONG

    return sum(wrong(now, view) and not wrong(then, view) for now, then, view in zip(found, before, views, strict=True))


def attack_on_monitor(seed: int, folder: Path) -> Attempt:
    """One try on a made-up drive: any fault that needs no map, anywhere."""
    rng = random.Random(seed)
    name = rng.choice([one for one in FAULTS if one != "exchanged-cameras"])
    views, start = drive(seed=seed), rng.randrange(4, 20)
    (folder / "case.txt").write_text(f"{name} from view {start}")
    monitor = HealthMonitor()
    found = [{(f.sensor, f.kind) for f in monitor.update(view).faults} for view in fault_from(views, start, name)]
    early = next((k for k, faults in enumerate(islice(found, start)) if faults), None)
    if early is not None:
        return Attempt(f"{name}: {found[early]} at view {early}, where all is well")
    attempt = judged(name, views, start, found)
    return Attempt(attempt.fell and f"{name} from view {start}: {attempt.fell}", attempt.figures)


for fault in FAULTS:
    promise = f"A drive with {fault.replace('-', ' ')}: declared within 2 s or 2 m, and no wrong fix because of it"
    register(Attack(fault, "sensors", promise, 24, 0, attack_on_localiser(fault), 120.0))
register(
    Attack(
        "sensor-monitor",
        "sensors",
        "A fault on a made-up drive is declared within 2 s or 2 m, and none before it",
        200,
        3,
        attack_on_monitor,
    )
)
