"""The tab *Mission*: the way and its steps, what the robot does and believes, and the executor's log, as recorded."""

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import rerun as rr
import rerun.blueprint as rrb

from refseq.missions import Plan, Status, Task
from refseq.viewer.drawing.colours import BELIEVED, LOST, MATCHED, REFERENCE, TRUTH, Colour
from refseq.viewer.drawing.pictures import kept
from refseq.viewer.drawing.trail import Trail
from refseq.viewer.mission.plan import MissionPlan
from refseq.viewer.mission.record import Instant, LocalisedView, MissionRecord
from refseq.viewer.timelines import DISTANCE, TIME, VIEW

STANDING = "stands"
"""State shown when no behaviour runs."""
STATUS: dict[Status, Colour] = {
    Status.LOCALISING: BELIEVED,
    Status.TRAVELLING: MATCHED,
    Status.APPROACHING: MATCHED,
    Status.MANOEUVRING: MATCHED,
    Status.AT_TASK: TRUTH,
    Status.LOST: LOST,
    Status.PAUSED: REFERENCE,
    Status.COMPLETED: MATCHED,
    Status.FAILED: LOST,
    Status.ABORTED: LOST,
}


@dataclass(frozen=True)
class MissionTab:
    """A mission's ``record``, shown as it is."""

    record: MissionRecord

    @property
    def name(self) -> str:
        """The tab's title."""
        return "Mission"

    @cached_property
    def _plan(self) -> MissionPlan:
        return MissionPlan(self.record)

    @cached_property
    def _cameras(self) -> list[str]:
        return sorted({camera for seen in self.record.views for camera in seen.frames})

    @property
    def _to_go(self) -> tuple[float, float]:
        """The least and the most that was left to go, 0 among them, and a little more to either side [m]."""
        left = [0.0, *(self.record.plan.goal - instant.along for instant in self.record.instants)]
        margin = 0.05 * (max(left) - min(left)) or 1.0
        return min(left) - margin, max(left) + margin

    # --- layout ---

    def layout(self) -> rrb.Container:
        """The plan, cameras and steps on top; below what is done over time, how far it is, P(lost), and the log."""
        extent = self._plan.extent
        cameras = [rrb.Spatial2DView(origin=f"mission/camera/{name}", name=name) for name in self._cameras]
        steps = rrb.TextDocumentView(origin="mission/steps", name="steps")
        log = rrb.TextLogView(
            origin="mission/log",
            name="log",
            columns=rrb.TextLogColumns(timeline_columns=[], text_log_columns=["loglevel", "body"]),
            format_options=rrb.TextLogFormat(monospace_body=True),
        )
        curves = [
            rrb.TimeSeriesView(
                origin="mission/to_go",
                name="believed to be left to go [m]",
                axis_y=rrb.ScalarAxis(range=self._to_go),
                plot_legend=_NONE,
            )
        ]
        if self.record.views:
            curves.append(
                rrb.TimeSeriesView(
                    origin="mission/lost",
                    name="P(lost)",
                    axis_y=rrb.ScalarAxis(range=(-0.03, 1.03), zoom_lock=True),
                    plot_legend=_NONE,
                )
            )
        doing = rrb.StateTimelineView(origin="mission/doing", name="what it does")
        told, over_time = (
            rrb.Vertical(steps, log),
            rrb.Vertical(doing, *curves, row_shares=[1.0, 1.4, 1.0][: 1 + len(curves)]),
        )
        seen = [rrb.Vertical(*cameras)] if cameras else []
        plan = [] if extent is None else [self._plan.view(extent)]
        if extent is None or extent.wide:
            below = rrb.Horizontal(*seen, told, over_time, column_shares=[*[0.7] * len(seen), 1.2, 1.0])
            return rrb.Vertical(*plan, below, row_shares=[*[1.0] * len(plan), 1.6])
        left = rrb.Vertical(*plan, rrb.Horizontal(*cameras), row_shares=[1.6, 1.0]) if cameras else plan[0]
        return rrb.Horizontal(left, rrb.Vertical(told, over_time, row_shares=[1.2, 1.0]))

    # --- data ---

    def send(self, stream: rr.RecordingStream) -> None:
        """Log how the mission stood from moment to moment, its views and its log."""
        self._send_looks(stream)
        self._plan.send(stream)
        self._send_doing(stream)
        for instant in self.record.instants:
            _set(stream, instant.time, instant.travelled)
            self._send_instant(stream, instant)
        trail = Trail()
        for number, seen in enumerate(self.record.views):
            if seen.instant.truth is not None:
                trail.add(seen.instant.truth)
            _set(stream, seen.instant.time, seen.instant.travelled, number)
            self._send_instant(stream, seen.instant)
            self._send_view(stream, seen, trail)
        for instant in self.record.instants[-1:]:  # the end is to be seen on the line of views, too
            _set(stream, instant.time, instant.travelled, len(self.record.views) or None)
            self._send_instant(stream, instant)
        for line in self.record.log:
            _set(stream, line.entry.time, line.travelled, line.view)
            stream.log("mission/log", rr.TextLog(str(line.entry), level=line.entry.level.value))

    def _send_looks(self, stream: rr.RecordingStream) -> None:
        """Names and colours."""
        stream.log("mission/to_go", rr.SeriesLines(colors=BELIEVED, names="to go [m]", widths=1.5), static=True)
        if self.record.views:
            stream.log("mission/lost", rr.SeriesLines(colors=LOST, names="P(lost)", widths=1.5), static=True)
        names = [status.value for status in STATUS]
        stream.log(
            "mission/doing/status", rr.StateConfiguration(values=names, colors=list(STATUS.values())), static=True
        )

    def _send_doing(self, stream: rr.RecordingStream) -> None:
        """Log changes: a lane each of status, order, behaviour and tasks, and the steps."""
        before: Instant | None = None
        views = [seen.instant.time for seen in self.record.views]
        for instant in self.record.instants:
            if before is not None and not instant.unlike(before):
                continue
            before = instant
            view = max(0, bisect_right(views, instant.time) - 1) if views else None
            _set(stream, instant.time, instant.travelled, view)
            order = self.record.plan.orders[instant.order]
            stream.log("mission/doing/status", rr.StateChange(state=instant.status.value))
            stream.log(
                "mission/doing/step", rr.StateChange(state=f"{instant.order + 1}: {order.why or order.behaviour}")
            )
            stream.log("mission/doing/behaviour", rr.StateChange(state=instant.doing or STANDING))
            if any(one.tasks for one in self.record.instants):
                stream.log("mission/doing/task", rr.StateChange(state=", ".join(instant.tasks)))
            text = rr.TextDocument(steps_text(self.record.plan, instant), media_type="text/markdown")
            stream.log("mission/steps", text)

    def _send_instant(self, stream: rr.RecordingStream, instant: Instant) -> None:
        self._plan.send_instant(stream, instant)
        stream.log("mission/to_go", rr.Scalars(self.record.plan.goal - instant.along))

    def _send_view(self, stream: rr.RecordingStream, seen: LocalisedView, trail: Trail) -> None:
        self._plan.send_view(stream, seen, trail)
        stream.log("mission/lost", rr.Scalars(seen.belief.lost))
        for camera, frame in seen.frames.items():
            stream.log(f"mission/camera/{camera}", kept(frame))


_NONE = rrb.PlotLegend(visible=False)


def _set(stream: rr.RecordingStream, time: float, travelled: float, view: int | None = None) -> None:
    """Set time [s] and distance [m] of what is logged next; between views it is on no line of views."""
    stream.reset_time()
    if view is not None:
        stream.set_time(VIEW, sequence=view)
    stream.set_time(TIME, duration=time)
    stream.set_time(DISTANCE, sequence=round(100 * travelled))


def steps_text(plan: Plan, instant: Instant) -> str:
    """The plan as a table in Markdown, with a mark at the order in force, and what is done now above it."""
    doing = f" **{instant.doing}**" if instant.doing else ""
    tasks = f": {', '.join(instant.tasks)}" if instant.tasks else ""
    lines = [
        f"{instant.status.value}{doing}{tasks}",
        "",
        "| | at [m] | behaviour | why | tasks |",
        "|---|---:|---|---|---|",
    ]
    for number, order in enumerate(plan.orders):
        mark = "▶" if number == instant.order and not instant.status.over else ""
        lines.append(
            f"| {mark} {number + 1} | {order.at:.1f} | {order.behaviour} | {order.why} | {_words(order.tasks)} |"
        )
    return "\n".join([*lines, f"| | {plan.goal:.1f} | *goal* | | {_words(plan.tasks)} |"])


def _words(tasks: Sequence[Task]) -> str:
    return ", ".join(map(str, tasks))
