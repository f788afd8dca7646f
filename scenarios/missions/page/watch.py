"""A mission as it runs, kept for a page that asks again and again for what is new."""

import math
import threading
import time
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from refseq.belief import Belief
from refseq.missions import Executor, Plan, Status
from refseq.planar import Pose
from refseq.view import Scan, View
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.control_period import CONTROL_PERIOD
from refseq_bench.sim.realtime import RealTimePacer

PAUSE, RESUME, ABORT = WISHES = ("pause", "resume", "abort")
"""Wishes of the page."""
TRACK_EVERY = 0.1
"""Distance between two points of the track [m]."""
LEAST = 0.002
"""Places that are less probable are not drawn."""
BEAMS, FARTHEST = 4, 30.0
"""One beam of so many is drawn, where it is shorter than this [m]."""
QUALITY = [cv2.IMWRITE_JPEG_QUALITY, 80]
WIDTH = 480
"""Width of the pictures on the page [px]."""


@dataclass(frozen=True, slots=True)
class BeliefSeen:
    """Belief of a view: when, the probability of each place that has some, and of being lost; ends of its beams."""

    time: float
    places: list[list[float]]
    lost: float
    best: int
    scan: list[list[float]]


class MissionWatch:
    """Watches a mission in the thread that runs it; other threads ask for its state, pause and abort.

    ``speed`` is simulated over real time, 0: as fast as it goes. While a mission is paused its time is the clock's.
    """

    def __init__(self, plan: Plan, points: NDArray[np.float64], speed: float) -> None:
        self._along, self._points = plan.path.along, points[plan.path.places]
        self._lock = threading.Lock()
        self._paced = RealTimePacer(speed) if speed else None
        self._wanted = ""
        self._log: list[list[Any]] = []
        self._track: list[list[float]] = []
        self._taken: list[tuple[View, Belief]] = []  # since the last look, by the mission's thread alone
        self._seen: list[BeliefSeen] = []
        self._pictures: dict[str, bytes] = {}
        self._now: dict[str, Any] = {}
        self._began: float | None = None

    # --- the mission's thread ---

    def saw(self, view: View, belief: Belief) -> None:
        """Keep a view and what is believed of it until the next look: it does not know itself where it was taken."""
        self._taken.append((view, belief))

    def look(self, executor: Executor, bench: Bench) -> None:
        """Keep the state, and do what the page wants."""
        self._obey(executor)
        pose = bench.pose
        for view, belief in self._taken:
            self._show(view, belief, pose)
        self._taken.clear()
        now = {
            "status": executor.status.value,
            "over": executor.status.over,
            "time": round(executor.time, 2),
            "doing": executor.doing,
            "order": executor.number,
            "tasks": [str(task) for task in executor.tasks],
            "along": round(float(executor.along), 1),
            "believed": self.point(executor.along),
            "robot": [round(pose.x, 3), round(pose.y, 3), round(pose.heading, 3)],
        }
        with self._lock:
            self._now = now
            new = executor.log[len(self._log) :]
            self._log += [[round(one.time, 1), round(one.along, 1), one.what, one.level.value] for one in new]
            here = [round(pose.x, 2), round(pose.y, 2)]
            if not self._track or math.dist(self._track[-1], here) >= TRACK_EVERY:
                self._track.append(here)
        if executor.status is Status.PAUSED:
            time.sleep(CONTROL_PERIOD)
        if self._paced is not None:
            self._paced.keep(executor.time)

    def _show(self, view: View, belief: Belief, pose: Pose) -> None:
        self._began = view.time if self._began is None else self._began
        likely = np.flatnonzero(belief.places >= LEAST)
        seen = BeliefSeen(
            time=round(view.time - self._began, 2),
            places=[[int(place), round(float(belief.places[place]), 3)] for place in likely],
            lost=round(float(belief.lost), 3),
            best=int(belief.best),
            scan=[] if view.scan is None else _scan_points(view.scan, pose),
        )
        pictures = {name: _jpeg(image) for name, image in view.images.items()}
        with self._lock:
            self._seen.append(seen)
            self._pictures = pictures

    def point(self, along: float) -> list[float]:
        """Where so far along the way is [m]."""
        return [round(float(np.interp(along, self._along, self._points[:, axis])), 3) for axis in (0, 1)]

    def _obey(self, executor: Executor) -> None:
        with self._lock:
            wanted, self._wanted = self._wanted, ""
        if wanted == PAUSE:
            executor.pause()
        elif wanted == RESUME:
            executor.resume()
        elif wanted == ABORT:
            executor.abort()

    # --- the page's ---

    def want(self, what: str) -> None:
        """Pause, resume or abort, at the next control period; nothing takes an abort back."""
        with self._lock:
            if self._wanted != ABORT:
                self._wanted = what

    def news(self, log: int, track: int, views: int) -> dict[str, Any]:
        """State, and what came after so many lines of the log, points of the track, and views."""
        with self._lock:
            seen = self._seen[views:]
            return {
                **self._now,
                "log": self._log[log:],
                "track": self._track[track:],
                "views": [[one.time, one.lost, one.best] for one in seen],
                "places": seen[-1].places if seen else None,
                "scan": seen[-1].scan if seen else None,
                "pictures": sorted(self._pictures),
                "seen": len(self._seen),
            }

    def picture(self, camera: str) -> bytes | None:
        """The last view's picture of a camera (JPEG)."""
        with self._lock:
            return self._pictures.get(camera)


def _scan_points(scan: Scan, pose: Pose) -> list[list[float]]:
    """Ends of some beams in the world [m] of a scan that was taken at a pose."""
    ranges, towards = scan.ranges[::BEAMS].astype(float), pose.heading + scan.bearings[::BEAMS]
    ends = np.stack([pose.x + ranges * np.cos(towards), pose.y + ranges * np.sin(towards)], axis=1)
    ends = ends[np.isfinite(ranges) & (ranges < FARTHEST)]
    found: list[list[float]] = np.round(ends, 2).tolist()
    return found


def _jpeg(image: NDArray[np.uint8]) -> bytes:
    height, width = image.shape[:2]
    small = cv2.resize(image, (WIDTH, round(WIDTH * height / width)), interpolation=cv2.INTER_AREA)
    return bytes(cv2.imencode(".jpg", small, QUALITY)[1].tobytes())
