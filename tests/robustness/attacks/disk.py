"""Commands that are killed, out of space, or not alone: old files stay to the bit, or the new ones are whole.

Every try begins with files of an earlier run, and ends with an undisturbed one, which has to make what it always makes.
"""

import atexit
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from random import Random
from unittest import SkipTest

from rerun.chunk import RrdReader

from refseq.drafts import DRAFT
from refseq.errors import LogError
from refseq.logs import read_recording
from refseq_bench.scenarios.campaign.store.cache import ENDS, Store
from refseq_bench.scenarios.campaign.store.result_file import RESULT, read_result
from tests.robustness.attack import HERE, attack
from tests.robustness.fingerprints import CACHE, RESULTS, fingerprints
from tests.robustness.fuzzing import run
from tests.robustness.sudden import Arms

ROOM, SCENARIO = "room.toml", "laser.toml"
LASER = ("--sensors", "laser", "--renderer", "none", "--distance", "0.4")
CHANGES, VIEWS = "changes", "views"
"""Files in which the attacked process leaves its counts."""
NOT_DONE = ("interrupted", "error: ")


@dataclass(frozen=True)
class Command:
    """A command that leaves ``made``, a file or a folder; ``older`` is the one that left what lies there already.

    ``needs`` make its inputs, in a folder with a room. A command that is done ``once`` is refused when it is done.
    """

    words: tuple[str, ...]
    older: tuple[str, ...]
    made: str
    needs: tuple[tuple[str, ...], ...] = ()
    once: bool = False


def _record(seed: int, name: str, *more: str) -> tuple[str, ...]:
    return ("record", ROOM, *LASER, "--seed", str(seed), *more, "-o", name)


ONE, OTHER = _record(1, "one.mcap"), _record(2, "other.mcap")
LEARN, LEARN_OTHER = ("learn", "one.mcap", "-o", "one.refseq"), ("learn", "other.mcap", "-o", "other.refseq")
MISSION = ("mission", "run", "one.refseq", "--world", ROOM, "--renderer", "none", "--by-odometry")
COMMANDS = {
    "record": Command(_record(1, "drive.mcap"), _record(2, "drive.mcap"), "drive.mcap"),
    "record-bag": Command(_record(1, "bag", "--format", "rosbag2"), _record(2, "bag", "--format", "rosbag2"), "bag"),
    "record-sqlite": Command(
        _record(1, "bag", "--format", "rosbag2-sqlite3"), _record(2, "bag", "--format", "rosbag2-sqlite3"), "bag"
    ),
    "learn": Command(
        ("learn", "one.mcap", "-o", "map.refseq"),
        ("learn", "other.mcap", "-o", "map.refseq"),
        "map.refseq",
        (ONE, OTHER),
    ),
    "merge": Command(
        ("map", "merge", "one.refseq", "other.refseq", "-o", "both.refseq"),
        ("map", "merge", "other.refseq", "one.refseq", "-o", "both.refseq"),
        "both.refseq",
        (ONE, OTHER, LEARN, LEARN_OTHER),
    ),
    "add": Command(
        ("map", "merge", "both.refseq", "third.refseq", "-o", "both.refseq"),
        ("map", "merge", "one.refseq", "other.refseq", "-o", "both.refseq"),
        "both.refseq",
        (ONE, OTHER, LEARN, LEARN_OTHER, _record(3, "third.mcap"), ("learn", "third.mcap", "-o", "third.refseq")),
        once=True,
    ),
    "mission": Command(
        (*MISSION, "--seed", "1", "-o", "trip"), (*MISSION, "--seed", "2", "-o", "trip"), "trip", (ONE, LEARN)
    ),
}


@dataclass(frozen=True)
class Undisturbed:
    """A command's undisturbed run: the folder ``before`` it and ``after``, its changes of files, its time [s]."""

    before: Path
    after: Path
    changes: int
    seconds: float


@cache
def _scratch() -> Path:
    folder = Path(tempfile.mkdtemp(prefix="refseq-attacks-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


def _done(words: Sequence[str], folder: Path, arms: Arms | None = None) -> None:
    """Run a command that has to end well."""
    found = run(words, folder, arms or {"unharmed": {}})
    if found.code:
        raise AssertionError(f"refseq {' '.join(words)}: {found.code}: {found.err[-300:]}")


@cache
def undisturbed(name: str) -> Undisturbed:
    """Run a command without any harm, once."""
    command, before, after = COMMANDS[name], _scratch() / name / "before", _scratch() / name / "after"
    before.mkdir(parents=True)
    shutil.copy(HERE / "scenes" / ROOM, before)
    for words in (*command.needs, command.older):
        _done(words, before)
    shutil.copytree(before, after)
    began = time.monotonic()
    _done(command.words, after, {"count_changes": {"file": CHANGES}})
    counted = after / CHANGES
    changes = counted.stat().st_size
    counted.unlink()
    return Undisturbed(before, after, changes, time.monotonic() - began)


def _kill(known: Undisturbed, rng: Random) -> Arms:
    """A kill at any time, or just before a file changes: there the harm would be done."""
    if rng.random() < 0.5:
        return {"kill_after": {"seconds": rng.uniform(0.0, known.seconds)}}
    return {"kill_before_change": {"number": rng.randint(1, known.changes)}}


def _stopped(name: str, seed: int, folder: Path, harm: Callable[[Undisturbed, Random], Arms]) -> str | None:
    """Do harm to a command, look at what lies there, and run it again."""
    known, command = undisturbed(name), COMMANDS[name]
    shutil.copytree(known.before, folder, dirs_exist_ok=True)
    found = run(command.words, folder, {"count_views": {"file": VIEWS}, **harm(known, Random(f"{name} {seed}"))})
    told = found.err.splitlines()
    if found.code > 0 and not (len(told) == 1 and told[0].startswith(NOT_DONE)):
        return f"ended with {found.code}: {found.err[-300:]!r}"
    if fell := _neither(folder / command.made, known.before / command.made, known.after / command.made):
        return fell
    if fell := _lost(folder, command, known.after / command.made):
        return fell
    if command.once and _neither(folder / command.made, None, known.after / command.made) is None:
        code = run(command.words, folder).code
        return None if code == 2 else f"it is done, and done again it ends with {code}"
    _done(command.words, folder)
    if fell := _neither(folder / command.made, None, known.after / command.made):
        return f"the next run: {fell}"
    left = [path.name for path in folder.iterdir() if path.name.startswith(DRAFT)]
    return f"the next run leaves {left}" if left else None


def _neither(made: Path, older: Path | None, new: Path) -> str | None:
    """Tell which file is neither the older one to the bit, nor the new one."""
    if made.is_dir() or new.is_dir():
        names = sorted(path.name for path in new.iterdir())
        whole = [one for one in (older, new) if one is not None]
        if (new / "metadata.yaml").exists():  # files of a bag belong together
            return None if any(_same_folder(made, one) for one in whole) else f"{made.name} is neither bag"
        return next(filter(None, (_neither(made / one, older and older / one, new / one) for one in names)), None)
    candidates = [path for path in (older, new) if path is not None and path.exists()]
    if made.exists() and any(_alike(made, one) for one in candidates):
        return None
    return f"{made.name} is neither the older file nor the new one"


def _same_folder(one: Path, other: Path) -> bool:
    return {path.name: path.read_bytes() for path in one.iterdir()} == {
        path.name: path.read_bytes() for path in other.iterdir()
    }


def _alike(one: Path, other: Path) -> bool:
    """Equal to the bit; the viewer's files, whose chunks are numbered by the clock, can be read."""
    if one.suffix == ".rrd":
        return bool(RrdReader(one).recordings()) and one.stat().st_size > 0.9 * other.stat().st_size
    return one.read_bytes() == other.read_bytes()


def _lost(folder: Path, command: Command, whole: Path) -> str | None:
    """Tell where a drive that ended early has lost more than its last view, or passes as whole.

    Once the drive has its name, nothing is lost; beside it may lie the older bag, which was about to be removed.
    """
    if _neither(folder / command.made, None, whole) is None:
        return None
    counted = (folder / VIEWS).stat().st_size if (folder / VIEWS).exists() else 0
    name = Path(command.made)
    for partial in (folder / f"{name.stem}.partial.mcap", folder / f"{name}.partial" / name):
        if command.words[0] == "record" and partial.exists():
            try:
                kept = read_recording(partial)
            except LogError as error:
                return f"{counted} views were written, and {error}" if counted else None
            views = read_recording(whole).views
            if kept.complete and len(kept.views) < len(views):
                return f"{partial.name} passes as whole"
            if len(kept.views) < counted:
                return f"{counted} views were written, {len(kept.views)} are there"
            if any(abs(one.time - other.time) > 1e-6 for one, other in zip(kept.views, views, strict=False)):
                return f"{partial.name} holds other views"
            return None
    lost = counted and command.words[0] == "record"
    return f"{counted} views were written, and none is there" if lost else None


def _register(name: str) -> None:
    """Attacks on one command: kills and full disks."""

    def killed(seed: int, folder: Path) -> str | None:
        return _stopped(name, seed, folder, _kill)

    def full(seed: int, folder: Path) -> str | None:
        made = undisturbed(name).after / COMMANDS[name].made
        size = max(path.stat().st_size for path in ([made] if made.is_file() else made.iterdir()))
        return _stopped(name, seed, folder, lambda _, rng: {"full_disk": {"size": rng.randint(0, size)}})

    kept = "at most the last view is lost; " if name.startswith("record") else ""
    attack(
        name=f"kill-{name}", family="disk", tries=50, short=1 if name in ("record", "learn") else 0,
        promise=f"Killed at any moment: older files stay, or the new are whole; {kept}the next run goes well",
    )(killed)  # fmt: skip
    attack(
        name=f"full-{name}", family="disk", tries=20, short=1 if name == "record" else 0,
        promise="A disk that is full at any byte: one line, older files stay to the bit, and it can be run again",
    )(full)  # fmt: skip


for _name in COMMANDS:
    _register(_name)


@attack(
    family="disk",
    promise="A drive that SIGTERM ends lies beside the older one, incomplete, with every view that was written",
    tries=50,
    short=0,
)
def interrupted_record(seed: int, folder: Path) -> str | None:
    """Interrupt it at any time."""
    return _stopped(
        "record", seed, folder, lambda known, rng: {"interrupt_after": {"seconds": rng.uniform(0.0, known.seconds)}}
    )


@attack(
    family="disk",
    promise="Two commands that write one file at once both end well, and the file is that of one of them",
    tries=20,
    short=0,
)
def two_writers(seed: int, folder: Path) -> str | None:
    """Run the newer and the older command at the same time."""
    name = ("record", "record-bag", "learn", "merge", "mission")[seed % 5]
    known, command = undisturbed(name), COMMANDS[name]
    shutil.copytree(known.before, folder, dirs_exist_ok=True)
    _done(command.words, folder, {"beside": {"words": list(command.older)}})
    if left := [path.name for path in folder.iterdir() if path.name.startswith(DRAFT) or "partial" in path.name]:
        return f"they leave {left}"
    return _neither(folder / command.made, known.before / command.made, known.after / command.made)


@attack(
    family="disk",
    promise="A clock that is set back by a year half-way, and files from the future, change nothing",
    tries=20,
    short=0,
)
def clock_set_back(seed: int, folder: Path) -> str | None:
    """Set it back after some looks at it."""
    name = tuple(COMMANDS)[seed % len(COMMANDS)]
    known, command = undisturbed(name), COMMANDS[name]
    shutil.copytree(known.before, folder, dirs_exist_ok=True)
    _done(command.words, folder, {"clock_back": {"seconds": 3.15e7, "after": Random(seed).randint(0, 20)}})
    return _neither(folder / command.made, None, known.after / command.made)


@attack(
    family="disk",
    promise="A small disk that is full at any byte: one line, older files stay to the bit, and it can be run again",
    tries=20,
    short=0,
)
def full_small_disk(seed: int, folder: Path) -> str | None:
    """Mount one with a random number of free blocks."""
    name = ("record", "record-bag", "record-sqlite", "learn", "merge", "mission")[seed % 6]
    known, command = undisturbed(name), COMMANDS[name]
    disk = folder / "disk"
    disk.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=16m", "tmpfs", disk], capture_output=True, text=True, check=False
    )
    if mounted.returncode:
        raise SkipTest("only root may mount a small disk")
    try:
        shutil.copytree(known.before, disk, dirs_exist_ok=True)
        made = known.after / command.made
        size = sum(path.stat().st_size for path in ([made] if made.is_file() else made.iterdir()))
        ballast = disk / "ballast"
        free = shutil.disk_usage(disk).free
        ballast.write_bytes(bytes(max(0, free - Random(seed).randint(0, size + 8192))))
        found = run(command.words, disk, {"count_views": {"file": str(folder / VIEWS)}})
        if found.code not in (0, 2) or (found.code and len(found.err.splitlines()) != 1):
            return f"ended with {found.code}: {found.err[-300:]!r}"
        if fell := _neither(disk / command.made, known.before / command.made, made):
            return fell
        ballast.unlink()
        _done(command.words, disk)
        return _neither(disk / command.made, None, made)
    finally:
        subprocess.run(["umount", "-l", disk], check=False)


# --- campaigns ---

CAMPAIGN = ("scenario", "run", SCENARIO, "--cache", CACHE, "-o", RESULTS)
HERE_ALONE: Arms = {"in_one_process": {}}


@cache
def _campaign() -> tuple[Undisturbed, dict[str, str]]:
    """The undisturbed campaign, and the fingerprints of all that it makes."""
    before, after = _scratch() / "campaign" / "before", _scratch() / "campaign" / "after"
    before.mkdir(parents=True)
    for scene in (ROOM, SCENARIO):
        shutil.copy(HERE / "scenes" / scene, before)
    shutil.copytree(before, after)
    began = time.monotonic()
    _done(CAMPAIGN, after, {**HERE_ALONE, "count_changes": {"file": CHANGES}})
    seconds, changes = time.monotonic() - began, (after / CHANGES).stat().st_size
    return Undisturbed(before, after, changes, seconds), fingerprints(after)


@attack(
    family="disk",
    promise="A campaign that is killed at any moment, with nothing stored, drives stored, or all, is gone on with",
    tries=50,
    short=0,
)
def kill_campaign(seed: int, folder: Path) -> str | None:
    """Kill it, look into the store and the results, and run it again."""
    known, prints = _campaign()
    shutil.copytree(known.before, folder, dirs_exist_ok=True)
    if stored := (None, (".mcap",), (".mcap", ".refseq"))[seed % 3]:
        shutil.copytree(known.after / RESULTS, folder / RESULTS)
        (folder / CACHE).mkdir()
        for path in (known.after / CACHE).iterdir():
            if path.suffix in stored:
                shutil.copy(path, folder / CACHE)
    found = run(CAMPAIGN, folder, {**HERE_ALONE, **_kill(known, Random(seed))})
    if found.code > 0:
        return f"ended with {found.code}: {found.err[-300:]!r}"
    if fell := _half_stored(folder, known.after):
        return fell
    _done(CAMPAIGN, folder, HERE_ALONE)
    return _unlike(folder, prints)


def _half_stored(folder: Path, whole: Path) -> str | None:
    store = Store(folder / CACHE)
    for path in (folder / CACHE).iterdir():
        if path.suffix in ENDS and not store.has(path.stem, path.suffix):
            return f"{path.name} is stored half"
        if path.suffix == ".mcap" and path.read_bytes() != (whole / CACHE / path.name).read_bytes():
            return f"{path.name} is another drive"
    if (folder / RESULTS / RESULT).exists():
        read_result(folder / RESULTS)
    return None


def _unlike(folder: Path, prints: dict[str, str]) -> str | None:
    found = fingerprints(folder)
    if odd := sorted(name for name in {*found, *prints} if found.get(name) != prints.get(name)):
        return f"the next run makes another {odd[0]}"
    left = [path.name for path in (folder / CACHE).iterdir() if path.name.startswith(DRAFT)]
    return f"the next run leaves {left}" if left else None


@attack(
    family="disk",
    promise="Two campaigns on one cache at once both end well, and make the same",
    tries=10,
    short=0,
)
def two_campaigns(seed: int, folder: Path) -> str | None:
    """Run the same twice at once, with results of their own."""
    known, prints = _campaign()
    shutil.copytree(known.before, folder, dirs_exist_ok=True)
    others = [*CAMPAIGN[:-1], "others"]
    _done(CAMPAIGN, folder, {**HERE_ALONE, "beside": {"words": others}})
    fell = _unlike(folder, prints)
    shutil.rmtree(folder / RESULTS)
    (folder / "others").rename(folder / RESULTS)
    return fell or _unlike(folder, prints)
