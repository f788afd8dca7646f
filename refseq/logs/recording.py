"""What every log format is read into, and the choice of the format by a file's content."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from refseq.errors import LogError
from refseq.view import View


@dataclass(frozen=True, slots=True)
class Recording:
    """A drive: its views in order of time, what is known of how it was made, and whether its end is there.

    ``skipped`` counts the lines or messages of kinds that are not read, by kind.
    """

    views: tuple[View, ...]
    metadata: Mapping[str, str] = field(default_factory=dict)
    complete: bool = True
    skipped: Mapping[str, int] = field(default_factory=dict)

    @property
    def sensors(self) -> frozenset[str]:
        """Names of the sensors that at least one view has."""
        return frozenset().union(*(view.sensors for view in self.views))


def read_recording(path: Path) -> Recording:
    """Read a drive from an MCAP file or a CARMEN log, whichever ``path`` holds.

    Raises ``LogError`` when the file is missing, of neither format, or holds no view.
    """
    from refseq.logs.carmen import read_carmen
    from refseq.logs.mcap import MCAP_MAGIC, read_mcap

    try:
        with path.open("rb") as file:
            head = file.read(4096)
    except OSError as error:
        raise LogError(f"{path}: cannot be read: {error.strerror}") from error
    if head and head[: len(MCAP_MAGIC)] == MCAP_MAGIC[: len(head)]:
        return read_mcap(path)
    if b"\0" in head or not head.strip():
        kind = "empty" if not head.strip() else "neither MCAP (its magic bytes are missing) nor text"
        raise LogError(f"{path}: is {kind}; valid are an MCAP recording and a CARMEN log")
    return read_carmen(path)
