"""Baked light that is kept: the same world in the same light is baked once."""

import hashlib
import io
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import fields, is_dataclass
from functools import cache
from importlib.metadata import version
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path

import numpy as np

from refseq.files import replace_bytes
from refseq.map.format.archive import DAMAGE
from refseq_bench.sim.rendering.baked.still_light import Bake
from refseq_bench.worlds.lighting.baking import Baked, Shell
from refseq_bench.worlds.lighting.form_factors import Cards

KEPT = 256
"""So many worlds' light is kept, of which each takes 0.1 to 3 MB: those that were used last; a choice."""
SOLVERS = ("numpy", "scipy", "embreex")
"""Packages that may work out other last digits in another version."""


def kept(bake: Bake, folder: Path, *about: object) -> Bake:
    """Return ``bake`` which reads from ``folder`` what it worked out before, to the last bit.

    ``about`` is all that it depends on besides the shell, the cards and the code of ``worlds``: dataclasses, tuples and
    arrays, and things whose ``repr`` tells them whole. A file that is damaged is made anew, and a folder that cannot be
    written to keeps nothing.
    """

    def found(shell: Shell, cards: Cards) -> Baked:
        file = folder / f"{_key(shell, cards, about)}.npz"
        if (light := _read(file, len(shell.cards), len(cards))) is not None:
            return light
        light = bake(shell, cards)
        with suppress(OSError):
            _keep(file, light)
        return light

    return found


def _key(*about: object) -> str:
    digest = hashlib.sha256()
    for part in _told((_code(), *about)):
        digest.update(part)
    return digest.hexdigest()[:24]


def _told(value: object) -> Iterator[bytes]:
    """All of a value: arrays to the last bit, dataclasses and tuples part by part, all else as it is written."""
    if isinstance(value, np.ndarray):
        yield f"{value.dtype.str} {value.shape} ".encode()
        yield np.ascontiguousarray(value).tobytes()
    elif isinstance(value, tuple):
        yield f"{len(value)} ".encode()
        for part in value:
            yield from _told(part)
    elif is_dataclass(value):
        yield from _told(tuple(getattr(value, field.name) for field in fields(value)))
    else:
        yield f"{value!r} ".encode()


@cache
def _code() -> str:
    """Digest of the code that bakes, and of the packages that it calls."""
    digest = hashlib.sha256(repr([version(name) for name in SOLVERS]).encode())
    for module in sorted(_modules(files("refseq_bench.worlds")), key=lambda one: str(one)):
        digest.update(module.read_bytes())
    return digest.hexdigest()


def _modules(folder: Traversable) -> Iterator[Traversable]:
    for entry in folder.iterdir():
        if entry.is_dir():
            yield from _modules(entry)
        elif entry.name.endswith(".py"):
            yield entry


def _read(file: Path, points: int, others: int) -> Baked | None:
    """The light in a file; None where there is none, or not one that fits."""
    try:
        with np.load(file, allow_pickle=False) as arrays:
            light = Baked(arrays["lux"], arrays["buried"], arrays["around"])
        file.touch()  # it was used
    except (OSError, KeyError, *DAMAGE):
        return None
    fits = light.lux.shape == light.buried.shape == (points,) and light.around.shape == (others,)
    typed = light.buried.dtype == bool and light.lux.dtype == light.around.dtype == float
    return light if fits and typed else None


def _keep(file: Path, light: Baked) -> None:
    """Put light into a file, and remove those that were not used for longest."""
    written = io.BytesIO()
    np.savez(written, lux=light.lux, buried=light.buried, around=light.around)
    file.parent.mkdir(parents=True, exist_ok=True)
    replace_bytes(file, written.getvalue())
    older = sorted(file.parent.glob("*.npz"), key=lambda one: one.stat().st_mtime, reverse=True)[KEPT:]
    for one in older:
        one.unlink(missing_ok=True)
