"""Files that people write: worlds, scenarios, cameras, missions and decisions in TOML, by value and by character."""

import json
import math
import random
import shutil
import tomllib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from refseq_bench.scenarios.library import LIBRARY
from tests.robustness.attack import attack
from tests.robustness.attacks.cases import replays
from tests.robustness.damage import damaged_bytes, damaged_text, damaged_tree, odd_value
from tests.robustness.fuzzing import ROOT, fell
from tests.robustness.samples import samples
from tests.worlds.conftest import SMALL

Try = Callable[[Path, Path], str | None]

MISSION = """
title = "Look into the second office"
landmarks = { LA3 = "end" }
[[step]]
at = "LD"
tasks = [{ photograph = "first" }, { wait = 2.5 }]
[[step]]
at = "LA3"
do = "MT180"
timeout = 120
"""
DECISIONS = """
[[join]]
one = "first"
other = "second"
first = [2, 5]
second = [0, 3]
lengths_m = [2.5, 2.5]
joined = true
why = "a person says so"
"""
WITH_CAMERA = """
title = "A camera"
expect = ["success >= 0.5"]
[reference]
world = "hallway"
renderer = "none"
cameras = { camera-1 = "input.toml" }
"""
NESTED = ("[" * 5000, "{a=" * 5000, ".".join("a" * 5000) + " = 1", "[" + ".".join("a" * 3000) + "]", "9" * 5000)


def toml_of(value: Any) -> str:
    """A value in TOML, tables inline; what TOML has no word for comes as a text."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return repr(value) if math.isfinite(value) else {math.inf: "inf", -math.inf: "-inf"}.get(value, "nan")
    if isinstance(value, list):
        return f"[{', '.join(map(toml_of, value))}]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(str(key))} = {toml_of(one)}" for key, one in value.items()) + "}"
    return str(value) if isinstance(value, int) else json.dumps(str(value))


def _damaged(rng: random.Random, text: str) -> bytes:
    kind = rng.randrange(10)
    if kind < 6:
        table = damaged_tree(rng, tomllib.loads(text))
        return "\n".join(f"{json.dumps(str(key))} = {toml_of(value)}" for key, value in table.items()).encode()
    if kind < 8:
        return damaged_text(rng, text, ("=", '"', "[[", "]]", "{", "}", "\n", "1e999", "inf", '"""')).encode()
    if kind == 8:
        return damaged_bytes(rng, text.encode())
    at = rng.randrange(len(text))
    return (text[:at] + rng.choice(NESTED) + text[at:]).encode()


@cache
def worlds() -> tuple[str, ...]:
    """A small world, and those of the library."""
    library = [path.read_text("utf-8") for path in sorted((ROOT / "worlds" / "library").glob("*.toml"))]
    return (SMALL.format(top="", end=""), *(text for text in library if len(text) < 12_000))


@cache
def scenarios() -> tuple[str, ...]:
    """The scenarios of the library."""
    texts = [path.read_text("utf-8") for path in sorted(LIBRARY.glob("*.toml"))]
    return tuple(text for text in texts if "[reference]" in text)


@attack(family="files", promise="A damaged world is refused in one line, or shown", tries=10_000, short=10)
def damaged_world(seed: int, folder: Path) -> str | None:
    rng = random.Random(seed)
    (folder / "input.toml").write_bytes(_damaged(rng, rng.choice(worlds())))
    if rng.random() < 0.1:
        (folder / "input.toml").write_bytes(_damaged(rng, worlds()[0]))
        return fell(["world", "check", "input.toml"], folder, codes=(0, 1, 2))
    return try_world(folder / "input.toml", folder)


@replays("world")
def try_world(case: Path, folder: Path) -> str | None:
    _put(case, folder)
    return fell(["world", "show", "input.toml"], folder)


@attack(family="files", promise="A damaged scenario is refused in one line, or listed", tries=10_000, short=10)
def damaged_scenario(seed: int, folder: Path) -> str | None:
    rng = random.Random(seed)
    content = _damaged(rng, rng.choice(scenarios()))
    if rng.random() < 0.15:
        content = _varied(rng, rng.choice(scenarios())).encode()
    (folder / "input.toml").write_bytes(content)
    return try_scenario(folder / "input.toml", folder)


def _varied(rng: random.Random, text: str) -> str:
    """A scenario of many cases, each of which is large."""
    table = tomllib.loads(text)
    count = rng.choice((1, 10, 1000, 10**6, 10**12))
    keys = ["query.light", "query.start", "note", "seeds", "query.cameras", "reference", "a.b.c", "expect"]
    some = rng.sample(keys, rng.randrange(1, len(keys)))
    table["vary"] = rng.choice((
        {"grid": {key: [odd_value(rng) for _ in range(min(count, 300))] for key in some}},
        {"random": {"count": count, "seed": rng.choice((1, 2**62)), "note": {"of": ["a" * 100_000]}}},
        {"random": {"count": count, "seed": 3, **{key: {"from": 0.0, "to": 1.0} for key in some}}},
        {"list": [{"name": f"{number}", "note": "x"} for number in range(min(count, 3000))]},
    ))  # fmt: skip
    table["seeds"] = list(range(rng.choice((1, 5, 100_000))))
    return "\n".join(f"{json.dumps(key)} = {toml_of(value)}" for key, value in table.items())


@replays("scenario")
def try_scenario(case: Path, folder: Path) -> str | None:
    _put(case, folder)
    return fell(["scenario", "list", "input.toml"], folder)


@attack(family="files", promise="A damaged camera is refused in one line, or taken", tries=10_000, short=6)
def damaged_camera(seed: int, folder: Path) -> str | None:
    rng = random.Random(seed)
    library = sorted((ROOT / "sim" / "cameras" / "library").glob("*.toml"))
    (folder / "input.toml").write_bytes(_damaged(rng, rng.choice(library).read_text("utf-8")))
    return try_camera(folder / "input.toml", folder)


@replays("camera")
def try_camera(case: Path, folder: Path) -> str | None:
    _put(case, folder)
    (folder / "scenario.toml").write_text(WITH_CAMERA)
    return fell(["scenario", "list", "scenario.toml"], folder)


@attack(family="files", promise="A damaged mission's file is refused in one line, or planned", tries=10_000, short=6)
def damaged_mission_file(seed: int, folder: Path) -> str | None:
    rng = random.Random(seed)
    (folder / "input.toml").write_bytes(_damaged(rng, MISSION))
    return try_mission(folder / "input.toml", folder)


@replays("mission")
def try_mission(case: Path, folder: Path) -> str | None:
    _put(case, folder)
    shutil.copy(samples() / "thesis.refseq", folder)
    return fell(["mission", "plan", "thesis.refseq", "input.toml"], folder)


@attack(family="files", promise="Damaged decisions about joins are refused in one line", tries=10_000, short=4)
def damaged_decisions(seed: int, folder: Path) -> str | None:
    rng = random.Random(seed)
    (folder / "input.toml").write_bytes(_damaged(rng, DECISIONS))
    return try_decisions(folder / "input.toml", folder)


@replays("decisions")
def try_decisions(case: Path, folder: Path) -> str | None:
    _put(case, folder)
    for name in ("thesis.refseq", "best.refseq"):
        shutil.copy(samples() / name, folder)
    words = ["map", "merge", "thesis.refseq", "best.refseq", "-o", "whole.refseq", "--decisions", "input.toml"]
    return fell(words, folder)


def _put(case: Path, folder: Path) -> None:
    if case.parent != folder:
        shutil.copy(case, folder / "input.toml")
