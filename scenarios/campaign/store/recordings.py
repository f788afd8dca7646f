"""Recordings of drives, read from the store as they were put there."""

from pathlib import Path

from refseq.logs.foxglove.source import FoxgloveSource
from refseq.logs.pairing.plan import plan_views
from refseq.logs.recording import Recording


def read_kept(path: Path) -> Recording:
    """The views of a recording of ours; what reads other logs has no part in it. Raises ``LogError``, ``OSError``."""
    return plan_views(FoxgloveSource(path)).recording()
