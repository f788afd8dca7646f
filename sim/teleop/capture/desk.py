"""The desk of captures: the page asks and is told from its thread, the drive in its own."""

import math
import threading
import time
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import cv2

from refseq.access.own_page import asked, file_routes, shown, told
from refseq.access.proxy import ProxyRoute
from refseq.logs.notes import checked_notes
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.teleop.capture.setup import CaptureSetup
from refseq_bench.sim.teleop.commands import SessionStatus
from refseq_bench.sim.teleop.keys import FASTER, GO_ON, GOES_ON, HELD, LEGEND, OTHER_LOOK, PRESSED, SLOWER
from refseq_bench.sim.teleop.pictures import Picture

FILES = ("capture.css", "capture.js")
DEADMAN = 0.5
"""Keys count as held for so long after they were reported [s]; less stops the robot on a slow machine."""
SILENT = 1.5
"""A page is there for so long after it asked something [s]; a hidden one asks once a second."""
POLL = 0.5
"""Period in which Ctrl-C is heard while a set-up is waited for [s]."""
KEYS = frozenset((GO_ON, FASTER, SLOWER, OTHER_LOOK, *PRESSED))
MOST_PRESSED = 64
"""Keys that wait to be taken; of more the oldest stay."""


class DeskPhase(StrEnum):
    """Phase of the desk."""

    SETUP = "setup"
    DRIVING = "driving"
    FINISHED = "finished"


@dataclass(frozen=True, slots=True)
class Offer:
    """A set-up to begin with, the sensors that are valid, and a check that raises ``SimError``.

    ``last`` tells in a line what became of the drive before.
    """

    setup: CaptureSetup
    valid: tuple[str, ...]
    check: Callable[[CaptureSetup], None] = lambda setup: None
    last: str = ""


class CaptureDesk:
    """Set-up, status and keys between a page and drives; ``setup`` given: there is one drive, which has begun."""

    def __init__(self, setup: CaptureSetup | None = None) -> None:
        self._changed = threading.Condition()
        self._phase = DeskPhase.DRIVING if setup else DeskPhase.SETUP
        self._setup, self._offer = setup, None if setup is None else Offer(setup, setup.sensors)
        self._one = setup is not None
        self._held: tuple[frozenset[str], float] = frozenset(), -math.inf
        self._asked = -math.inf
        self._pressed: list[str] = []
        self._status, self._speed = SessionStatus(), 0.0
        self._pictures: Mapping[str, bytes] = {}
        self._pictured = 0
        self.notes = setup.notes if setup else ""

    # --- the drive's thread ---

    def next_setup(self, offer: Offer) -> CaptureSetup | None:
        """Wait for a person to begin with a drive; None: there is to be none any more."""
        with self._changed:
            self._offer, self._phase, self._setup = offer, DeskPhase.SETUP, None
            while self._phase is DeskPhase.SETUP:
                self._changed.wait(POLL)
            return self._setup

    def take(self) -> tuple[frozenset[str] | None, list[str]]:
        """Keys that are held, None where no page is there, and those that were pressed since the last call."""
        now = time.monotonic()
        with self._changed:
            pressed, self._pressed = self._pressed, []
            keys, at = self._held
            there = now - self._asked <= SILENT
            return (keys if now - at <= DEADMAN else frozenset()) if there else None, pressed

    def show(self, status: SessionStatus, speed: float, pictures: tuple[Picture, ...]) -> None:
        """Show a status, the keys' speed [m/s], and pictures of the last view."""
        with self._changed:
            self._status, self._speed = status, speed
            if status.count != self._pictured:
                self._pictured = status.count
                self._pictures = {one.name: _jpeg(one) for one in pictures}

    # --- the page's thread ---

    def routes(self) -> tuple[ProxyRoute, ...]:
        """Routes of the page."""
        return (
            *file_routes(__package__ or "", FILES, "capture.html"),
            told("/capture", lambda _: self.news()),
            asked("/begin", self.begin, _known),
            asked("/keys", self.press, _known),
            asked("/notes", self.note, _known),
            asked("/finish", lambda _: self.finish(), _known),
            shown("/picture", lambda query: self._pictures.get(query.get("sensor", ""))),
        )

    def begin(self, told: dict[str, Any]) -> dict[str, Any]:
        """Begin with a drive. Raises ``SimError``, or what the offer's check does, for a set-up that is not valid."""
        with self._changed:
            if self._phase is not DeskPhase.SETUP or self._offer is None:
                raise SimError("a drive is under way; valid is to stop or abort it first")
            setup = CaptureSetup.read(told, self._offer.valid)
            self._offer.check(setup)
            self._setup, self._phase, self.notes = setup, DeskPhase.DRIVING, setup.notes
            self._status, self._pictures, self._pictured = SessionStatus(), {}, 0
            self._pressed.clear()
            self._changed.notify_all()
        return {}

    def press(self, told: dict[str, Any]) -> dict[str, Any]:
        """Take the keys that are held, and those that were pressed."""
        held, pressed = told.get("held", []), told.get("pressed", [])
        if not _all_in(held, HELD):
            raise SimError(f"held = {held!r:.60} is not valid; valid are {', '.join(HELD)}")
        if not _all_in(pressed, KEYS):
            raise SimError(f"pressed = {pressed!r:.60} is not valid; valid are {', '.join(sorted(KEYS))}")
        with self._changed:
            self._held, self._asked = (frozenset(held), time.monotonic()), time.monotonic()
            self._pressed = (self._pressed + pressed)[:MOST_PRESSED]
        return {}

    def note(self, told: dict[str, Any]) -> dict[str, Any]:
        """Take other notes for the drive that is under way."""
        notes = told.get("notes")
        if not isinstance(notes, str):
            raise SimError("notes are no text")
        self.notes = checked_notes(notes)
        return {}

    def finish(self) -> dict[str, Any]:
        """Let the command end; there must be no drive under way."""
        with self._changed:
            if self._phase is DeskPhase.DRIVING:
                raise SimError("a drive is under way; valid is to stop or abort it first")
            self._phase = DeskPhase.FINISHED
            self._changed.notify_all()
        return {}

    def news(self) -> dict[str, Any]:
        """All that the page shows."""
        with self._changed:
            self._asked = time.monotonic()
            offer, shown = self._offer, self._setup or (self._offer.setup if self._offer else None)
            return {
                "phase": self._phase,
                "one": self._one,
                "setup": shown.as_told() if shown else None,
                "valid": list(offer.valid) if offer else [],
                "last": offer.last if offer else "",
                "status": _told(self._status, self._speed),
                "pictures": sorted(self._pictures),
                "notes": self.notes,
                "legend": LEGEND,
            }


def _jpeg(picture: Picture) -> bytes:
    return bytes(cv2.imencode(".jpg", picture.pixels[..., ::-1])[1].tobytes())


def _all_in(told: object, valid: Collection[str]) -> bool:
    """Tell whether what was sent is a list of valid names."""
    return isinstance(told, list) and all(isinstance(one, str) and one in valid for one in told)


def _known() -> tuple[type[Exception], ...]:
    """Mistakes that the page is told of."""
    return (SimError,)


def _told(status: SessionStatus, speed: float) -> dict[str, Any]:
    """A status in words."""
    moved, going = status.moved, GOES_ON.get(status.phase)
    stops = [f"stopped: {one}" for one in status.stops]
    last = "none yet" if status.view is None else f"at {status.view.time:.1f} s"
    rate = f", {status.rate:.1f} a minute" if status.count > 1 else ""
    return {
        "phase": status.phase,
        "go": str(going) if going else "",
        "count": status.count,
        "moves": status.time > 0,
        "warnings": [*stops, status.note] if status.note else stops,
        "figures": [
            ["Views", f"{status.count}{rate}"],
            ["Last view", last],
            ["Since then", f"{moved.distance:.2f} m, {math.degrees(moved.turn):.0f}°, {moved.time:.1f} s"],
            ["Time, way", f"{status.time:.1f} s, {status.travelled:.1f} m"],
            ["Speed", f"{status.twist.linear:.2f} m/s of {speed:.2f}, {status.twist.angular:.2f} rad/s"],
        ],
    }
