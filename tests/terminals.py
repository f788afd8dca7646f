"""Tests on pseudo-terminals, which a bare root has only where ``/dev/pts`` is mounted."""

import pytest

from sim.errors import SimError
from sim.serial_port import TerminalOutlet


def _there_are_some() -> bool:
    try:
        TerminalOutlet().close()
    except SimError:
        return False
    return True


needs_terminals = pytest.mark.skipif(not _there_are_some(), reason="no pseudo-terminals: /dev/pts is not mounted")
