"""Rerun's viewer on an environment as it runs: the robot from behind, where it is in the plan, how far the goal is."""

import os
import sys
import weakref
from contextlib import ExitStack
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

# Rerun, which is imported next, tells on the terminal in several lines what goes wrong; ours is one line.
os.environ.setdefault("RUST_LOG", "off")

import rerun as rr
import rerun.blueprint as rrb

from refseq.access.listener import free_port
from refseq.errors import RefseqError
from refseq.planar import Pose, in_world
from refseq.viewer.checks import check_display
from refseq.viewer.drawing import colours
from refseq.viewer.drawing.plane import ROBOT, north_up
from refseq.viewer.drawing.trail import Trail
from refseq.viewer.sinks import served, spawned
from refseq_bench.sim.errors import SimError
from refseq_bench.worlds.plans.schema import FloorPlan

LIVE = rr.ChunkBatcherConfig(flush_tick=0.2)
"""Time that the viewer waits for what was logged [s]; a choice."""
TIME, STEP = "time", "step"
"""Time lines: simulated seconds of all episodes one after the other, and steps."""


@dataclass(frozen=True, slots=True, eq=False)
class DisplayedStep:
    """One moment of an episode at ``time`` [s] after its begin.

    ``picture`` (height, width) is taken from behind the robot; ``points`` (n, 2) [m] are where the laser's beams ended,
    in the robot's frame; ``remaining`` is the distance to the goal in the task's measure; ``told`` is a line.
    """

    time: float
    pose: Pose
    picture: NDArray[np.uint8]
    points: NDArray[np.float64]
    remaining: float
    reward: float
    told: str


class EpisodeDisplay:
    """A viewer for one environment called ``name``: a window, or without a display a page for a browser.

    The page's address is told in one line on stderr. A window stays open when it is closed, a page does not. Raises
    ``SimError`` when neither can be had.
    """

    def __init__(self, name: str) -> None:
        self._name, self._stack = name, ExitStack()
        # Whoever never calls close leaves no server behind.
        self._ending = weakref.finalize(self, _end, self._stack, name)
        try:
            self._stream = self._opened()
        except RefseqError as error:
            raise SimError(f"render mode 'human': {error}") from error
        self._trail, self._return = Trail(), 0.0
        self._steps, self._begun, self._last = 0, 0.0, 0.0
        self._stream.send_recording_name(name)
        self._stream.send_blueprint(_layout())
        for entity, colour in (("remaining", colours.BELIEVED), ("return", colours.TRUTH)):
            self._stream.log(f"score/{entity}", rr.SeriesLines(colors=[colour], names=[entity]), static=True)

    def _opened(self) -> rr.RecordingStream:
        try:
            check_display()
        except RefseqError:
            stream, page = self._stack.enter_context(served(free_port(), self._name, batches=LIVE))
            print(f"{self._name}: no display here; open {page} in a browser of this machine", file=sys.stderr)
            return stream
        return self._stack.enter_context(spawned(self._name, batches=LIVE))

    def begin(self, plan: FloorPlan, route: NDArray[np.float64]) -> None:
        """Draw the ``plan`` of a new episode and its ``route`` (n, 2) [m]; what came before stays on the time lines."""
        self._trail, self._return, self._begun = Trail(), 0.0, self._last
        walls = [north_up(np.array([wall.start, wall.end])) for wall in plan.wall]
        self._stamp(0.0)
        self._stream.log("plan/walls", rr.LineStrips2D(walls, colors=[colours.WALL], radii=[-1.0]))
        self._stream.log("plan/route", rr.LineStrips2D([north_up(route)], colors=[colours.REFERENCE], radii=[-0.8]))

    def show(self, step: DisplayedStep) -> None:
        """Show the next moment."""
        log, pose = self._stream.log, step.pose
        self._stamp(step.time)
        self._steps += 1
        self._return += step.reward
        self._trail.add(pose)
        log("robot/picture", rr.Image(step.picture, color_model="L").compress(jpeg_quality=85))
        log("told", rr.TextDocument(step.told))
        scan = north_up(in_world(step.points, pose))
        log("plan/scan", rr.Points2D(scan, colors=[colours.SCAN], radii=[-0.7]))
        log("plan/trail", rr.LineStrips2D([north_up(self._trail.points)], colors=[colours.TRUTH], radii=[-0.8]))
        log("plan/robot", rr.LineStrips2D([north_up(in_world(ROBOT, pose))], colors=[colours.TRUTH], radii=[-1.5]))
        log("score/remaining", rr.Scalars(step.remaining))
        log("score/return", rr.Scalars(self._return))

    def _stamp(self, time: float) -> None:
        self._last = self._begun + time
        self._stream.set_time(TIME, duration=self._last)
        self._stream.set_time(STEP, sequence=self._steps)

    def close(self) -> None:
        """Let the viewer have what is under way, and end the page; a second call does nothing."""
        self._ending()


def _end(stack: ExitStack, name: str) -> None:
    try:
        stack.close()
    except RefseqError as error:  # somebody has closed the window: no reason to stop a program
        print(f"{name}: {error}", file=sys.stderr)


def _layout() -> rrb.Blueprint:
    robot = rrb.Vertical(
        rrb.Spatial2DView(origin="robot", name="robot"),
        rrb.TextDocumentView(origin="told", name="now"),
        row_shares=[5, 1],
    )
    plan = rrb.Vertical(
        rrb.Spatial2DView(origin="plan", name="plan"),
        rrb.TimeSeriesView(origin="score", name="distance to the goal, return"),
        row_shares=[3, 2],
    )
    return rrb.Blueprint(
        rrb.Horizontal(robot, plan),
        rrb.TimePanel(state="collapsed", timeline=TIME, play_state="following"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
    )
