"""Variations: one scenario file as many cases.

``[vary.grid]`` maps keys to lists, and every combination is a case; ``[[vary.list]]`` is a table of values a case, with
a ``name`` where the values are too long for one; ``[vary.random]`` draws ``count`` cases from a ``seed``, each key from
``{from, to}`` (numbers, or hours as "08:00") or ``{of}``. A key is a path into the file: ``"query.light"``.
"""

import itertools
import re
from collections.abc import Iterator, Mapping, Sequence
from copy import deepcopy
from typing import Any

import numpy as np

from scenarios.errors import ScenarioError

KINDS = ("grid", "list", "random")
MOST = 1000
"""Cases that one file may make."""
_CLOCK = re.compile(r"(\d{1,2}):(\d{2})")

Values = Mapping[str, Any]
"""Values by their keys, which are paths into the file."""


def variations(vary: Any) -> list[tuple[str, Values]]:
    """The cases of a ``vary`` table: a name and the values of each; one without name or values for no table at all.

    Raises ``ScenarioError``.
    """
    if vary is None:
        return [("", {})]
    if not isinstance(vary, dict) or len(vary) != 1 or next(iter(vary)) not in KINDS:
        keys = ", ".join(vary) if isinstance(vary, dict) else repr(vary)
        raise ScenarioError(f"vary: {keys or 'nothing'} is not valid; it should be one of {', '.join(KINDS)}")
    kind, content = next(iter(vary.items()))
    cases = list({"grid": _grid, "list": _list, "random": _random}[kind](content))
    names = [name for name, _ in cases]
    for name in names:
        if names.count(name) > 1:
            raise ScenarioError(f"vary.{kind}: two cases are called {name!r}; valid are names that differ")
    if not 0 < len(cases) <= MOST:
        raise ScenarioError(f"vary.{kind} makes {len(cases)} cases; valid are 1 to {MOST}")
    return cases


def _grid(content: Any) -> Iterator[tuple[str, Values]]:
    if not isinstance(content, dict) or not all(isinstance(value, list) and value for value in content.values()):
        raise ScenarioError("vary.grid: valid is a list of values for each key")
    for values in itertools.product(*content.values()):
        yield _named(dict(zip(content, values, strict=True)))


def _list(content: Any) -> Iterator[tuple[str, Values]]:
    if not isinstance(content, list) or not all(isinstance(case, dict) for case in content):
        raise ScenarioError("vary.list: valid is [[vary.list]], a table a case")
    for case in content:
        values = {key: value for key, value in case.items() if key != "name"}
        yield (str(case["name"]), values) if "name" in case else _named(values)


def _random(content: Any) -> Iterator[tuple[str, Values]]:
    if not isinstance(content, dict):
        raise ScenarioError("vary.random: valid is a table with count, seed and keys")
    count, seed = (_whole(content, key) for key in ("count", "seed"))
    ranges = {key: value for key, value in content.items() if key not in ("count", "seed")}
    rng = np.random.default_rng(seed)
    for number in range(count):
        yield f"random-{number + 1}", {key: _drawn(key, value, rng) for key, value in ranges.items()}


def _whole(content: Mapping[str, Any], key: str) -> int:
    value = content.get(key)
    if not isinstance(value, int) or isinstance(value, bool) or value < 0:
        raise ScenarioError(f"vary.random.{key} = {value!r} is not valid; it should be a whole number")
    return value


def _drawn(key: str, given: Any, rng: np.random.Generator) -> Any:
    """A value from a range of numbers or hours, or one of several."""
    match given:
        case {"of": [_, *_] as choices, **rest} if not rest:
            return choices[int(rng.integers(len(choices)))]
        case {"from": str(low), "to": str(high), **rest} if not rest and _minutes(low, high):
            first, last = (int(minutes) for minutes in _minutes(low, high))
            hour, minute = divmod(int(rng.integers(first, last + 1)), 60)
            return f"{hour:02d}:{minute:02d}"
        case {"from": int() | float() as low, "to": int() | float() as high, **rest} if not rest and low <= high:
            return round(float(rng.uniform(low, high)), 3)
    raise ScenarioError(f"vary.random.{key} = {given!r} is not valid; it should be {{from, to}} or {{of = [...]}}")


def _minutes(*clocks: str) -> tuple[int, ...]:
    """Clock times in minutes, none where one is no clock time or they do not rise."""
    found = [_CLOCK.fullmatch(clock) for clock in clocks]
    minutes = tuple(60 * int(one[1]) + int(one[2]) for one in found if one)
    return minutes if len(minutes) == len(clocks) and list(minutes) == sorted(minutes) else ()


def _named(values: Values) -> tuple[str, Values]:
    """A case named after its values."""
    return ",".join(_word(value) for value in values.values()), values


def _word(value: Any) -> str:
    return "+".join(_word(one) for one in value) if isinstance(value, list) else str(value)


def put(table: Mapping[str, Any], values: Values) -> dict[str, Any]:
    """The table of a file with other values. Raises ``ScenarioError`` for a key that leads through no table."""
    changed: dict[str, Any] = deepcopy(dict(table))
    for key, value in values.items():
        *path, last = key.split(".")
        inner = changed
        for part in path:
            inner = inner.setdefault(part, {})
            if not isinstance(inner, dict):
                raise ScenarioError(f"vary: key {key!r} leads through {part!r}, which is no table")
        inner[last] = value
    return changed


def merged(reference: Mapping[str, Any], query: Mapping[str, Any], alone: Sequence[str]) -> dict[str, Any]:
    """A query's table: what it does not say is as in the reference's, but for the keys that each has ``alone``."""
    return {**{key: value for key, value in reference.items() if key not in alone}, **query}
