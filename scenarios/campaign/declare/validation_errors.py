"""Tell pydantic's first finding about a scenario in one line: the key, what is valid there, and what was given."""

from collections.abc import Mapping, Sequence
from dataclasses import fields

from pydantic import BaseModel, ValidationError

from refseq_bench.scenarios.campaign.declare.schema import Declared, DriveTable, ImagesTable, LogTable, TriggerTable
from refseq_bench.sim.bench.faults import FAULTS
from refseq_bench.sim.drives.signal_faults import SignalFault

Location = Sequence[int | str]

SIDES = ("reference", "query", "further")
SOURCES: Mapping[str, type[BaseModel]] = {"drive": DriveTable, "log": LogTable, "images": ImagesTable}
UNKNOWN = ("extra_forbidden", "unexpected_keyword_argument")
LONGEST = 60
"""Characters of what was given that are told."""


def first_error(error: ValidationError, model: type[Declared]) -> str:
    """The first of pydantic's findings about a ``model`` in one line."""
    first = error.errors()[0]
    where, context = _written(first["loc"]), first.get("ctx", {})
    if first["type"] in UNKNOWN:
        return f"{where}: is not known here; valid are {', '.join(_valid(first['loc'], model))}"
    if first["type"] in ("missing", "union_tag_not_found"):
        return f"{where}: {'kind ' if first['type'] != 'missing' else ''}is missing"
    if first["type"] == "union_tag_invalid":
        return f"{where}: kind {context['tag']!r} is unknown; valid are {context['expected_tags']}"
    if first["type"] == "tuple_type":
        return f"{where} = {_told(first['input'])} is not valid; it should be a list in brackets"
    if first["type"] == "too_short":
        return f"{where} holds too little; it should be a list of {context['min_length']} or more"
    if first["type"] == "value_error":
        return f"{where}: {context['error']}"
    return f"{where} = {_told(first['input'])} is not valid: {first['msg'][0].lower()}{first['msg'][1:]}"


def _told(value: object) -> str:
    given = repr(value)
    return given if len(given) <= LONGEST else given[:LONGEST] + "..."


def _written(loc: Location) -> str:
    """A location as the file's path: pydantic puts in which kind of table it took something for."""
    kept = [part for at, part in enumerate(loc) if not _is_kind(loc, at)]
    # A key may be any text, line breaks among it.
    return ".".join(str(part) if str(part).isprintable() else repr(part) for part in kept)


def _is_kind(loc: Location, at: int) -> bool:
    if not loc or loc[0] not in SIDES:
        return False
    at -= loc[0] == "further"  # a list of sources: behind its name stands which
    inside = list(loc)[1 + (loc[0] == "further") :]
    return at == 1 or (at == 4 and inside[1] == "faults")


def _valid(loc: Location, model: type[Declared]) -> tuple[str, ...]:
    """Keys of the table that holds a location's last one."""
    match list(loc[:-1]):
        case []:
            return (*model.model_fields, "vary")
        case ["further", int(), *inside] | ["reference" | "query", *inside]:
            return _valid_of_source(inside)
        case ["localise", "signal_faults", int()]:
            return tuple(field.name for field in fields(SignalFault))
        case [str(table), *inside]:
            return _valid_of_table(model.model_fields[table].annotation, inside)
    return ()


def _valid_of_table(table: object, inside: Location) -> tuple[str, ...]:
    """Keys of a table, or of the one in it that is ``inside``."""
    for name in inside:
        field = getattr(table, "model_fields", {}).get(name)
        table = field.annotation if field else None
    return tuple(getattr(table, "model_fields", ()))


def _valid_of_source(inside: Location) -> tuple[str, ...]:
    match list(inside):
        case [str(kind)]:
            return tuple(SOURCES[kind].model_fields)
        case [_, "trigger"]:
            return tuple(TriggerTable.model_fields)
        case [_, "faults", _, str(kind)]:
            return next(tuple(keys) for keys in map(_fault_keys, FAULTS) if keys["kind"] == kind)
    return ()


def _fault_keys(fault: type) -> dict[str, object]:
    """A fault's keys and what they are by default, its kind among them."""
    return {field.name: field.default for field in fields(fault)}
