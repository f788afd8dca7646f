"""Localisers that are programs of any language: a file by its path, or a folder that holds one named ``localiser``."""

import hashlib
import os
from collections.abc import Mapping
from pathlib import Path

from refseq_bench.scenarios.errors import ScenarioError

ENTRY = "localiser"
"""Name of the program in a folder, which may hold what else it reads."""
STARTS = ("./", "../", "/")
SCRIPT, BINARY = b"#!", b"\x7fELF"
"""Programs begin so that the system can start."""


def is_program(name: str) -> bool:
    """Tell whether a method's name is a path: it begins with ``./``, ``../`` or ``/``."""
    return name.startswith(STARTS)


def check_program(name: str) -> None:
    """Raise ``ScenarioError`` where there is no program that may be executed."""
    program = program_of(name)
    if not program.is_file():
        hint = f", or a folder that holds one named {ENTRY}" if not Path(name).is_dir() else f": {program}"
        raise ScenarioError(f"localiser {name!r}: there is no such program; valid is an executable file{hint}")
    if not os.access(program, os.X_OK):
        raise ScenarioError(f"localiser {name!r}: {program} is not executable; valid is a program (chmod +x)")
    with program.open("rb") as file:
        if file.read(4)[:2] not in (SCRIPT, BINARY[:2]):
            raise ScenarioError(
                f"localiser {name!r}: {program} is no program: its first line tells no interpreter; valid is a binary, "
                "or a script that begins as #!/usr/bin/env python3"
            )


def program_of(name: str) -> Path:
    """File of the program."""
    path = Path(name)
    return path / ENTRY if path.is_dir() else path


def program_files(name: str) -> Mapping[str, Path]:
    """All files that the program is made of, by their names below the folder that it is in."""
    path = Path(name)
    if not path.is_dir():
        return {path.name: path}
    return {file.relative_to(path).as_posix(): file for file in sorted(path.rglob("*")) if file.is_file()}


def program_digest(name: str) -> str:
    """Digest of the names and contents of all these files."""
    digest = hashlib.sha256()
    for named, file in program_files(name).items():
        digest.update(f"{named}\n".encode())
        with file.open("rb") as stream:
            digest.update(hashlib.file_digest(stream, "sha256").digest())
    return digest.hexdigest()
