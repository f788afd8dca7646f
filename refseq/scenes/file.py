"""The file of a scene: a line that names the format, a line of JSON, and the patch as PNG.

Reading parses JSON and decodes one picture of a declared size, nothing else.
"""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import cv2

from refseq.errors import LogError, SceneError
from refseq.files import naming_writes, open_input, replace_bytes
from refseq.limits import PIXELS, SCENE_BYTES
from refseq.logs.decoding.picture import PNG_MAGIC, CompressedPicture, declared_size
from refseq.scenes.scene import Box, Scene

MAGIC = b"refseq-scene 1\n"
FARTHEST = 1e6
"""No scene was cut farther along a drive [m]: a choice, a month's drive."""
LONGEST = 200
"""Characters of a camera's or drive's name: a choice."""


def save_scene(path: Path | str, scene: Scene) -> None:
    """Write a scene's file in one step.

    Raises ``SceneError`` for one that is too large to be read again, and when it cannot be written.
    """
    picture = cv2.imencode(".png", scene.patch)[1].tobytes()
    table = {
        "camera": scene.camera,
        "box": list(scene.box),
        "size": [scene.width, scene.height],
        "drive": scene.drive[:LONGEST],
        "along": scene.along,
        "sha256": hashlib.sha256(picture).hexdigest(),
    }
    content = MAGIC + json.dumps(table).encode() + b"\n" + picture
    SCENE_BYTES.check(len(content), f"{path}: would take", SceneError)
    with naming_writes(path, SceneError):
        replace_bytes(Path(path), content)


def load_scene(path: Path | str) -> Scene:
    """Read a scene's file. Raises ``SceneError`` in one line that names the file and what is wrong with it."""
    try:
        with open_input(Path(path)) as file:
            content = file.read(SCENE_BYTES + 1)
        return _scene(content)
    except OSError as error:
        raise SceneError(f"{path}: cannot be read: {error.strerror or error}") from error
    except (SceneError, LogError) as error:
        raise SceneError(f"{path}: {error}") from error


def _scene(content: bytes) -> Scene:
    if not content.startswith(MAGIC):
        raise SceneError("is no scene; valid is a file that `refseq mission scene` has written")
    SCENE_BYTES.check(len(content), "has", SceneError)
    line, _, picture = content[len(MAGIC) :].partition(b"\n")
    table = _table(line)
    width, height = _whole_numbers(table, "size", 2)
    box = Box(*_whole_numbers(table, "box", 4))
    if width * height > PIXELS or not box.is_in(width, height):
        raise SceneError(f"is damaged: box {box} is not in a picture of {width} × {height} pixels")
    if hashlib.sha256(picture).hexdigest() != table["sha256"]:
        raise SceneError("is damaged: its picture does not match its checksum")
    if not picture.startswith(PNG_MAGIC) or declared_size(picture) != (box.width, box.height):
        raise SceneError(f"is damaged: it holds no PNG of {box.width} × {box.height} pixels")
    patch = CompressedPicture(picture).decode()
    patch.setflags(write=False)
    return Scene(patch, _text(table, "camera"), box, width, height, _text(table, "drive"), _along(table))


def _table(line: bytes) -> Mapping[str, Any]:
    try:
        table = json.loads(line)
    except (ValueError, RecursionError):
        table = None
    if not isinstance(table, dict) or set(table) != {"camera", "box", "size", "drive", "along", "sha256"}:
        raise SceneError("is damaged: its second line is no table of camera, box, size, drive, along and sha256")
    return table


def _whole_numbers(table: Mapping[str, Any], key: str, count: int) -> list[int]:
    found = table[key]
    if not isinstance(found, list) or len(found) != count or not all(map(_is_size, found)):
        raise SceneError(f"is damaged: {key} = {found!r:.60} is not {count} numbers of pixels")
    return found


def _is_size(found: object) -> bool:
    return type(found) is int and 0 <= found <= PIXELS


def _text(table: Mapping[str, Any], key: str) -> str:
    found = table[key]
    if not isinstance(found, str) or len(found) > LONGEST or not (found.isprintable() or not found):
        raise SceneError(f"is damaged: {key} = {found!r:.60} is no name")
    return found


def _along(table: Mapping[str, Any]) -> float:
    found = table["along"]
    if isinstance(found, bool) or not isinstance(found, int | float) or not 0 <= found <= FARTHEST:
        raise SceneError(f"is damaged: along = {found!r:.60} is no number of metres from 0 to {FARTHEST:g}")
    return float(found)
