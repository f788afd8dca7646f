import os
import shlex
import subprocess
from pathlib import Path

import pytest

from refseq_bench.scenarios.cli.terminal.screen import rerun_command


def test_the_command_for_the_viewer_works_where_one_stands(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", os.defpath)
    monkeypatch.setenv("DISPLAY", ":0")
    command = rerun_command(Path("a drive.rrd"))
    program, file = shlex.split(command)
    assert file == "a drive.rrd"
    told = subprocess.run([program, "--version"], capture_output=True, text=True, check=True)
    assert told.stdout.startswith("rerun")


def test_below_the_folder_where_one_stands_its_path_is_short(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PATH", os.defpath)
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr("sysconfig.get_path", lambda name: str(tmp_path / ".venv/bin"))
    monkeypatch.chdir(tmp_path)
    assert rerun_command(Path("out/demo.rrd")) == ".venv/bin/rerun out/demo.rrd"


def test_on_the_path_it_is_called_by_its_name_and_without_a_display_it_serves_a_browser_here(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("shutil.which", lambda name: f"/usr/bin/{name}")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    assert rerun_command(Path("a.rrd"), Path("b.rrd")) == "rerun --bind 127.0.0.1 --serve-web a.rrd b.rrd"
