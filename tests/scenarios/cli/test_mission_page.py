"""``refseq mission page`` in the browser, by mouse on a desk and by touch on a phone. Needs Chromium."""

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from playwright.sync_api import Browser, Page

from refseq.access.policy import AccessPolicy
from refseq.access.proxy import proxied
from refseq.map.learning import learn
from refseq.map.map import Map
from refseq.map.profile import BEST
from refseq.missions.path import path_along
from refseq_bench.scenarios.drives.drive import Drive
from refseq_bench.scenarios.drives.record import record
from refseq_bench.scenarios.missions.page.desk import MissionDesk
from refseq_bench.scenarios.missions.page.maps import MapShelf
from refseq_bench.sim.rendering.renderer import RendererKind
from tests.support import corridor_drive

BY_LASER = Drive(world="offices", renderer=RendererKind.NONE, behaviours=("MN:14",))
PATIENCE = 120_000.0
"""Time for a mission on a busy machine [ms]."""


class Served(NamedTuple):
    """A page that is served, and the folder in which missions are left."""

    address: str
    folder: Path


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory, browser: Browser) -> Iterator[Served]:
    """The page of a map of the offices, past the first two doors."""
    folder = tmp_path_factory.mktemp("maps")
    drive = record(BY_LASER, folder / "offices.mcap", notes="door 1 <b>closed</b>")
    learn(drive.views, profile=BEST, metadata=drive.metadata).save(folder / "offices.refseq")
    words = ["mission", "page", folder, "--port", "0", "-o", folder / "out"]
    command = [sys.executable, "-c", "from refseq_bench.scenarios.cli.app import main; main()", *map(str, words)]
    with subprocess.Popen(command, env=dict(os.environ), stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        address = re.search(rb"http://[^ ;]+", process.stdout.readline())
        assert address
        yield Served(address[0].decode(), folder)
        process.kill()


@pytest.fixture(params=["desk", "phone"])
def tab(request: pytest.FixtureRequest, browser: Browser, served: Served) -> Iterator[Page]:
    small = request.param == "phone"
    size = {"width": 390, "height": 844} if small else {"width": 1280, "height": 800}
    context = browser.new_context(viewport=size, has_touch=small, is_mobile=small)  # type: ignore[arg-type]
    tab = context.new_page()
    tab.set_default_timeout(PATIENCE)
    mistakes: list[str] = []
    tab.on("pageerror", lambda error: mistakes.append(str(error)))
    tab.goto(served.address)
    tab.wait_for_selector("#orders li")
    yield tab
    assert tab.evaluate("document.documentElement.scrollWidth <= innerWidth"), "nothing is scrolled sideways"
    context.close()
    assert mistakes == []


def press(tab: Page, where: str) -> None:
    """Click, or tap where there is no mouse."""
    if tab.evaluate("navigator.maxTouchPoints > 0"):
        tab.tap(where)
    else:
        tab.click(where)


def press_plan(tab: Page, share: float) -> None:
    """Press the way so far along what is drawn of it."""
    box = tab.locator("#drawing .way").bounding_box()
    assert box
    x, y = box["x"] + share * box["width"], box["y"] + box["height"] / 2
    if tab.evaluate("navigator.maxTouchPoints > 0"):
        tab.touchscreen.tap(x, y)
    else:
        tab.mouse.click(x, y)


@pytest.mark.slow
def test_a_mission_is_stated_on_the_map_run_and_watched(tab: Page, served: Served) -> None:
    assert "“door 1 <b>closed</b>”" in tab.inner_text("#facts"), "text never becomes markup"
    assert tab.locator("#drawing circle.door").count() > 0
    corner = "getComputedStyle(document.querySelector('#legend i.door')).borderTopLeftRadius"
    assert tab.evaluate(corner) == "50%", "doors are as round in the legend"
    press(tab, "#door")
    press(tab, "text=+ wait 5 s")
    tab.wait_for_function("document.querySelector('#told').textContent.startsWith('[LD] ')")
    press(tab, "#steps button[title=remove]")
    tab.wait_for_function("document.querySelector('#told').textContent.startsWith('The way as it was learnt')")
    press_plan(tab, 0.5)
    press(tab, "text=Do something here")
    tab.wait_for_function("document.querySelector('#told').textContent.startsWith('[LA1] ')")
    stop = float(tab.input_value("#steps input[type=number]"))
    assert stop == pytest.approx(7.0, abs=1.0), "half of 14 m"
    press(tab, "#go")
    tab.wait_for_selector("#drawing .ring")
    press(tab, "#pause")
    tab.wait_for_selector("#status:text-is('paused')")
    press(tab, "#pause")
    tab.wait_for_selector("#again:visible")  # it is left by then
    assert tab.inner_text("#status") == "completed"
    assert tab.inner_text("#log li:last-child").endswith("the mission is completed")
    left = Path(tab.inner_text("#doing").removeprefix("left in "))
    assert left.parent == served.folder / "out"
    assert (left / "log.txt").read_text().splitlines()[-1].split()[2] == f"{stop:.1f}"
    assert tab.locator("#belief rect").count() > 0
    assert tab.locator("#drawing .beam").count() > 0
    press(tab, "#again")
    tab.wait_for_selector("#go:visible")


@pytest.mark.slow
def test_on_a_map_of_a_world_of_one_s_own_nothing_can_be_started(tab: Page) -> None:
    tab.add_init_script("""const { fetch } = window;
      window.fetch = async (path, ...more) => {
        const answer = await fetch(path, ...more);
        return path.startsWith("map?") ? Response.json({ ...await answer.json(), refused: "name its plan" }) : answer;
      };""")
    tab.reload()
    tab.wait_for_selector("#orders li")
    assert tab.inner_text("#mistake") == "name its plan"
    assert tab.is_disabled("#go")


@pytest.mark.slow
def test_mistakes_are_a_line_and_a_mission_is_aborted(tab: Page, served: Served) -> None:
    doors = len(path_along(Map.load(served.folder / "offices.refseq")).doors)
    tab.fill("#text", f"[{'_'.join(['LD'] * (doors + 2))}]")
    tab.press("#text", "Enter")
    tab.wait_for_selector("#mistake:not([hidden])")
    assert f"step {doors + 1}: no door behind" in tab.inner_text("#mistake")
    assert tab.is_disabled("#go")
    tab.fill("#text", "[LD_LDMC]")
    tab.press("#text", "Enter")
    tab.wait_for_selector("#mistake", state="hidden")
    tab.select_option("#speed", "1")
    press(tab, "#go")
    tab.wait_for_selector("#status:text-is('travelling')")
    other = tab.context.new_page()
    other.add_init_script("""const { fetch } = window;  // it knows of another map only
      const maps = "data:,{\\"maps\\":[{\\"name\\":\\"x\\"}],\\"lights\\":[]}", own = "map?name=offices.refseq";
      window.fetch = (path, ...more) => fetch({ maps, "map?name=x": own }[path] ?? path, ...more);""")
    other.goto(served.address)
    other.wait_for_selector("#drawing .ring")
    assert other.input_value("#map") == "offices.refseq"
    assert other.locator("#orders li").all_inner_texts() == tab.locator("#orders li").all_inner_texts(), "it looks on"
    other.close()
    press(tab, "#abort")
    tab.wait_for_selector("#status:text-is('not completed')")
    assert tab.inner_text("#doing").startswith("aborted: somebody asked for it")


@pytest.mark.slow
def test_photographs_have_names_of_their_own_when_steps_have_changed_places(tab: Page) -> None:
    tab.fill("#text", "[LD_LD]")
    tab.press("#text", "Enter")
    tab.wait_for_selector("text=↑")
    photograph = tab.locator("button", has_text="+ photograph")
    photograph.nth(1).click()  # of the second step, which then becomes the first
    tab.locator("button", has_text="↑").click()
    photograph.nth(1).click()
    names = tab.locator("button", has_text="photograph “").all_inner_texts()
    assert names == ["photograph “step 2” ✕", "photograph “step 2 2” ✕"]
    assert tab.is_hidden("#mistake")


@pytest.fixture
def ring(browser: Browser, tmp_path: Path) -> Iterator[Page]:
    """The page of a path whose last two places are its first two again; its 19.0057 m are more when rounded."""
    drive = corridor_drive(np.random.default_rng(3), 20, spacing=1.0003)
    map_ = learn(drive, sensors=["laser"], features=["walls"], name="ring")
    path = replace(map_.paths[0], loops=np.array([[0, 18], [1, 19]]))
    replace(map_, paths=(path,)).save(tmp_path / "ring.refseq")
    desk = MissionDesk(MapShelf(tmp_path / "ring.refseq"), None, lambda line: None)
    with proxied(desk.page(), AccessPolicy()) as page:
        tab = browser.new_page()
        tab.set_default_timeout(PATIENCE / 4)
        tab.goto(page.address)
        tab.wait_for_selector("#orders li")
        yield tab
        tab.close()


@pytest.mark.slow
def test_where_no_end_is_chosen_a_closed_path_is_driven_all_round(ring: Page) -> None:
    assert ring.inner_text("#told") == "The way as it was learnt, 19.0 m"
    ring.select_option("#goal", "ring:9")
    ring.wait_for_function("document.querySelector('#told').textContent === 'The way as it was learnt, 9.0 m'")
    ring.select_option("#goal", label="the path's end")
    ring.wait_for_function("document.querySelector('#told').textContent === 'The way as it was learnt, 19.0 m'")


@pytest.mark.slow
def test_a_step_at_the_last_place_is_on_the_way(ring: Page) -> None:
    press(ring, "#place")
    ring.wait_for_function("document.querySelector('#told').textContent.startsWith('[LA1] ')")
    assert ring.inner_text("#told") == "[LA1] over 19.0 of 19.0 m"
    assert ring.input_value("#steps input[type=number]") == ""
    assert ring.get_attribute("#steps input[type=number]", "placeholder") == "end"


@pytest.mark.slow
def test_a_behaviour_that_is_typed_is_the_step_s(ring: Page) -> None:
    ring.fill("#text", "[LO2MO]")
    ring.press("#text", "Enter")
    ring.wait_for_selector("#steps select")
    assert ring.input_value("#steps select") == "MO"
