"""``refseq drive`` in the browser: its keys lead the robot, and what it senses is recorded. Needs Chromium."""

import os
import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Error, Page

from refseq.logs import read_recording
from tests.worlds.conftest import SMALL

PATIENCE = 60.0
"""A browser without a graphics card takes its time [s]."""


@pytest.fixture
def driven(tmp_path: Path) -> Iterator[tuple[subprocess.Popen[bytes], str, Path]]:
    """A drive in a short corridor that waits for somebody to lead the robot, its page, and its recording to be."""
    plan, path = tmp_path / "small.toml", tmp_path / "drive.mcap"
    plan.write_text(SMALL.format(top="", end=""))
    words = ["drive", plan, "--sensors", "laser", "--distance", "0.2", "-o", path]
    command = [sys.executable, "-c", "from refseq_bench.scenarios.cli.app import main; main()", *map(str, words)]
    headless = {name: value for name, value in os.environ.items() if name not in {"DISPLAY", "WAYLAND_DISPLAY"}}
    with subprocess.Popen(command, env=headless, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as process:
        assert process.stdout is not None
        address = re.search(rb"http://\S+", process.stdout.readline())
        assert address
        yield process, address[0].decode(), path
        process.kill()


def until(holds: Callable[[], bool], meanwhile: Callable[[], object] = lambda: None) -> None:
    """Wait until something holds; do the other thing every few seconds."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        meanwhile()
        for _ in range(50):
            if holds():
                return
            time.sleep(0.1)
    raise TimeoutError


def opened(tab: Page, address: str) -> bool:
    try:
        return tab.goto(address) is not None
    except Error:  # not served yet
        return False


@pytest.mark.slow
def test_keys_in_the_browser_lead_the_robot(
    browser: Browser, driven: tuple[subprocess.Popen[bytes], str, Path]
) -> None:
    process, address, path = driven
    tab = browser.new_page(viewport={"width": 700, "height": 500})
    until(lambda: opened(tab, address))
    tab.mouse.click(600, 250)
    until(path.with_name("drive.partial.mcap").exists, lambda: tab.keyboard.press("Space"))
    tab.keyboard.down("w")
    tab.wait_for_timeout(4000)
    tab.keyboard.up("w")
    tab.keyboard.press("v")
    until(lambda: process.poll() is not None, lambda: tab.keyboard.press("x"))
    tab.close()
    assert process.returncode == 0
    read = read_recording(path)
    assert "forward" in read.metadata["controls"]
    first, last = read.views[0].truth, read.views[-1].truth
    assert first is not None
    assert last is not None
    assert last.x > first.x + 0.15, "a view was taken after it had gone that far"
