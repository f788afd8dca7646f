"""Variations: one scenario file as many cases.

``[vary.grid]`` maps keys to lists, and every combination is a case; ``[[vary.list]]`` is a table of values a case, with
a ``name`` where the values are too long for one; ``[vary.random]`` draws ``count`` cases from a ``seed``, each key from
``{from, to}`` (numbers, or hours as "08:00") or ``{of}``. A list and a grid together are every case of the list at
every combination of the grid. A key is a path into the file: ``"query.light"``.
"""

import itertools
import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from copy import copy
from typing import Any

import numpy as np

from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.worlds.light import clock_text

KINDS = ("grid", "list", "random")
VALID = (*({kind} for kind in KINDS), {"list", "grid"})
MOST = 1000
"""Cases that one file may make."""
LONGEST = 100
"""Characters that a case's name may have."""
_CLOCK = re.compile(r"([01]?\d|2[0-3]):([0-5]\d)", re.ASCII)

Values = Mapping[str, Any]
"""Values by their keys, which are paths into the file."""


def expanded(vary: Any) -> list[tuple[str, Values]]:
    """The cases of a ``vary`` table: a name and the values of each; one without name or values for no table at all.

    Raises ``ScenarioError``.
    """
    if vary is None:
        return [("", {})]
    if not isinstance(vary, dict) or set(vary) not in VALID:
        keys = ", ".join(vary) if isinstance(vary, dict) else repr(vary)
        valid = ", ".join(KINDS)
        raise ScenarioError(f"vary: {keys or 'nothing'} is not valid; it should be one of {valid}, or list and grid")
    kind = " and ".join(vary)
    # One more than may be: a grid of ten keys is told, not built.
    cases = list(itertools.islice(_made(vary), MOST + 1))
    if not 0 < len(cases) <= MOST:
        made = f"more than {MOST}" if cases else "no"
        raise ScenarioError(f"vary.{kind} makes {made} cases; valid are 1 to {MOST}")
    for name, count in Counter(name for name, _ in cases).items():
        if count > 1:
            raise ScenarioError(f"vary.{kind}: {count} cases are called {name!r:.60}; valid are names that differ")
        if not name or not name.isprintable() or len(name) > LONGEST:
            raise ScenarioError(
                f"vary.{kind}: a case is called {name!r:.60}; valid is a name in one line of {LONGEST} characters at "
                "most, as [[vary.list]] can give it one"
            )
    return cases


def _made(vary: Mapping[str, Any]) -> Iterator[tuple[str, Values]]:
    """The cases of a valid table."""
    if len(vary) > 1:
        return _crossed(_list(vary["list"]), _grid(vary["grid"]))
    kind, content = next(iter(vary.items()))
    return {"grid": _grid, "list": _list, "random": _random}[kind](content)


def _grid(content: Any) -> Iterator[tuple[str, Values]]:
    if not isinstance(content, dict) or not content:
        raise ScenarioError('vary.grid: names no key; valid is a list of values for each key, as "query.light" = [...]')
    for key, values in content.items():
        if not isinstance(values, list) or not values:
            raise ScenarioError(f"vary.grid.{key} = {values!r:.60} is not valid; it should be a list of values")
    for values in itertools.product(*content.values()):
        yield _named(dict(zip(content, values, strict=True)))


def _list(content: Any) -> Iterator[tuple[str, Values]]:
    if not isinstance(content, list) or not all(isinstance(case, dict) for case in content):
        raise ScenarioError("vary.list: valid is [[vary.list]], a table a case")
    for case in content:
        values = {key: value for key, value in case.items() if key != "name"}
        name = case.get("name")
        if name is not None and not isinstance(name, str):
            raise ScenarioError(f"vary.list: name = {name!r} is not valid; it should be a text")
        yield _named(values) if name is None else (name, values)


def _crossed(
    listed: Iterator[tuple[str, Values]], combined: Iterator[tuple[str, Values]]
) -> Iterator[tuple[str, Values]]:
    """Every case of the list at every combination of the grid, named after both."""
    grid = list(itertools.islice(combined, MOST + 1))
    for first, values in listed:
        for second, others in grid:
            for key in values:
                if key in others:
                    raise ScenarioError(f"vary: key {key!r} is in list and grid; valid is one of them")
            yield f"{first},{second}", {**values, **others}


def _random(content: Any) -> Iterator[tuple[str, Values]]:
    if not isinstance(content, dict):
        raise ScenarioError("vary.random: valid is a table with count, seed and keys")
    count, seed = (_whole(content, key) for key in ("count", "seed"))
    ranges = {key: value for key, value in content.items() if key not in ("count", "seed")}
    if not ranges:
        raise ScenarioError("vary.random: names no key; valid is {from, to} or {of = [...]} for each key")
    rng = np.random.default_rng(seed)
    for number in range(count):
        yield f"random-{number + 1}", {key: _drawn(key, value, rng) for key, value in ranges.items()}


def _whole(content: Mapping[str, Any], key: str) -> int:
    value = content.get(key)
    if not isinstance(value, int) or isinstance(value, bool) or value < 0:
        raise ScenarioError(f"vary.random.{key} = {value!r} is not valid; it should be a whole number, 0 or more")
    return value


def _drawn(key: str, given: Any, rng: np.random.Generator) -> Any:
    """A value from a range of numbers or hours, or one of several."""
    match given:
        case {"of": [_, *_] as choices, **rest} if not rest:
            return choices[int(rng.integers(len(choices)))]
        case {"from": str(low), "to": str(high), **rest} if not rest and _minutes(low, high):
            first, last = (int(minutes) for minutes in _minutes(low, high))
            return clock_text(int(rng.integers(first, last + 1)) / 60)
        case {"from": int() | float() as low, "to": int() | float() as high, **rest} if not rest and _rise(low, high):
            return round(float(rng.uniform(low, high)), 3)
    raise ScenarioError(
        f"vary.random.{key} = {given!r} is not valid; it should be {{from, to}}, rising, or {{of = [...]}}"
    )


def _rise(low: float, high: float) -> bool:
    return low <= high and math.isfinite(float(high) - float(low))


def _minutes(*clocks: str) -> tuple[int, ...]:
    """Clock times in minutes, none where one is no clock time or they do not rise."""
    found = [_CLOCK.fullmatch(clock) for clock in clocks]
    minutes = tuple(60 * int(one[1]) + int(one[2]) for one in found if one)
    return minutes if len(minutes) == len(clocks) and list(minutes) == sorted(minutes) else ()


def _named(values: Values) -> tuple[str, Values]:
    """A case named after its values."""
    return ",".join(_word(value) for value in values.values()), values


def _word(value: Any) -> str:
    if isinstance(value, dict):
        return " ".join(f"{key}={_word(one)}" for key, one in value.items())
    return "+".join(_word(one) for one in value) if isinstance(value, list) else str(value)


def put(table: Mapping[str, Any], values: Values) -> dict[str, Any]:
    """The table of a file with other values, which shares with it all that stays the same.

    Raises ``ScenarioError`` for a key that leads through no table.
    """
    changed: dict[str, Any] = dict(table)
    for key, value in values.items():
        *path, last = key.split(".")
        inner: Any = changed
        for part in path:
            inner = _inside(inner, part)
            if not isinstance(inner, dict | list):
                raise ScenarioError(f"vary: key {key!r} leads through {part!r}; valid is a path through tables")
        if not isinstance(inner, dict):
            raise ScenarioError(f"vary: key {key!r} ends at {last!r}; valid is a key of a table")
        inner[last] = value
    return changed


def _inside(table: Any, part: str) -> Any:
    """A copy of what a table has under a key, or a list under a number from 0, put in its place; None: no such number.

    A key that a table does not have leads to a new table.
    """
    if isinstance(table, dict):
        table[part] = copy(table.get(part, {}))
        return table[part]
    is_number = part.isdecimal() and len(part) < 10  # a key may be any text, and a number without end is none
    if not is_number or int(part) >= len(table):
        return None
    table[int(part)] = copy(table[int(part)])
    return table[int(part)]
