"""Files of a bag: a rosbag2 folder with its ``metadata.yaml`` or without, or one file, packed or not."""

import re
import reprlib
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePath
from typing import Any

import zstandard
from ruamel.yaml import YAML

from refseq.errors import LogError
from refseq.files import open_input
from refseq.limits import CHUNK_BYTES, METADATA_BYTES, UNPACKED_BYTES
from refseq.logs.decoding.unpacking import translating
from refseq.logs.foxglove.records import is_mcap
from refseq.logs.ros.mcap_file import McapRosFile, holds_ros
from refseq.logs.ros.storage import (
    ROSBAG1_MAGIC,
    SQLITE_MAGIC,
    ZSTD_MAGIC,
    BagFile,
    DamagedBagError,
    Rosbag1File,
    SqliteBag,
)

METADATA_FILE = "metadata.yaml"
STORAGE_SUFFIXES = (".mcap", ".db3", ".mcap.zstd", ".db3.zstd")


@dataclass(frozen=True)
class BagFiles:
    """The open files of a bag in their order, and the notes in its metadata.

    ``unpacked`` keeps the folder of unpacked files as long as they are read. ``damage`` tells where a file is cut off,
    and of a folder without metadata: its recorder was stopped before it could write them.
    """

    files: tuple[BagFile, ...]
    metadata: Mapping[str, str] = field(default_factory=dict)
    damage: str = ""
    unpacked: "tempfile.TemporaryDirectory[str] | None" = None


def is_bag(path: Path) -> bool:
    """Tell whether a folder is a rosbag2's, by its metadata or its files, or a file is a bag's, by its content."""
    if path.is_dir():
        return (path / METADATA_FILE).is_file() or bool(_storage_files(path))
    return _is_bag_file(path)


def _is_bag_file(path: Path) -> bool:
    """Tell whether a file is a bag's by its content; of a packed one only its name is looked at."""
    packed = _is_packed(path) and path.name.endswith(STORAGE_SUFFIXES)
    return packed or _head(path).startswith((SQLITE_MAGIC, ROSBAG1_MAGIC)) or holds_ros(path)


def open_bag(path: Path) -> BagFiles:
    """Open a folder or a file. Raises ``LogError`` where it is no bag, or damaged before anything could be read."""
    if not path.is_dir():
        return _open_files([path], {})
    if not (path / METADATA_FILE).is_file():
        found = _storage_files(path)
        if not found:
            raise LogError(f"{path}: holds no {METADATA_FILE} and no files of one bag; valid is a rosbag2 folder")
        return replace(_open_files(found, {}), damage=f"{METADATA_FILE} is missing")
    metadata = _metadata(path / METADATA_FILE)
    names = _names(metadata, path / METADATA_FILE)
    missing = [name for name in names if not (path / name).is_file()]
    if missing:
        raise LogError(f"{path}: {METADATA_FILE} names {missing[0]!r}, which is not there; valid is a whole folder")
    return _open_files([path / name for name in names], _notes(metadata))


def _storage_files(folder: Path) -> list[Path]:
    """Files of the one bag in a folder, ``_9`` before ``_10`` as they were written; none where they are of several.

    A folder of recordings that have nothing to do with each other is no bag.
    """
    numbered = re.compile(rf"(.*?)(?:_(\d+))?({'|'.join(map(re.escape, STORAGE_SUFFIXES))})")
    found = {file: name for file in folder.iterdir() if file.is_file() and (name := numbered.fullmatch(file.name))}
    of_one = len({(name[1], name[3]) for name in found.values()}) == 1
    files = sorted(found, key=lambda file: int(found[file][2] or 0))
    return files if of_one and _is_bag_file(files[0]) else []


def _metadata(path: Path) -> Mapping[str, Any]:
    """The contents of ``metadata.yaml``, as plain values."""
    try:
        METADATA_BYTES.check(path.stat().st_size, f"{path}: has")
        with open_input(path) as file:
            loaded = _plain_yaml(file.read(METADATA_BYTES).decode())
    except (OSError, ValueError) as error:
        raise LogError(f"{path}: cannot be read: {error!s:.200}; valid is a rosbag2's metadata") from error
    information = loaded.get("rosbag2_bagfile_information") if isinstance(loaded, dict) else None
    if not isinstance(information, dict):
        raise LogError(f"{path}: has no 'rosbag2_bagfile_information'; valid is a rosbag2's metadata")
    return information


def _plain_yaml(text: str) -> Any:
    """Plain values of YAML; the safe loader makes no others, and runs nothing. Raises ``ValueError``."""
    with translating(ValueError):
        return YAML(typ="safe").load(text)


def _notes(metadata: Any) -> dict[str, str]:
    """Notes that the bag's writer left in its metadata."""
    custom = metadata.get("custom_data") if isinstance(metadata, dict) else None
    if not isinstance(custom, dict):
        return {}
    # A value may be a structure that names itself again and again, and grows beyond all bounds as a text.
    return {str(key): str(value) for key, value in custom.items() if isinstance(value, str | int | float)}


def _notes_within(file: BagFile) -> dict[str, str]:
    """Notes in the metadata that an MCAP file holds itself; none where they are no YAML."""
    try:
        return _notes(_plain_yaml(file.metadata_text)) if len(file.metadata_text) <= METADATA_BYTES else {}
    except ValueError:
        return {}


def _names(metadata: Mapping[str, Any], path: Path) -> list[str]:
    """Names of the files, without folders: a bag holds them beside its metadata."""
    names = metadata.get("relative_file_paths")
    if not isinstance(names, list) or not names or not all(isinstance(name, str) and name for name in names):
        raise LogError(f"{path}: relative_file_paths is {reprlib.repr(names):.80}; valid is a list of files")
    return [PurePath(name).name for name in names]


def _open_files(files: list[Path], notes: Mapping[str, str]) -> BagFiles:
    unpacked = tempfile.TemporaryDirectory(prefix="refseq-bag-") if any(map(_is_packed, files)) else None
    opened: list[BagFile] = []
    damage = ""
    for file in files:
        plain = _unpack(file, Path(unpacked.name)) if unpacked and _is_packed(file) else file
        try:
            opened.append(_open_file(plain, file))
        except DamagedBagError as error:
            if not opened:  # the last of many may be cut off
                raise
            damage = damage or error.reason
            break
        damage = damage or opened[-1].damage
    return BagFiles(tuple(opened), notes or _notes_within(opened[0]), damage, unpacked)


def _is_packed(path: Path) -> bool:
    return _head(path).startswith(ZSTD_MAGIC)


def _head(path: Path) -> bytes:
    try:
        with open_input(path) as file:
            return file.read(16)
    except OSError as error:
        raise LogError(f"{path}: cannot be read: {error.strerror}") from error


def _open_file(path: Path, told: Path) -> BagFile:
    """Open a file by its content, whatever its name; messages name it ``told``."""
    head = _head(path)
    if head.startswith(SQLITE_MAGIC):
        return SqliteBag(path, told)
    if head.startswith(ROSBAG1_MAGIC):
        return Rosbag1File(path, told)
    if is_mcap(path):
        return McapRosFile(path, told)
    raise DamagedBagError(told, "it is empty" if not head else "its first bytes are neither MCAP, SQLite nor ROS 1")


def _unpack(path: Path, folder: Path) -> Path:
    """Unpack a file that was compressed as a whole, into a temporary folder, as far as there is room."""
    target = folder / path.name.removesuffix(".zstd")
    room, unpacked = shutil.disk_usage(folder).free, UNPACKED_BYTES.of(path)
    try:
        with (
            open_input(path) as packed,
            zstandard.ZstdDecompressor(max_window_size=CHUNK_BYTES).stream_reader(
                packed, read_across_frames=True
            ) as stream,
            target.open("wb") as file,
        ):
            while piece := stream.read(1 << 20):
                unpacked.add(len(piece))
                room -= len(piece)
                if room < 0:
                    raise LogError(f"{path}: unpacks to more than there is room for in {folder.parent}")
                file.write(piece)
    except (zstandard.ZstdError, OSError) as error:
        raise DamagedBagError(path, f"it cannot be unpacked: {error}") from error
    return target
