"""Heads of messages: JSON objects read into frozen dataclasses, every value checked by its field's type."""

import json
import types
from dataclasses import asdict, fields, is_dataclass
from functools import cache
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

from refseq.errors import RefseqError

Head = TypeVar("Head")


class MessageError(RefseqError):
    """A message from another module cannot be used."""


def head_bytes(head: Any) -> bytes:
    """A dataclass in JSON; numbers read back are the same to the last bit."""
    return json.dumps(asdict(head)).encode()


def read_head(kind: type[Head], data: bytes) -> Head:
    """Read a dataclass. Raises ``MessageError`` for what is none."""
    try:
        return _read(kind, json.loads(data))
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        raise MessageError(f"a message is no {kind.__name__}: {str(error)[:200]}") from error


@cache
def _types(kind: type[Any]) -> dict[str, Any]:
    hints = get_type_hints(kind)
    return {field.name: hints[field.name] for field in fields(kind)}


def _read(kind: type[Head], told: Any) -> Head:
    wanted = _types(kind)  # type: ignore[arg-type]  # a class can be hashed
    if not isinstance(told, dict) or set(told) != set(wanted):
        raise ValueError(f"it has not the keys {', '.join(wanted)}")
    return kind(**{name: _value(what, told[name], name) for name, what in wanted.items()})


def _value(what: Any, value: Any, name: str) -> Any:
    """A value as its type, which is a plain one, a dataclass, ``X | None``, or a tuple of one type."""
    if isinstance(what, types.UnionType):
        return None if value is None else _value(get_args(what)[0], value, name)
    if get_origin(what) is tuple:
        return tuple(_value(get_args(what)[0], one, name) for one in value)
    if is_dataclass(what) and isinstance(what, type):
        return _read(what, value)
    if what is float and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    if type(value) is not what:
        raise ValueError(f"{name} is {value!s:.40}, no {what.__name__}")
    return value
