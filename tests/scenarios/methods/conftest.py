import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from refseq.view import View
from tests.support import corridor_drive


@pytest.fixture(scope="module")
def views() -> list[View]:
    return corridor_drive(np.random.default_rng(0), 5, size=24)


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder to stand in, as a user does; modules that were imported from it are forgotten afterwards."""
    before = set(sys.modules)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [entry for entry in sys.path if entry])
    monkeypatch.setattr(sys, "dont_write_bytecode", True)  # two edits within a second must not find an old .pyc
    yield tmp_path
    for name in set(sys.modules) - before:
        if str(tmp_path) in str(getattr(sys.modules[name], "__file__", "")):
            del sys.modules[name]
