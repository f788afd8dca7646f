"""Files that people write, TOML among them: read only as far as they are files of a sensible size and depth.

All rooms of the bench read such files through here, so that each mistake is found once and told alike.
"""

import datetime
import json
import os
import re
import stat
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

LONGEST_TEXT = 2**20
"""Length of a file that a person writes [bytes]; the largest world of the library has 30 thousand."""
DEEPEST = 32
"""Tables and arrays in each other; the deepest of the bench are 6."""

_PART = r"""(?:(?<![\w-])[\w-]++|"(?:[^"\\\n]|\\.)*+"|'[^'\n]*+')[ \t]*+"""
_LONG_KEY = re.compile(rf"(?:{_PART}\.[ \t]*+){{{DEEPEST}}}")
"""A key of so many parts: ``tomllib`` takes time that grows with the square of their number."""


class TextFileError(ValueError):
    """A file cannot be read: the message says why, in one line, without the file's name."""


def read_text(path: Path) -> str:
    """Read a file of text, without the byte order mark that Windows begins it with.

    Raises ``TextFileError`` for what is no file, is too long, or no UTF-8.
    """
    try:
        content = _start_of(path)
        if len(content) > LONGEST_TEXT:
            raise TextFileError(f"cannot be read: is longer than {LONGEST_TEXT} bytes, the most that is valid")
        return content.decode("utf-8-sig")
    except OSError as error:
        raise TextFileError(f"cannot be read: {error.strerror or error}") from None
    except UnicodeDecodeError:
        raise TextFileError("cannot be read: not UTF-8 text") from None


def _start_of(path: Path) -> bytes:
    """One byte more than may be read, of a file alone: a pipe that nobody writes to would wait for ever."""
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise TextFileError("cannot be read: is no file")
    with os.fdopen(descriptor, "rb") as file:
        return file.read(LONGEST_TEXT + 1)


def parse_toml(text: str) -> dict[str, Any]:
    """Read TOML.

    Raises ``TextFileError`` for what is none, is deeper than ``DEEPEST``, or has a whole number of more than 64 bits.
    """
    too_deep = TextFileError(f"tables or arrays are more than {DEEPEST} deep in each other")
    if _LONG_KEY.search(text):
        raise too_deep
    try:
        content = tomllib.loads(text)
    except RecursionError:
        raise too_deep from None
    except ValueError as error:  # tomllib's own, and Python's for a number of more digits than it reads
        raise TextFileError(f"is no TOML: {' '.join(str(error).split())}") from None
    layer: list[Any] = [content]
    for _ in range(DEEPEST + 1):
        if any(isinstance(one, int) and not -(2**63) <= one < 2**63 for one in layer):
            raise TextFileError("a whole number has more than 64 bits")
        inner = [one.values() if isinstance(one, dict) else one for one in layer if isinstance(one, dict | list)]
        layer = [value for values in inner for value in values]
    if layer:
        raise too_deep
    return content


def read_toml(path: Path) -> dict[str, Any]:
    """Read a file of TOML. Raises ``TextFileError`` as ``read_text`` and ``parse_toml`` do."""
    return parse_toml(read_text(path))


# --- writing ---


def toml_value(value: Any) -> str:
    """A value as TOML has it; tables stand in one line."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{toml_key(k)} = {toml_value(v)}" for k, v in value.items()) + " }"
    if is_list(value):
        return "[" + ", ".join(toml_value(one) for one in value) + "]"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")  # the one that JSON leaves as it is
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, datetime.date):
        return value.isoformat()
    return repr(value)


def toml_lines(table: Mapping[str, Any]) -> str:
    """A table's keys, a line each."""
    return "".join(f"{toml_key(key)} = {toml_value(value)}\n" for key, value in table.items())


def toml_key(key: str) -> str:
    """A key, in quotes where it has a point."""
    return json.dumps(key) if "." in key else key


def is_list(value: Any) -> bool:
    """True of what TOML writes in brackets."""
    return isinstance(value, Sequence) and not isinstance(value, str)
