"""Worlds of environments are kept by their names, and files as they were written."""

import os
from pathlib import Path

import pytest

from refseq_bench.sim.envs.episodes import localising
from refseq_bench.sim.envs.worlds.named import world_named
from tests.worlds.conftest import SMALL


@pytest.fixture
def plan(tmp_path: Path) -> Path:
    path = tmp_path / "mine.toml"
    path.write_text(SMALL.format(top="", end=""))
    return path


def shorten(plan: Path) -> None:
    """Write the plan anew with a shorter route, a second later."""
    plan.write_text(plan.read_text().replace("[7, 0]", "[3, 0]"))
    later = plan.stat().st_mtime_ns + 1_000_000_000
    os.utime(plan, ns=(later, later))


def test_a_world_is_built_once_and_anew_when_its_file_is_edited(plan: Path) -> None:
    first = world_named(str(plan), "16:00", pictured=False)
    assert world_named(str(plan), "16:00", pictured=False) is first
    shorten(plan)
    assert world_named(str(plan), "16:00", pictured=False).routes["forward"].tolist() == [[1, 0], [3, 0]]
    assert world_named("rooms:0", "16:00", pictured=False) is world_named("rooms:0", "16:00", pictured=False)


def test_what_is_learnt_of_a_world_is_learnt_anew_when_its_file_is_edited(
    plan: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(localising, "drive_and_sense", lambda bench, operator, trigger: iter(()))
    monkeypatch.setattr(localising, "learn", lambda views, sensors, profile: object())
    asked = (str(plan), "16:00", "robuter", "forward")
    first = localising.familiar(*asked)
    assert localising.familiar(*asked) is first
    shorten(plan)
    assert localising.familiar(*asked) is not first
