"""Read a recording of either format, chosen by the file's content."""

from pathlib import Path

from refseq.errors import LogError
from refseq.logs.carmen import read_carmen
from refseq.logs.mcap import MCAP_MAGIC, read_mcap
from refseq.logs.recording import Recording


def read_recording(path: Path) -> Recording:
    """Read a drive from an MCAP file or a CARMEN log, whichever ``path`` holds.

    Raises ``LogError`` when the file is missing, of neither format, or holds no view.
    """
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
