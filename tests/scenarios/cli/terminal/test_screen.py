import os
import shlex
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import pytest
import rerun as rr

from refseq_bench.scenarios.cli.terminal.options import Screen
from refseq_bench.scenarios.cli.terminal.screen import in_file, on_screen, page_told, rerun_command


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


class Viewers:
    """Stand for viewers of all three kinds: note what is asked of them, and when they are let go."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.noted: list[tuple[Any, ...]] = []
        for kind in ("connected", "served", "spawned"):
            monkeypatch.setattr(f"refseq.viewer.sinks.{kind}", partial(self._opened, kind))
        monkeypatch.setattr("time.sleep", self._interrupted)
        monkeypatch.setattr("refseq_bench.scenarios.cli.terminal.screen.say", self._said)

    @contextmanager
    def _opened(self, kind: str, *given: object, **more: object) -> Iterator[Any]:
        self.noted.append((kind, *given, *more))
        yield ("a stream", "http://127.0.0.1:9/token") if kind == "served" else "a stream"
        self.noted.append(("closed",))

    def _said(self, console: object, line: str) -> None:
        self.noted.append(("told", line))

    def _interrupted(self, seconds: float) -> None:
        self.noted.append(("waits",))
        raise KeyboardInterrupt

    def show(self, screen: Screen, *, live: bool) -> list[tuple[Any, ...]]:
        with on_screen("a drive", screen, live=live) as stream:
            assert stream == "a stream"
            self.noted.append(("drawn",))
        return self.noted


PAGE = ("told", "a drive: open http://127.0.0.1:9/token in a browser of this machine; Ctrl-C ends it")


def test_a_viewer_of_its_own_is_given_its_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    noted = Viewers(monkeypatch).show(Screen(memory_limit="4GB"), live=False)
    assert noted == [("spawned", "a drive", "4GB"), ("drawn",), ("closed",)]


def test_a_viewer_elsewhere_is_told_of_when_it_has_all(monkeypatch: pytest.MonkeyPatch) -> None:
    url = "rerun+http://here:9876/proxy"
    noted = Viewers(monkeypatch).show(Screen(connect=url), live=True)
    assert noted == [
        ("connected", url, "a drive", "batches"),  # small ones: somebody watches
        ("drawn",),
        ("closed",),
        ("told", f"a drive: sent to {url}"),
    ]


@pytest.mark.parametrize("live", [True, False])
def test_browsers_are_told_of_before_a_live_drive_else_behind_and_served_until_ctrl_c(
    monkeypatch: pytest.MonkeyPatch, *, live: bool
) -> None:
    _, *noted = Viewers(monkeypatch).show(Screen(serve=9090), live=live)
    assert noted == [*([PAGE, ("drawn",)] if live else [("drawn",), PAGE]), ("waits",), ("closed",)]


def test_a_file_is_told_of_with_the_command_that_shows_it(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    viewers = Viewers(monkeypatch)
    path = tmp_path / "drive.rrd"
    with in_file(path, "a drive") as stream:
        assert viewers.noted == []
        stream.log("somewhere", rr.TextLog("hello"))
    assert path.read_bytes()[:4] in (b"RRF2", b"RRIO", b"RRF0")
    assert viewers.noted == [("told", f"{path}: open it with '{rerun_command(path)}'")]


def test_a_drive_that_fails_leaves_no_file(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    viewers = Viewers(monkeypatch)
    with pytest.raises(ZeroDivisionError), in_file(tmp_path / "drive.rrd", "a drive"):
        raise ZeroDivisionError
    assert list(tmp_path.iterdir()) == []
    assert viewers.noted == []


def test_the_page_on_which_a_robot_is_led_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    viewers = Viewers(monkeypatch)
    page_told("robuter")("http://127.0.0.1:8/t")
    assert viewers.noted == [("told", "robuter: open http://127.0.0.1:8/t in a browser of this machine")]
