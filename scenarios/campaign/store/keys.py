"""Keys of what a campaign keeps: equal only for what was made alike, by the same code and packages."""

import hashlib
import json
from functools import cache

from refseq_bench.scenarios.imports.closure import closure_of

LENGTH = 24
"""Hexadecimal digits of a key: 96 bits, so that no two things will ever have the same by chance."""


def key_of(*parts: object) -> str:
    """Key of some values that JSON can hold; enumerations and paths count by their text."""
    text = json.dumps(parts, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:LENGTH]


@cache
def code_digest(*modules: str, alone: tuple[str, ...] = ()) -> str:
    """Digest of all code, data and packages that some modules can reach, and of those ``alone`` without their imports.

    It is made once a process.
    """
    return closure_of(*modules, alone=alone).digest[:LENGTH]
