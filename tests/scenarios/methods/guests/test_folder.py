"""Where a guest looks for modules."""

import sysconfig
from pathlib import Path

import pytest

from refseq_bench.scenarios.imports.closure import ROOT
from refseq_bench.scenarios.methods.guests import folder


def test_the_checkout_is_left_out() -> None:
    assert ROOT.resolve() not in [path.resolve() for path in folder._path()]


def test_of_an_installed_bench_the_packages_beside_it_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    installed = Path(sysconfig.get_path("purelib"))
    monkeypatch.setattr(folder, "ROOT", installed)
    assert installed.resolve() in [path.resolve() for path in folder._path()]
