"""``refseq drive`` in the browser: set up, led by keys and by touch, recorded, set up again. Needs Chromium."""

import os
import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, CDPSession, Error, Page

from refseq.access.policy import AccessPolicy
from refseq.access.proxy import ProxiedPage, proxied
from refseq.logs import read_recording
from refseq_bench.sim.teleop.capture.desk import CaptureDesk
from refseq_bench.sim.teleop.capture.setup import CaptureSetup
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


def begun(tab: Page, address: str) -> None:
    """Open the page and begin with the drive that is set up there."""
    until(lambda: opened(tab, address))
    tab.wait_for_selector("#setup:not([hidden])")
    tab.click("#begin")
    tab.wait_for_selector("#drive:not([hidden])")


@pytest.mark.parametrize(
    ("clicked", "expected"), [("#world", "E V Space R"), ("summary", "E V Space R"), ("#while", "R")]
)
def test_only_a_field_that_is_written_into_keeps_keys_from_the_robot(
    browser: Browser, clicked: str, expected: str
) -> None:
    desk, sent = CaptureDesk(CaptureSetup("drive", "", ("laser",), None)), list[str]()
    with proxied(ProxiedPage(desk.routes(), lambda _: "/page"), AccessPolicy()) as running:
        tab = browser.new_page()
        tab.set_default_timeout(10_000)
        tab.goto(running.address)
        tab.click(clicked)
        tab.on("request", lambda one: sent.extend((one.post_data_json or {}).get("pressed", [])))
        for key in ("e", "v", "Space"):
            tab.keyboard.press(key)
        tab.focus("#world")
        shown = tab.is_checked("#world")
        tab.keyboard.press("Space")
        assert tab.is_checked("#world") is not shown, "who has no mouse ticks a box by Space"
        with tab.expect_request("**/keys"):
            tab.keyboard.press("r")
        tab.close()
    assert sent == expected.split()


@pytest.mark.slow
def test_keys_in_the_browser_lead_the_robot_beside_the_view_of_the_world(
    browser: Browser, driven: tuple[subprocess.Popen[bytes], str, Path]
) -> None:
    process, address, path = driven
    tab = browser.new_page(viewport={"width": 1000, "height": 500})
    tab.set_default_timeout(1000 * PATIENCE)
    begun(tab, address)
    tab.wait_for_selector("#view iframe")
    tab.frames[1].wait_for_selector("canvas")
    until(path.with_name("drive.partial.mcap").exists, lambda: tab.keyboard.press("Space"))
    tab.keyboard.down("w")
    tab.wait_for_timeout(4000)
    tab.keyboard.up("w")
    tab.keyboard.press("v")
    until(lambda: tab.is_visible("#setup"), lambda: tab.keyboard.press("x"))
    tab.click("#finish")
    until(lambda: process.poll() is not None)
    tab.close()
    assert process.returncode == 0
    read = read_recording(path)
    assert "forward" in read.metadata["controls"]
    first, last = read.views[0].truth, read.views[-1].truth
    assert first is not None
    assert last is not None
    assert last.x > first.x + 0.15, "a view was taken after it had gone that far"


@pytest.mark.slow
def test_on_a_phone_drives_are_set_up_led_by_touch_noted_and_set_up_again(
    browser: Browser, driven: tuple[subprocess.Popen[bytes], str, Path]
) -> None:
    process, address, path = driven
    phone = browser.new_context(viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True)
    tab = phone.new_page()
    tab.set_default_timeout(1000 * PATIENCE)
    until(lambda: opened(tab, address))
    tab.wait_for_selector("#setup:not([hidden])")
    assert tab.input_value("#distance") == "0.2", "the command's options are filled in"
    assert fits(tab)
    tab.fill("#name", "../x")
    tab.tap("#begin")
    tab.wait_for_selector("#mistake:not([hidden])")
    assert tab.inner_text("#mistake").startswith("name '../x' is not valid; valid are up to 60 letters, ")
    tab.fill("#name", "drive")
    tab.fill("#notes", "before")
    tab.fill("#distance", "0.1")
    tab.tap("#begin")
    tab.wait_for_selector("#go:visible")
    assert len(tab.frames) == 1, "a phone does not draw the world unless that is asked for"
    tab.tap("#go")
    tab.wait_for_selector("#phase:text-is('sampling')")
    fingers = tab.context.new_cdp_session(tab)  # the session that puts one down has to lift it
    touched(tab, fingers, "touchStart")
    tab.wait_for_function("Number.parseInt(document.querySelector('#figures td:nth-child(2)').textContent) >= 4")
    touched(tab, fingers, "touchEnd")
    assert fits(tab)
    tab.fill("#while", "before\nand afterwards")
    tab.tap("text=Stop, keep it")
    tab.wait_for_selector("#setup:not([hidden])")
    assert re.match(r"drive.mcap: [0-9]+ views, ", tab.inner_text("#last"))
    assert (tab.input_value("#name"), tab.input_value("#notes")) == ("drive-2", "before\nand afterwards")
    tab.fill("#name", "drive")
    tab.tap("#begin")
    tab.wait_for_selector("#mistake:not([hidden])")
    assert tab.inner_text("#mistake").endswith("is there already; valid is another name, as 'drive-2'")
    tab.fill("#name", "again")
    tab.tap("#begin")
    tab.tap("#go")
    tab.wait_for_selector("#phase:text-is('sampling')")
    tab.tap("text=Stop, keep it")
    tab.wait_for_selector("#setup:not([hidden])")
    tab.tap("#finish")
    until(lambda: process.poll() is not None)
    phone.close()
    assert process.returncode == 0
    first, second = read_recording(path), read_recording(path.with_name("again.mcap"))
    assert (first.metadata["name"], first.metadata["notes"]) == ("drive", "before\nand afterwards")
    assert len(first.views) >= 4
    assert all(view.distance < 0.16 for view in first.views), "views are as far apart as was filled in"
    assert (second.metadata["name"], len(second.views)) == ("again", 1)


def fits(tab: Page) -> bool:
    """Tell whether nothing has to be scrolled sideways."""
    return bool(tab.evaluate("document.documentElement.scrollWidth <= innerWidth"))


def touched(tab: Page, fingers: CDPSession, kind: str) -> None:
    """Put a finger on the button that leads ahead, or lift it."""
    tab.locator("#up").scroll_into_view_if_needed()
    box = tab.locator("#up").bounding_box()
    assert box
    point = {"x": box["x"] + box["width"] / 2, "y": box["y"] + box["height"] / 2}
    fingers.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [point] if kind == "touchStart" else []})
