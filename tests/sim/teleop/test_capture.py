"""The desk of captures: a set-up is read as it was filled in, begun once, and what is not valid is a line."""

import math
import re
import threading
from typing import Any

import numpy as np
import pytest

from refseq.errors import RefseqError
from refseq.view import View
from refseq_bench.robots import Twist
from refseq_bench.sim.drives.trigger import Moved, Trigger
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.teleop.capture.desk import CaptureDesk, Offer
from refseq_bench.sim.teleop.capture.setup import CaptureSetup
from refseq_bench.sim.teleop.commands import SessionPhase, SessionStatus
from refseq_bench.sim.teleop.keys import GO_ON
from refseq_bench.sim.teleop.pictures import Picture

VALID = ("camera-1", "camera-2", "laser")
FILLED: dict[str, Any] = {
    "name": "kitchen 2",
    "notes": " wet floor \n",
    "sensors": ["laser", "camera-1"],
    "distance": 0.5,
    "turn": 30,
    "time": None,
}


def test_a_set_up_is_what_was_filled_in_and_is_shown_as_such() -> None:
    setup = CaptureSetup.read(FILLED, VALID)
    trigger = Trigger(distance=0.5, turn=math.radians(30))
    assert setup == CaptureSetup("kitchen 2", "wet floor", ("camera-1", "laser"), trigger)
    shown = setup.as_told()
    assert CaptureSetup.read(shown, VALID) == setup
    assert (shown["distance"], shown["turn"], shown["time"]) == (0.5, 30.0, None)


@pytest.mark.parametrize("name", ["küche", "廊下 2", "a", "x" * 60])
def test_names_are_letters_of_any_language(name: str) -> None:
    assert CaptureSetup.read({**FILLED, "name": name}, VALID).name == name


def test_without_a_threshold_views_are_taken_by_hand() -> None:
    assert CaptureSetup.read({**FILLED, "distance": None, "turn": None}, VALID).sampling is None


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"name": "../evil"}, "name '../evil' is not valid; valid are up to 60 letters"),
        ({"name": ""}, "name '' is not valid"),
        ({"name": "ü/ü"}, "name 'ü/ü' is not valid"),
        ({"name": " ü"}, "name ' ü' is not valid"),
        ({"name": None}, "name None is not valid"),
        ({"notes": 3}, "notes are no text"),
        ({"notes": "bell \a"}, "notes: '\\x07' is no character of a text"),
        ({"sensors": []}, "sensors [] are not valid; valid are one or more of camera-1, camera-2, laser"),
        ({"sensors": ["sonar"]}, "sensors ['sonar'] are not valid"),
        ({"distance": 0}, "distance = 0 is not valid; valid is 0.01 to 1000 m, or nothing"),
        ({"distance": "1"}, "distance = '1' is not valid"),
        ({"distance": True}, "distance = True is not valid"),
        ({"turn": 361}, "turn = 361 is not valid; valid is 1 to 360 degrees"),
        ({"time": math.nan}, "time = nan is not valid; valid is 0.04 to 3600 s"),
    ],
)
def test_what_is_not_valid_is_told_in_a_line(changed: dict[str, Any], told: str) -> None:
    with pytest.raises((SimError, RefseqError), match=re.escape(told)):
        CaptureSetup.read({**FILLED, **changed}, VALID)


def offered(desk: CaptureDesk, check: Any = lambda setup: None) -> tuple[threading.Thread, list[CaptureSetup | None]]:
    found: list[CaptureSetup | None] = []
    offer = Offer(CaptureSetup.read(FILLED, VALID), VALID, check, "last time it rained")
    thread = threading.Thread(target=lambda: found.append(desk.next_setup(offer)))
    thread.start()
    while (news := desk.news())["setup"] is None or news["phase"] != "setup":
        pass
    return thread, found


def test_a_drive_begins_once_with_the_set_up_that_was_sent() -> None:
    desk = CaptureDesk()
    thread, found = offered(desk)
    news = desk.news()
    assert (news["phase"], news["last"], news["valid"]) == ("setup", "last time it rained", list(VALID))
    desk.begin({**FILLED, "name": "hall"})
    assert desk.notes == "wet floor", "notes that follow at once are not overwritten when the drive's thread wakes"
    thread.join()
    assert [one.name for one in found if one] == ["hall"]
    assert (desk.news()["phase"], desk.notes) == ("driving", "wet floor")
    for ask in (lambda: desk.begin(FILLED), desk.finish):
        with pytest.raises(SimError, match="a drive is under way; valid is to stop or abort it first"):
            ask()
    desk.note({"notes": "dry by now "})
    assert desk.notes == "dry by now"


def test_a_drive_begins_without_keys_and_pictures_of_the_one_before() -> None:
    """A key that was pressed while the next one was set up would start it at once."""
    desk = CaptureDesk()
    for sensor in ("camera-1", "laser"):
        thread, _ = offered(desk)
        desk.press({"pressed": [GO_ON]})
        desk.begin(FILLED)
        thread.join()
        assert desk.news()["pictures"] == []
        assert desk.take() == (frozenset(), [])
        desk.show(SessionStatus(count=1), 0.4, (Picture(sensor, np.zeros((2, 2, 3), np.uint8)),))
        assert desk.news()["pictures"] == [sensor]


def test_figures_are_in_the_units_that_stand_behind_them() -> None:
    desk, moved = CaptureDesk(), Moved(0.25, math.radians(-30), 1.5)
    status = SessionStatus(
        *(12.0, SessionPhase.SAMPLING, 3, View(10.5), 4.25, moved, 7.75),
        twist=Twist(0.3, -0.25),
    )
    desk.show(status, 0.6, ())
    assert desk.news()["status"]["figures"] == [
        ["Views", "3, 4.2 a minute"],
        ["Last view", "at 10.5 s"],
        ["Since then", "0.25 m, -30°, 1.5 s"],
        ["Time, way", "12.0 s, 7.8 m"],
        ["Speed", "0.30 m/s of 0.60, -0.25 rad/s"],
    ]


def test_a_set_up_that_is_refused_begins_nothing_and_one_may_finish() -> None:
    def refuse(setup: CaptureSetup) -> None:
        raise SimError(f"{setup.name} is there already")

    desk = CaptureDesk()
    thread, found = offered(desk, refuse)
    with pytest.raises(SimError, match="kitchen 2 is there already"):
        desk.begin(FILLED)
    assert desk.news()["phase"] == "setup"
    desk.finish()
    thread.join()
    assert found == [None]
    assert desk.news()["phase"] == "finished"


@pytest.mark.parametrize(
    "told", [{"held": ["Q"]}, {"held": "W"}, {"held": [["W"]]}, {"pressed": ["W"]}, {"pressed": [{}]}]
)
def test_keys_that_nobody_knows_are_refused(told: dict[str, Any]) -> None:
    with pytest.raises(SimError, match="is not valid; valid are "):
        CaptureDesk().press(told)
