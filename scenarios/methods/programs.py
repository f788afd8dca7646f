"""Localisers that are programs of any language: a file by its path, or a folder that holds one named ``localiser``."""

import hashlib
import os
import re
import shutil
from collections.abc import Mapping
from pathlib import Path

from refseq_bench.scenarios.errors import ScenarioError

ENTRY = "localiser"
"""Name of the program in a folder, which may hold what else it reads."""
STARTS = ("./", "../", "/")
SCRIPT, BINARY = b"#!", b"\x7fELF"
"""Programs begin so that the system can start."""
FIRST_LINE = 255
"""Most bytes of a script's first line that Linux reads."""
VALID_START = "valid is a binary, or a script that begins as #!/usr/bin/env python3"
RETURN, RETURN_HINT = "\r", " (its lines end as on Windows)"
LOOKS_UP = "env"
"""Interpreter that looks for its first word as the shell does."""


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
        begin = file.readline(FIRST_LINE)
    if begin[:2] not in (SCRIPT, BINARY[:2]):
        raise ScenarioError(
            f"localiser {name!r}: {program} is no program: its first line tells no interpreter; {VALID_START}"
        )
    if begin.startswith(SCRIPT) and (missing := _missing_interpreter(begin)) is not None:
        raise ScenarioError(
            f"localiser {name!r}: {program}: its first line names {missing!r}, which is not there"
            f"{RETURN_HINT * missing.endswith(RETURN)}; {VALID_START}"
        )


def _missing_interpreter(line: bytes) -> str | None:
    """The program that a script's first line names and this machine lacks, as the kernel and ``env`` read the line."""
    text = line.removeprefix(SCRIPT).decode(errors="replace").partition("\0")[0].strip(" \t\n")
    interpreter, *argument = re.split(r"[ \t]+", text, maxsplit=1)
    # The guest starts in a folder of its own, where no relative path leads to anything.
    if not (Path(interpreter).is_absolute() and Path(interpreter).is_file() and os.access(interpreter, os.X_OK)):
        return interpreter
    looked_up = [one for one in argument if Path(interpreter).name == LOOKS_UP and one[0] != "-" and "=" not in one]
    return next((one for one in looked_up if shutil.which(one) is None), None)


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
