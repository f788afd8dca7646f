"""Recordings for the viewer that were saved before: a file (.rrd), or a folder in which a mission left one."""

from pathlib import Path

from refseq_bench.scenarios.errors import ScenarioError

RECORD = "mission.rrd"
"""File that a mission leaves for the viewer in its folder."""
ENDING = ".rrd"
NAME = "RecordingInfo:name"


def is_recorded(path: Path) -> bool:
    """Tell whether a path is such a file or folder; any other folder is one unless it is a log."""
    from refseq.logs.kinds import is_log_folder

    if not path.is_dir():
        return path.suffix == ENDING
    return (path / RECORD).is_file() or not is_log_folder(path)


def name_of(record: Path) -> str:
    """Name of a recording in the viewer: sent on under that name it stays one recording."""
    from rerun.chunk import RrdReader

    for chunk in RrdReader(record).stream():
        batch = chunk.to_record_batch()
        if NAME in batch.schema.names:
            return str(batch.column(NAME).to_pylist()[0][0])
    return record.name


def record_at(path: Path) -> Path:
    """The file to show. Raises ``ScenarioError`` where there is none, or what is there holds no recording."""
    from rerun.chunk import RrdReader

    file = path / RECORD if path.is_dir() else path
    if not file.is_file():
        valid = f"a folder with the {RECORD} of 'refseq mission run --output', or a log" if path.is_dir() else "a file"
        raise ScenarioError(f"{path}: holds nothing to show; valid is {valid}")
    try:
        readable = bool(RrdReader(file).recordings())
    except Exception as error:  # Rerun has no family of errors for a damaged file
        raise ScenarioError(f"{file}: cannot be read: {str(error).splitlines()[0]}; valid is a recording") from error
    if not readable:
        raise ScenarioError(f"{file}: holds no recording; valid is one that was saved with 'refseq view -o'")
    return file
