"""Logs of any robot: sources of samples, views made of them, and writers of the bench's own formats.

Names are imported when they are first asked for: who writes recordings loads no reader, and no key follows one.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from refseq.logs.carmen.writer import write_carmen
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

_HOMES = {
    "carmen.writer": ("write_carmen",),
    "findings": ("Findings",),
    "foxglove.writer": ("RecordingWriter",),
    "kinds": ("open_log",),
    "pairing.options": ("PairingOptions",),
    "pairing.plan": ("ViewPlan", "plan_views"),
    "reader": ("read_recording",),
    "recording": ("Recording",),
    "source": ("Channel", "LogSource", "Role", "Sample"),
    "trajectory": ("Trajectory",),
}
_HOME = {name: module for module, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> object:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
