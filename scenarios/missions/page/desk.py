"""The desk of missions: the page asks from its thread, the command runs one mission after another in its own."""

import queue
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

import cv2

from refseq.access.own_page import asked, file_routes, shown, told
from refseq.access.policy import AccessPolicy
from refseq.access.proxy import ProxiedPage, proxied
from refseq.map.map import Map
from refseq_bench.scenarios.errors import ScenarioError, input_errors
from refseq_bench.scenarios.missions.page.maps import MapShelf, drawn_map, place_points
from refseq_bench.scenarios.missions.page.request import (
    MissionRequest,
    PlannedMission,
    behaviours_offered,
    drawn_plan,
    planned,
    steps_of,
)
from refseq_bench.scenarios.missions.page.watch import WISHES, MissionWatch
from refseq_bench.scenarios.missions.trip import MissionTrip, TripResult, run_trip, write_trip
from refseq_bench.worlds.light import light_names
from refseq_bench.worlds.plans.load import load_plan

FILES = ("mission.css", "mission.js")
POLL = 0.5
"""Period in which Ctrl-C is heard while nothing is asked for [s]."""


class DeskState(StrEnum):
    """State of the desk."""

    IDLE = "idle"
    OPENING = "opening"
    RUNNING = "running"
    OVER = "over"


@dataclass(frozen=True)
class Job:
    """A mission to run: the request's number, the names and drawings that pages show, and all that it needs.

    ``name`` is the map's on the page, ``drawn`` the plan as all pages show it.
    """

    number: int
    name: str
    drawn: dict[str, Any]
    trip: MissionTrip
    map: Map
    mission: PlannedMission
    watch: MissionWatch


class MissionDesk:
    """Runs missions that a page asks for, each left in a folder of its own in ``output``, None: not left.

    ``said`` hears a line when a mission begins and ends. ``world`` is that of all missions, None: each map's own.
    Raises ``PlanError`` for one that is not there.
    """

    def __init__(
        self, shelf: MapShelf, output: Path | None, said: Callable[[str], object], world: str | None = None
    ) -> None:
        if world is not None:
            load_plan(world)
        self._shelf, self._output, self._said, self._world = shelf, output, said, world
        self._lock = threading.Lock()
        self._jobs: queue.Queue[Job] = queue.Queue(1)
        self._state, self._number = DeskState.IDLE, 0
        self._job: Job | None = None
        self._result: dict[str, Any] = {}
        self._photographs: Mapping[str, bytes] = {}

    # --- the page's thread ---

    def page(self) -> ProxiedPage:
        """Routes of the page."""
        routes = (
            *file_routes(__package__ or "", FILES, "mission.html"),
            told("/maps", lambda _: self.maps(), input_errors),
            told("/map", self.map, input_errors),
            told("/state", self.news, input_errors),
            asked("/plan", self.plan, input_errors),
            asked("/steps", lambda told: {"steps": steps_of(str(told.get("text", "")))}, input_errors),
            asked("/start", self.start, input_errors),
            asked("/do", self.do, input_errors),
            shown("/picture", self.picture),
        )
        return ProxiedPage(routes, lambda _: "/page")

    def maps(self) -> dict[str, Any]:
        """Names to choose from: maps, light, and behaviours."""
        return {"maps": self._shelf.listed(), "lights": light_names(), "behaviours": behaviours_offered()}

    def map(self, query: Mapping[str, str]) -> dict[str, Any]:
        """A map to draw, by its name."""
        return drawn_map(self._shelf.load(query.get("name")), self._world)

    def plan(self, told: dict[str, Any]) -> dict[str, Any]:
        """Compile a mission, and tell what the robot would do."""
        request = MissionRequest.read(told)
        map_ = self._shelf.load(request.map)
        return drawn_plan(planned(request, map_), place_points(map_))

    def start(self, told: dict[str, Any]) -> dict[str, Any]:
        """Have a mission run. Raises ``ScenarioError`` while another one does."""
        request = MissionRequest.read(told)
        map_ = self._shelf.load(request.map)
        mission, points = planned(request, map_), place_points(map_)
        drawn = drawn_plan(mission, points)
        trip = request.drive.trip(map_, self._world, takes_pictures=mission.plan.takes_pictures)
        with self._lock:
            if self._state in (DeskState.OPENING, DeskState.RUNNING):
                raise ScenarioError("a mission runs already; valid is to wait for its end, or to abort it")
            self._number += 1
            watch = MissionWatch(mission.plan, points, request.drive.speed)
            self._job = Job(self._number, request.map, drawn, trip, map_, mission, watch)
            self._state, self._result, self._photographs = DeskState.OPENING, {}, {}
            self._jobs.put_nowait(self._job)
        return {"number": self._number, "plan": drawn}

    def do(self, told: dict[str, Any]) -> dict[str, Any]:
        """Pause, resume or abort the mission that runs."""
        what = told.get("do")
        if what not in WISHES:
            raise ScenarioError(f"do = {what!r:.40} is not valid; valid are {', '.join(WISHES)}")
        if self._job is None or self._state not in (DeskState.OPENING, DeskState.RUNNING):
            raise ScenarioError(f"no mission runs; there is nothing to {what}")
        self._job.watch.want(what)
        return {}

    def news(self, query: Mapping[str, str]) -> dict[str, Any]:
        """State of the desk and of the mission, with what is new since the numbers that the page tells."""
        counts = [_count(query.get(name, "0")) for name in ("log", "track", "views")]
        with self._lock:
            job, known = self._job, {"state": self._state, "number": self._number, "result": self._result}
        if job is None:
            return known
        if query.get("number") == str(job.number):
            return {**known, **job.watch.news(*counts)}
        # A page that was opened later, or watched another mission, has none of this one's lines, nor its map.
        return {**known, **job.watch.news(0, 0, 0), "map": job.name, "plan": job.drawn}

    def picture(self, query: Mapping[str, str]) -> bytes | None:
        """A camera's last picture, or a photograph of the mission."""
        if "photograph" in query:
            return self._photographs.get(query["photograph"])
        return self._job.watch.picture(query.get("camera", "")) if self._job else None

    # --- the command's thread ---

    def serve(self, policy: AccessPolicy, opened: Callable[[str], object]) -> int:
        """Serve the page and run missions until Ctrl-C; the number of missions. ``opened`` is told the address."""
        with proxied(self.page(), policy) as proxy:
            opened(proxy.address)
            try:
                while True:
                    self.run_next(POLL)
            except KeyboardInterrupt:
                return self._number

    def run_next(self, patience: float) -> bool:
        """Run the mission that was asked for, if one is within ``patience`` [s]."""
        try:
            job = self._jobs.get(timeout=patience)
        except queue.Empty:
            return False
        with self._lock:
            self._state = DeskState.RUNNING
        self._said(f"mission {job.number}: {job.mission.text or 'as learnt'} in {job.trip.drive.world}")
        result: dict[str, Any] = {"completed": False, "why": "it was interrupted"}
        photographs: Mapping[str, bytes] = {}
        try:
            made = run_trip(job.trip, job.map, job.mission.plan, watcher=job.watch)
            photographs = _photographs(made)
            result = self._told(job, made) | {"photographs": sorted(photographs)}
        except input_errors() as error:
            result = {"completed": False, "why": " ".join(str(error).split())}
        finally:
            with self._lock:
                self._state, self._result, self._photographs = DeskState.OVER, result, photographs
        ended = "; ".join(filter(None, ("completed" if result["completed"] else "", result["why"])))
        self._said(f"mission {job.number}: {ended}")
        return True

    def _told(self, job: Job, made: TripResult) -> dict[str, Any]:
        run, left, why = made.done.run, "", made.done.run.why
        try:
            left = "" if self._output is None else self._leave(self._output, job, made)
        except ScenarioError as error:
            why = "; ".join(filter(None, (why, str(error))))
        return {"completed": run.completed, "why": why, "touched": list(run.touched), "left": left}

    def _leave(self, output: Path, job: Job, made: TripResult) -> str:
        """Leave log, plan, record and photographs in the next folder that is free."""
        number = job.number
        while (folder := output / f"mission-{number}").exists():
            number += 1
        try:
            folder.mkdir(parents=True)
            write_trip(folder, job.trip, made)
        except OSError as error:
            raise ScenarioError(f"{folder}: cannot be written: {error.strerror or error}") from error
        return str(folder)


def _count(text: str) -> int:
    """A number of lines as a page tells it, 0 for what is none."""
    return int(text) if text.isascii() and text.isdecimal() and len(text) < 10 else 0


def _photographs(made: TripResult) -> dict[str, bytes]:
    """Photographs by what they are called, with the camera behind (JPEG)."""
    return {
        f"{name}, {camera}": bytes(cv2.imencode(".jpg", image)[1].tobytes())
        for name, images in made.done.photographs.items()
        for camera, image in images.items()
    }
