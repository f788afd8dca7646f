"""Load a floor plan from TOML; every mistake in it becomes one line that says what to write instead."""

import re
import types
import typing
from functools import cache, lru_cache
from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from refseq_bench.text_file import TextFileError, parse_toml, read_text
from refseq_bench.worlds.errors import PlanError, UnknownWorldError
from refseq_bench.worlds.plans.building import building
from refseq_bench.worlds.plans.dials import AS_DRAWN, Dials, parse_dials
from refseq_bench.worlds.plans.generate import corridor
from refseq_bench.worlds.plans.rules import checked, short
from refseq_bench.worlds.plans.schema import FloorPlan

DIGITS = 18
"""Digits that a world's seed may have: such numbers fit 64 bits."""
MODELS = (".xml", ".mjcf", ".urdf", ".sdf", ".usd", ".obj", ".stl", ".ply", ".dae", ".gltf", ".glb", ".ifc", ".dxf")
"""Endings of buildings as other programs keep them."""
MADE = 64
"""So many of the plans that were made from a seed last are kept: 0.1 MB each."""


def world_names() -> tuple[str, ...]:
    """Return the worlds that come with this package."""
    library = resources.files("refseq_bench.worlds") / "library"
    return tuple(sorted(Path(f.name).stem for f in library.iterdir() if f.name.endswith(".toml")))


def load_plan(name_or_path: str | Path) -> FloorPlan:
    """Read a world of the library by its name, or a plan file by its path (one that ends in ``.toml``).

    ``corridor:SEED`` and ``building:SEED`` are worlds that are made from a seed, with ``Dials`` behind: ``,width=2``.

    Raises ``PlanError`` with one line: file, key, value and what is valid; ``UnknownWorldError`` for another name.
    """
    path = Path(name_or_path)
    if path.suffix == ".toml":
        return parse_plan(_read(path), str(name_or_path))
    if made := re.fullmatch(rf"(corridor|building):(\d{{1,{DIGITS}}})(?:,(.*))?", str(name_or_path), re.ASCII):
        dials = AS_DRAWN if made[3] is None else parse_dials(made[3], str(name_or_path))
        return _made(made[1], int(made[2]), dials, str(name_or_path))
    name, turned, _ = str(name_or_path).partition(",")
    if turned and name in world_names():
        raise PlanError(
            f"world '{name_or_path}': it has no dials; valid are they behind corridor:SEED and building:SEED"
        )
    if path.suffix.lower() in MODELS:
        raise PlanError(
            f"{name_or_path}: is a model ({path.suffix}), which is not read; valid is a floor plan in TOML (.toml), as "
            "`refseq world generate` writes one to go on with"
        )
    if str(name_or_path) not in world_names():
        known = (
            f"{', '.join(world_names())}, corridor:SEED, building:SEED (a whole number from 0, {DIGITS} digits at most)"
        )
        raise UnknownWorldError(f"unknown world '{name_or_path}'; known are {known}, or a path ending in .toml")
    return _of_library(f"{name_or_path}.toml")


def written_ns(name_or_path: str | Path) -> int:
    """When a plan file was last written [ns], 0 for a world that is no file: part of the key of what is kept of it."""
    path = Path(name_or_path)
    return path.stat().st_mtime_ns if path.suffix == ".toml" and path.is_file() else 0


@lru_cache(maxsize=MADE)
def _made(kind: str, seed: int, dials: Dials, name: str) -> FloorPlan:
    """Make a plan from its seed, once for the many drives that a campaign has in it."""
    make = corridor if kind == "corridor" else building
    return checked(make(seed, dials), name)


@cache
def _of_library(file: str) -> FloorPlan:
    """Read a plan that comes with this package, once: plans are frozen, and a campaign asks for the same few."""
    return parse_plan((resources.files("refseq_bench.worlds") / "library" / file).read_text(encoding="utf-8"), file)


def parse_plan(text: str, file: str = "plan.toml") -> FloorPlan:
    """Turn the text of a plan into a checked plan; ``file`` is what the errors call it."""
    try:
        plan = FloorPlan.model_validate(parse_toml(text))
    except TextFileError as error:
        raise PlanError(f"{file}: {error}") from None
    except ValidationError as error:
        raise PlanError(f"{file}: {_first(error)}") from None
    return checked(plan, file)


def _read(path: Path) -> str:
    try:
        return read_text(path)
    except TextFileError as error:
        raise PlanError(f"{path}: {error}") from None


# --- the schema's own complaints, in our words ---


def _first(error: ValidationError) -> str:
    first = _first_of(error)
    where, value = _key(first["loc"]), short(first["input"])
    match first["type"]:
        case "extra_forbidden":
            valid = ", ".join(_valid_keys(first["loc"][:-1]))
            return f"{where}: unknown key; valid keys are {valid}"
        case "missing":
            return f"{where}: missing; it is required"
        case "value_error":
            return f"{where}: {value} is not valid; it should be {first['ctx']['error']}"
    return f"{where}: {value} is not valid; it should be {_valid_words(first)}"


def _first_of(error: ValidationError) -> ErrorDetails:
    """The first finding; of a key that is missing, the unknown one beside it that was probably meant."""
    found = error.errors()
    first = found[0]
    beside = (one for one in found if one["type"] == "extra_forbidden" and one["loc"][:-1] == first["loc"][:-1])
    return next(beside, first) if first["type"] == "missing" else first


def _valid_words(found: ErrorDetails) -> str:
    """What would have been valid, behind 'it should be'."""
    told = found.get("ctx", {})
    match found["type"]:
        case "too_short":
            return f"a list of {told['min_length']} or more"
        case "too_long":
            return f"a list of {told['max_length']} at most"
        case "tuple_type" if isinstance(found["input"], dict):
            return f"one of several tables: [[{found['loc'][-1]}]] in place of [{found['loc'][-1]}]"
        case "tuple_type":
            return "a list in brackets"
        case "string_pattern_mismatch":
            return "letters, digits, points, dashes and underscores, a letter or digit first"
    reason = found["msg"].removeprefix("Input should be ").removeprefix("String should ")
    return f"{reason[0].lower()}{reason[1:]}"


def _key(loc: tuple[int | str, ...]) -> str:
    key = ""
    for part in loc:
        key += f"[{part}]" if isinstance(part, int) else f".{part}"
    return key.removeprefix(".").removesuffix(".[key]")


def _valid_keys(loc: tuple[int | str, ...]) -> tuple[str, ...]:
    """Walk the schema down to the table at ``loc`` and return its keys."""
    kind: Any = FloorPlan
    for part in loc:
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            kind = kind.model_fields[str(part)].annotation
        else:
            kind = _held(kind)
        if isinstance(kind, types.UnionType):
            kind = _held(kind)
    return tuple(kind.model_fields)


def _held(kind: Any) -> Any:
    """The table that is held by a tuple or dict of them, or by a table or None."""
    return next(a for a in reversed(typing.get_args(kind)) if a not in (..., types.NoneType))
