"""Cameras as TOML tables: those that come with this package, and those that people write.

What a table leaves out is as with the Fire-i (``CameraModel``).
"""

from dataclasses import fields
from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from refseq_bench.sim.cameras.camera import CameraModel
from refseq_bench.sim.errors import SimError
from refseq_bench.text_file import TextFileError, parse_toml, read_text

__all__ = ["camera_names", "load_camera", "parse_camera"]

_WANTED = {
    "float_type": "a number",
    "int_type": "a whole number",
    "dataclass_type": "a table",
    "tuple_type": "a pair",
    "too_long": "a pair",
    "missing": "a pair",  # of the first or second of two: all else has a default
}
"""Valid values, by pydantic's name of the mistake."""


def camera_names() -> tuple[str, ...]:
    """Return the cameras that come with this package, in alphabetical order."""
    files = (Path(file.name) for file in resources.files("refseq_bench.sim.cameras.library").iterdir())
    return tuple(sorted(file.stem for file in files if file.suffix == ".toml"))


def load_camera(name_or_path: str | Path) -> CameraModel:
    """Read a camera of the package by its name, or a file by its path (one that ends in ``.toml``).

    Raises ``SimError`` with one line: file, key, value and what is valid.
    """
    path = Path(name_or_path)
    if path.suffix == ".toml":
        return parse_camera(_text(path), path.name)
    if str(name_or_path) not in camera_names():
        raise SimError(f"unknown camera '{name_or_path}': valid are {', '.join(camera_names())}, or a path to a .toml")
    file = f"{name_or_path}.toml"
    return parse_camera((resources.files("refseq_bench.sim.cameras.library") / file).read_text(encoding="utf-8"), file)


def parse_camera(text: str, file: str = "camera.toml") -> CameraModel:
    """Turn the text of a table into a camera; ``file`` is what the errors call it."""
    try:
        return TypeAdapter(CameraModel).validate_python(parse_toml(text))
    except TextFileError as error:
        raise SimError(f"{file}: {error}") from None
    except ValidationError as error:
        first = error.errors()[0]
        raise SimError(f"{file}: {_told(first['type'], first['loc'], first['input'])}") from None
    except SimError as error:
        raise SimError(f"{file}: {error}") from None


def _text(path: Path) -> str:
    try:
        return read_text(path)
    except TextFileError as error:
        raise SimError(f"{path}: {error}") from None


def _told(mistake: str, loc: tuple[int | str, ...], value: Any) -> str:
    key = ".".join(part for part in loc if isinstance(part, str))
    if mistake == "unexpected_keyword_argument":
        table: Any = CameraModel()
        for part in loc[:-1]:
            table = getattr(table, str(part))
        return f"{key}: unknown key; valid are {', '.join(figure.name for figure in fields(table))}"
    return f"{key} = {value!r} is not {_WANTED[mistake]}"
