"""Logs of any robot: sources of samples, views made of them, and writers of the bench's own formats."""

from refseq.logs.carmen import write_carmen
from refseq.logs.findings import Findings
from refseq.logs.foxglove.writer import RecordingWriter
from refseq.logs.kinds import open_log
from refseq.logs.pairing.options import PairingOptions
from refseq.logs.pairing.plan import ViewPlan, plan_views
from refseq.logs.reader import read_recording
from refseq.logs.recording import Recording
from refseq.logs.source import Channel, LogSource, Role, Sample
from refseq.logs.trajectory import Trajectory

__all__ = [
    "Channel",
    "Findings",
    "LogSource",
    "PairingOptions",
    "Recording",
    "RecordingWriter",
    "Role",
    "Sample",
    "Trajectory",
    "ViewPlan",
    "open_log",
    "plan_views",
    "read_recording",
    "write_carmen",
]
