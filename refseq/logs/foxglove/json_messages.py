"""Foxglove's messages in JSON: as Protobuf's of the same schema, or the first field that makes them none, in words."""

import json
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from typing import Any

from google.protobuf import json_format  # type: ignore[import-untyped]
from google.protobuf.descriptor import FieldDescriptor  # type: ignore[import-untyped]

from refseq.errors import LogError
from refseq.limits import JSON_BYTES
from refseq.logs.decoding.unpacking import translating

TIMESTAMP, DURATION = "google.protobuf.Timestamp", "google.protobuf.Duration"
LONGEST = 60
"""Characters of a value that are told."""
STAMP = 'an object with "sec" and "nsec", or a text as 2026-01-31T12:00:00Z'
VALID = {
    FieldDescriptor.TYPE_STRING: "a text",
    FieldDescriptor.TYPE_BYTES: "a text in Base64",
    FieldDescriptor.TYPE_BOOL: "true or false",
    FieldDescriptor.TYPE_ENUM: "a whole number of its schema",
    FieldDescriptor.TYPE_DOUBLE: "a number",
    FieldDescriptor.TYPE_FLOAT: "a number",
}
"""Valid values of a field that is neither a whole number nor a message, by its type."""


def from_json(own: Callable[[bytes], Any]) -> Callable[[bytes], Any]:
    """Decode JSON by way of the Protobuf schema of the same name, which says what each field must be."""

    def decode(data: bytes) -> Any:
        JSON_BYTES.check(len(data), "a message has")
        try:
            # Python's own writer has Infinity and NaN without quotes: as text they are Protobuf's.
            told = json.loads(data, parse_constant=str)
        except (ValueError, RecursionError) as error:
            at = f" from character {error.pos + 1} on" if isinstance(error, json.JSONDecodeError) else ""
            raise LogError(f"its bytes are no JSON{at}") from error
        if not isinstance(told, dict):
            raise LogError(f"its JSON is {_shown(told)} and no object")
        with translating(lambda _: LogError(_wrong_field(told, own(b"")) or "its JSON does not fit the schema")):
            return json_format.ParseDict(_as_protobuf(told), own(b""), ignore_unknown_fields=True)

    return decode


def _as_protobuf(value: Any) -> Any:
    """Foxglove's JSON in Protobuf's: times are strings there, and no number (null) is NaN."""
    match value:
        case {"sec": int() as seconds, "nsec": int() as nanoseconds}:
            whole = datetime.fromtimestamp(seconds, UTC).strftime("%Y-%m-%dT%H:%M:%S")
            return f"{whole}.{nanoseconds:09d}Z"
        case dict():
            return {key: _as_protobuf(inner) for key, inner in value.items() if inner is not None}
        case list():
            return ["NaN" if inner is None else _as_protobuf(inner) for inner in value]
    return value


def _wrong_field(told: dict[str, Any], message: Any, place: str = "") -> str:
    """A sentence on the first field of JSON that does not fit an empty message; empty where all do by themselves."""
    fields = {name: one for one in message.DESCRIPTOR.fields for name in (one.name, one.json_name)}
    for name, value in told.items():
        if name not in fields or _fits({name: value}, message):
            continue
        described, at, name = fields[name], f"{place}{name}", fields[name].name
        if described.message_type is None or described.message_type.full_name in (TIMESTAMP, DURATION):
            return _wrong_value(described, value, message, name, at)
        many = _is_repeated(message, name)
        inner = value if many and isinstance(value, list) else [value]
        for number, one in enumerate(inner):
            where = f"{at}[{number}]" if inner is value else at
            if not isinstance(one, dict):
                return f"its {where} is {_shown(one)}; valid is an object"
            empty = getattr(message, name).add() if many else getattr(message, name)
            if why := _wrong_field(one, type(empty)(), f"{where}."):
                return why
        return f"its {at} is {_shown(value)}"
    return ""


def _wrong_value(described: Any, value: Any, message: Any, name: str, at: str) -> str:
    """The sentence on a field that is no message, or a list of such."""
    valid = VALID.get(described.type, "a whole number") if described.message_type is None else STAMP
    if not _is_repeated(message, name):
        return f"its {at} is {_shown(value)}; valid is {valid}"
    if not isinstance(value, list):
        return f"its {at} is {_shown(value)}; valid is a list, of which each is {valid}"
    bad = _first_unfit(value, lambda part: _fits({name: part}, message))
    return f"its {at}[{bad}] is {_shown(value[bad])}; valid is {valid}"


def _is_repeated(message: Any, name: str) -> bool:
    """Tell whether a field is a list; versions of the library describe it in different ways."""
    return hasattr(getattr(message, name), "extend")


def _first_unfit(values: Sequence[Any], fit: Callable[[Sequence[Any]], bool]) -> int:
    """Index of the first value that makes a list unfit, by halves: a scan may have thousands."""
    low, high = 0, len(values)  # the first ``low`` fit, the first ``high`` do not
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if fit(values[:middle]) else (low, middle)
    return low


def _fits(told: dict[str, Any], message: Any) -> bool:
    try:
        json_format.ParseDict(_as_protobuf(told), type(message)(), ignore_unknown_fields=True)
    except Exception:  # whatever it raises for what nobody has written: see ``translating``
        return False
    return True


def _shown(value: Any) -> str:
    """A value as JSON, cut short."""
    try:
        written = json.dumps(value, ensure_ascii=False)
    except RecursionError:
        return "nested too deep"
    return written if len(written) <= LONGEST else f"{written[: LONGEST - 1]}…"
