"""Keys: equal for things that were made alike, and different as soon as anything differs that has a part in them."""

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from functools import cache
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from platform import python_version

from scenarios.drives.record import Drive
from sim.rendering.drivers import vulkan_device
from sim.rendering.render import RendererKind

LENGTH = 24
"""Hexadecimal digits of a key: 96 bits, so that no two things will ever have the same by chance."""
RECORDING_SOURCES = (
    "worlds",
    "robots",
    "sim",
    "refseq.planar",
    "refseq.view",
    "refseq.logs",
    "scenarios.drives.record",
)
RECORDING_PACKAGES = ("mujoco", "numpy", "scipy", "opencv-python-headless", "astral", "foxglove-sdk")


def recording_key(drive: Drive) -> str:
    """Key of a drive's recording: the drive, files that it names, the code and the packages that make it, the device.

    Raises the rooms' own errors where a file that the drive names cannot be read.
    """
    fields = asdict(drive)
    fields["world"] = _content(drive.world)
    fields["cameras"] = {camera: _content(model) for camera, model in drive.cameras.items()}
    return key_of(
        "recording",
        fields,
        sources_digest(RECORDING_SOURCES),
        packages(RECORDING_PACKAGES),
        _device() if drive.renderer is RendererKind.FILAMENT else None,
    )


def key_of(*parts: object) -> str:
    """Key of some values that JSON can hold; enumerations and paths count by their text."""
    text = json.dumps(parts, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:LENGTH]


def packages(names: Iterable[str]) -> Mapping[str, str]:
    """Versions of Python and of some packages."""
    return {"python": python_version(), **{name: version(name) for name in names}}


@cache
def sources_digest(modules: Sequence[str]) -> str:
    """Digest of all files of some modules and packages: code, models, tables, textures."""
    digest = hashlib.sha256()
    for module in modules:
        for name, file in _files(module).items():
            digest.update(f"{module}/{name}\n".encode())
            digest.update(file.read_bytes())
    return digest.hexdigest()[:LENGTH]


def _files(module: str) -> dict[str, Path]:
    """The files of a module, or of a package and all below it, by where they lie in it, in the order of that."""
    file = Path(str(import_module(module).__file__))
    if file.name != "__init__.py":
        return {file.name: file}
    inside = (path for path in file.parent.rglob("*") if path.is_file() and "__pycache__" not in path.parts)
    return dict(sorted((path.relative_to(file.parent).as_posix(), path) for path in inside))


@cache
def _device() -> str | None:
    """What renders: another device rounds otherwise."""
    return vulkan_device()


def _content(name: str) -> str:
    """A name of the library as it is; where it is that of a file, what is in the file, wherever it lies."""
    if not name.endswith(".toml"):
        return name
    try:
        return hashlib.sha256(Path(name).read_bytes()).hexdigest()[:LENGTH]
    except OSError:
        return name  # whoever is to read it will tell
