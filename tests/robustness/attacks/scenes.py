"""Scenes of missions: a line of JSON and a picture, damaged in each of them, with checksums that are right."""

import hashlib
import json
import random
import shutil
from functools import cache
from pathlib import Path

import numpy as np

from refseq.scenes import Box, Scene, save_scene
from tests.robustness.attack import attack
from tests.robustness.attacks.cases import replays
from tests.robustness.damage import damaged_bytes, damaged_tree
from tests.robustness.fuzzing import fell
from tests.robustness.samples import samples


@attack(
    family="files", promise="A damaged scene is refused in one line, or looked for on the way", tries=10_000, short=12
)
def damaged_scene(seed: int, folder: Path) -> str | None:
    rng = random.Random(seed)
    (folder / "input.scene").write_bytes(_damaged(rng, _sample()))
    return _tried(folder / "input.scene", folder)


@replays("scene")
def try_scene(case: Path, folder: Path) -> str | None:
    shutil.copy(case, folder / "input.scene")
    return _tried(folder / "input.scene", folder)


def _tried(file: Path, folder: Path) -> str | None:
    shutil.copy(samples() / "thesis.refseq", folder)
    return fell(["mission", "plan", "thesis.refseq", "[LI1MT180]", "--scene", f"LI1={file.name}"], folder)


@cache
def _sample() -> bytes:
    """A scene's file."""
    coarse = np.random.default_rng(1).integers(0, 256, (18, 24), np.uint8)
    patch = np.kron(coarse, np.ones((5, 5), np.uint8))
    file = samples() / "poster.scene"
    save_scene(file, Scene(patch, "camera-1", Box(4, 6, 120, 90), 160, 120, "drive.mcap", 1.5))
    return file.read_bytes()


def _damaged(rng: random.Random, content: bytes) -> bytes:
    """A scene that is damaged in its bytes, its table or its picture."""
    if rng.random() < 0.2:
        return damaged_bytes(rng, content)
    magic, line, picture = content.split(b"\n", 2)
    if rng.random() < 0.4:
        picture = damaged_bytes(rng, picture)
    table = json.loads(line) | {"sha256": hashlib.sha256(picture).hexdigest()}
    if rng.random() < 0.8:
        table = damaged_tree(rng, table)
    try:
        line = json.dumps(table).encode()
    except (ValueError, RecursionError):
        line = b"{}"
    return b"\n".join((magic, line, picture))
