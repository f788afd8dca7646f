"""Tests on pseudo-terminals, which a bare root has only where ``/dev/pts`` is mounted."""

import pytest

from refseq_bench.sim.bench.serial_port import TerminalOutlet
from refseq_bench.sim.errors import SimError


def _there_are_some() -> bool:
    try:
        TerminalOutlet().close()
    except SimError:
        return False
    return True


needs_terminals = pytest.mark.skipif(not _there_are_some(), reason="no pseudo-terminals: /dev/pts is not mounted")
