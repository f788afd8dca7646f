"""Log of the robot's sensors, view by view: pictures, the scan with its walls and doors, the robot in the plan."""

from dataclasses import dataclass, field

import numpy as np
import rerun as rr

from refseq.features.doors import DetectedDoor, DoorSettings, doors_in
from refseq.features.walls import WallSettings, find_lines, walls_in
from refseq.planar import Pose, after_motion, in_world
from refseq.view import Scan, View
from refseq.viewer.drawing import colours
from refseq.viewer.drawing.pictures import frame
from refseq.viewer.drawing.plane import ORIGIN, ROBOT, Points, circle, north_up, returns, robot_up
from refseq.viewer.drawing.trail import Trail

RINGS = (2.0, 5.0, 10.0, 20.0)
"""Distances that are marked around the robot [m]."""


@dataclass
class DriveLog:
    """Logs a drive under ``now``, ``laser`` and ``plan``; the caller sets the moment.

    ``framed``: true poses or those of a map are known, so that a pose from odometry would be in another frame; without
    them the plan is drawn from odometry.
    """

    stream: rr.RecordingStream
    framed: bool
    walls: WallSettings = field(default_factory=WallSettings)
    doors: DoorSettings = field(default_factory=DoorSettings)
    _odometry: Pose | None = None
    _scanned: bool = False
    _trail: Trail = field(default_factory=Trail)
    _cameras: set[str] = field(default_factory=set)

    def begin(self) -> None:
        """Log what does not change."""
        log = self.stream.log
        log("laser/rings", rr.LineStrips2D([circle(r) for r in RINGS], colors=colours.DIM, radii=-0.5), static=True)
        labels = [f"{radius:g} m" for radius in RINGS]
        at = [(0, -radius) for radius in RINGS]
        log("laser/metres", rr.Points2D(at, labels=labels, colors=colours.DIM, radii=-1), static=True)
        log("laser/robot", rr.LineStrips2D([robot_up(ROBOT)], colors=colours.TRUTH, radii=-1), static=True)

    def update(self, view: View) -> Pose | None:
        """Log a view; gives back the pose that it was drawn at."""
        self._cameras |= view.images.keys()
        for camera in sorted(self._cameras):
            self.stream.log(f"now/{camera}", frame(view, camera))
        if view.scan is not None:
            self._log_scan(view, view.scan)
            self._scanned = True
        elif self._scanned:
            for part in ("scan", "walls", "doors"):
                self.stream.log(f"laser/{part}", rr.Clear(recursive=False))
        pose = self._pose(view)
        self._log_plan(view, pose)
        return pose

    def _pose(self, view: View) -> Pose | None:
        if self.framed or view.truth is not None:
            return view.truth
        self._odometry = ORIGIN if self._odometry is None else after_motion(self._odometry, view.distance, view.turn)
        return self._odometry

    def _log_scan(self, view: View, scan: Scan) -> None:
        log = self.stream.log
        log("laser/scan", rr.Points2D(robot_up(returns(view)), colors=[colours.SCAN], radii=[-1.5]))
        lines = find_lines(scan, self.walls)
        long = walls_in(lines, self.walls)
        walls = [robot_up(np.stack(ends)) for ends in zip(long.start, long.end, strict=True)]
        log("laser/walls", rr.LineStrips2D(walls, colors=[colours.WALL], radii=[-1.5], draw_order=40))
        doors = doors_in(lines, scan, self.doors, self.walls)
        sills = [robot_up(sill(door)) for door in doors]
        labels = [f"door, {'free' if door.passable else 'blocked'}" for door in doors]
        log("laser/doors", rr.LineStrips2D(sills, labels=labels, colors=[colours.DOOR], radii=[-2.5], draw_order=50))

    def _log_plan(self, view: View, pose: Pose | None) -> None:
        log = self.stream.log
        if pose is None:
            for part in ("scan", "robot"):
                log(f"plan/{part}", rr.Clear(recursive=False))
            return
        if self._scanned:
            scan = north_up(in_world(returns(view), pose))
            log("plan/scan", rr.Points2D(scan, colors=[colours.SCAN], radii=[-0.7]))
        log("plan/robot", rr.LineStrips2D([north_up(in_world(ROBOT, pose))], colors=[colours.TRUTH], radii=[-1.2]))
        self._trail.add(pose)
        log("plan/drive", rr.LineStrips2D([north_up(self._trail.points)], colors=[colours.TRUTH], radii=[-0.8]))


def sill(door: DetectedDoor) -> Points:
    """The line across a door, (2, 2) [m], in the scanner's frame."""
    across = np.array([-np.sin(door.heading), np.cos(door.heading)]) * door.width / 2
    return np.array([door.centre - across, door.centre + across])
