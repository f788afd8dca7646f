"""Kinds of logs that can be opened, each recognised by its content."""

import os
from collections import Counter
from itertools import islice
from pathlib import Path

from refseq.errors import LogError
from refseq.files import check_input, open_input
from refseq.limits import FILES
from refseq.logs.source import LogKind, LogSource


def _is_bag(path: Path) -> bool:
    from refseq.logs.ros.files import is_bag

    return is_bag(path)


def _open_bag(path: Path) -> LogSource:
    from refseq.logs.ros.bag import RosBag

    return RosBag(path)


def _is_mcap(path: Path) -> bool:
    from refseq.logs.foxglove.records import is_mcap

    return is_mcap(path)


def _open_foxglove(path: Path) -> LogSource:
    from refseq.logs.foxglove.source import FoxgloveSource

    return FoxgloveSource(path)


def _is_carmen(path: Path) -> bool:
    from refseq.logs.carmen.text import is_carmen

    return is_carmen(path)


def _open_carmen(path: Path) -> LogSource:
    from refseq.logs.carmen.source import CarmenSource

    return CarmenSource(path)


def _is_picture_folder(path: Path) -> bool:
    from refseq.logs.pictures.source import holds_pictures

    return holds_pictures(path)


def _open_pictures(path: Path) -> LogSource:
    from refseq.logs.pictures.source import PictureFolder

    return PictureFolder(path)


KINDS: tuple[LogKind, ...] = (
    LogKind("a ROS bag", _is_bag, _open_bag),
    LogKind("an MCAP recording", _is_mcap, _open_foxglove),
    LogKind("a folder of pictures", _is_picture_folder, _open_pictures),
    LogKind("a CARMEN log", _is_carmen, _open_carmen),
)
"""Asked in this order; the first that recognises a file or folder opens it. ROS takes the MCAP files that are its own,
CARMEN any text: it is the last."""


MOST_NAMED = 3
"""So many kinds of files, and folders, are named of a folder that is no log."""


def _held(path: Path) -> str:
    """Tell what a folder holds instead of pictures, how those end, and which of its folders holds some."""
    from refseq.logs.pictures.names import PICTURES

    entries = sorted(entry for entry in islice(path.iterdir(), FILES) if entry.name[0] != ".")
    folders = [entry for entry in entries if entry.is_dir()]
    kinds = Counter(entry.suffix.lower() or entry.name for entry in entries if not entry.is_dir())
    told = [f"{count} {kind}" for kind, count in kinds.most_common(MOST_NAMED)]
    told += [f"the folder{'s' * (len(folders) > 1)} {', '.join(one.name for one in folders[:MOST_NAMED])}"] * bool(
        folders
    )
    pictured = next(
        (one.name for one in folders[:MOST_NAMED] if os.access(one, os.R_OK) and _is_picture_folder(one)), ""
    )
    below = f", and {pictured} is a folder of pictures" if pictured else ""
    return f"it holds {' and '.join(told) or 'nothing'}{below}; pictures end in {', '.join(PICTURES)}"


def is_log_folder(path: Path) -> bool:
    """Tell whether a folder is a log: a bag's, or one of pictures."""
    return path.is_dir() and any(kind.recognises(path) for kind in KINDS)


def open_log(path: Path | str) -> LogSource:
    """Open a log of any kind. Raises ``LogError`` where there is none, or none that is known."""
    path = Path(path)
    try:
        if not path.is_dir():
            check_input(path)
        kind = next((kind for kind in KINDS if kind.recognises(path)), None)
        if kind is not None:
            return kind.open(path)
    except OSError as error:
        raise LogError(f"{path}: cannot be read: {error.strerror or error}") from error
    valid = f"valid are {', '.join(kind.name for kind in KINDS[:-1])} and {KINDS[-1].name}"
    if path.is_dir():
        raise LogError(f"{path}: is a folder that holds no log; {valid}; {_held(path)}")
    with open_input(path) as file:
        head = file.read(4096)
    if not head.strip():
        raise LogError(f"{path}: is empty; {valid}")
    if _unpacks_to_nothing(path, head):
        raise LogError(f"{path}: is empty once unpacked; {valid}")
    if head.startswith(b"PK\3\4") and b"map.json" in head:
        raise LogError(f"{path}: is a map (.refseq), no log; {valid}")
    if head[4:8] == b"ftyp" or head.startswith(b"\x1aE\xdf\xa3") or head[8:12] == b"AVI ":
        raise LogError(f"{path}: is a video; valid is a folder of its pictures, as ffmpeg -i writes them")
    raise LogError(f"{path}: is neither MCAP (its magic bytes are missing) nor text; {valid}")


def _unpacks_to_nothing(path: Path, head: bytes) -> bool:
    """Tell whether compressed data hold no text."""
    from refseq.logs.carmen.text import is_blank, is_packed

    return is_packed(head) and is_blank(path)
