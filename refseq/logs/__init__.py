"""Recordings: MCAP with Foxglove schemas, and CARMEN text logs."""

from refseq.logs.carmen import read_carmen, write_carmen
from refseq.logs.mcap import MCAP_MAGIC, RecordingWriter, read_mcap
from refseq.logs.reader import read_recording
from refseq.logs.recording import Recording

__all__ = [
    "MCAP_MAGIC",
    "Recording",
    "RecordingWriter",
    "read_carmen",
    "read_mcap",
    "read_recording",
    "write_carmen",
]
