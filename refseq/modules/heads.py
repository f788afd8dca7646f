"""Parts of messages, and their heads: JSON objects read into frozen dataclasses, every value checked by its type."""

import json
from collections.abc import Callable
from dataclasses import asdict
from functools import cache
from typing import Any, TypeVar

from pydantic import TypeAdapter, ValidationError

from refseq.errors import RefseqError

Head = TypeVar("Head")
_reader: Callable[..., TypeAdapter[Any]] = cache(TypeAdapter)

Parts = list[tuple[str, bytes]]
"""A message: the names of its parts and their bytes."""


class MessageError(RefseqError):
    """A message from another module cannot be used."""


class MissingError(MessageError):
    """A message came before one that its publisher keeps for those who come late; to ask for them again may mend it."""


def head_bytes(head: Any) -> bytes:
    """A dataclass in JSON; numbers read back are the same to the last bit."""
    return json.dumps(asdict(head)).encode()


def read_head(kind: type[Head], data: bytes) -> Head:
    """Read a dataclass. Raises ``MessageError`` for what is none."""
    try:
        found: Head = _reader(kind).validate_json(data, strict=True)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(map(str, first["loc"]))
        raise MessageError(f"a message is no {kind.__name__}: {where or 'all'}: {first['msg'][:200]}") from error
    return found
