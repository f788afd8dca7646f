"""State diagram of a mission as SVG, from the table of transitions: ``python -m refseq.missions.diagram > FILE``."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from types import MappingProxyType

from refseq.missions.status import MOVING, TRANSITIONS, Status

EXECUTING = (*MOVING, Status.AT_TASK)
ACTIVE = (*EXECUTING, Status.LOCALISING, Status.LOST)
WIDTH, HEIGHT = 900, 480


@dataclass(frozen=True, slots=True)
class Box:
    """A state, or several in a frame: its text, its left upper corner and its size [px]."""

    text: str
    x: int
    y: int
    width: int = 130
    height: int = 36


@dataclass(frozen=True, slots=True)
class Arrow:
    """Transitions from each of some states to each of others: a line (x, y) [px], and where its label begins."""

    sources: tuple[Status, ...]
    targets: tuple[Status, ...]
    text: str
    line: tuple[tuple[int, int], ...]
    at: tuple[int, int]

    @property
    def transitions(self) -> frozenset[tuple[Status, Status]]:
        """The pairs of states that it stands for."""
        return frozenset(product(self.sources, self.targets))


FRAMES = (Box("active", 30, 30, 600, 330), Box("an order in force", 270, 60, 340, 270), Box("", 280, 86, 150, 218))
STATES: Mapping[Status, tuple[int, int]] = MappingProxyType(
    {
        Status.LOCALISING: (40, 100),
        Status.LOST: (40, 254),
        Status.TRAVELLING: (290, 100),
        Status.APPROACHING: (290, 254),
        Status.MANOEUVRING: (460, 170),
        Status.AT_TASK: (460, 254),
        Status.PAUSED: (265, 420),
        Status.COMPLETED: (740, 254),
        Status.FAILED: (740, 170),
        Status.ABORTED: (740, 420),
    }
)
ARROWS = (
    Arrow((Status.LOCALISING,), EXECUTING, "views agree", ((170, 118), (270, 118)), (182, 110)),
    Arrow((Status.LOST,), EXECUTING, "views agree", ((105, 254), (105, 190), (270, 190)), (182, 182)),
    Arrow(
        EXECUTING,
        EXECUTING,
        "next order, or carried elsewhere",
        ((470, 60), (470, 44), (540, 44), (540, 60)),
        (400, 22),
    ),
    Arrow((Status.TRAVELLING,), (Status.APPROACHING,), "landmark near", ((310, 136), (310, 254)), (317, 200)),
    Arrow(
        (Status.TRAVELLING, Status.APPROACHING), (Status.LOST,), "views disagree", ((280, 272), (170, 272)), (171, 264)
    ),
    Arrow(ACTIVE, (Status.PAUSED,), "pause", ((300, 360), (300, 420)), (256, 395)),
    Arrow((Status.PAUSED,), ACTIVE, "resume, as it was", ((360, 420), (360, 360)), (368, 395)),
    Arrow(ACTIVE, (Status.FAILED,), "failed, or out of time", ((630, 188), (740, 188)), (640, 162)),
    Arrow(
        (Status.APPROACHING, Status.MANOEUVRING, Status.AT_TASK),
        (Status.COMPLETED,),
        "goal reached",
        ((610, 272), (740, 272)),
        (640, 264),
    ),
    Arrow(ACTIVE, (Status.ABORTED,), "abort", ((630, 345), (805, 345), (805, 420)), (690, 337)),
    Arrow((Status.PAUSED,), (Status.ABORTED,), "abort", ((395, 438), (740, 438)), (540, 430)),
)
"""A frame as an arrow's end stands for all states in it; but the goal is reached by an approach, a turn or a task."""


def state_diagram() -> str:
    """The diagram; states of which nothing follows have a double frame."""
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" '
        'font-family="sans-serif" font-size="13">',
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="8" markerHeight="8" orient="auto">'
        '<path d="M0 0L8 4L0 8z" fill="#444"/></marker></defs>',
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>',
        *(
            _rectangle(frame, "none", 'stroke-dasharray="5 4"') + _text(frame.text, frame.x + 10, frame.y + 18, "#666")
            for frame in FRAMES
        ),
        *(_arrow(arrow) for arrow in ARROWS),
        *(_state(status) for status in STATES),
        "</svg>\n",
    ]
    return "\n".join(parts)


def _state(status: Status) -> str:
    box = Box(status.value, *STATES[status])
    inner = Box("", box.x + 3, box.y + 3, box.width - 6, box.height - 6)
    rectangles = _rectangle(box, "#eef3fa" if status.moving else "white")
    rectangles += "" if TRANSITIONS[status] else _rectangle(inner, "none")
    return rectangles + _text(box.text, box.x + box.width // 2, box.y + 23, "black", "middle")


def _rectangle(box: Box, fill: str, more: str = "") -> str:
    place = f'x="{box.x}" y="{box.y}" width="{box.width}" height="{box.height}"'
    return f'<rect {place} rx="6" fill="{fill}" stroke="#444" {more}/>'


def _arrow(arrow: Arrow) -> str:
    points = " ".join(f"{x},{y}" for x, y in arrow.line)
    return f'<polyline points="{points}" fill="none" stroke="#444" marker-end="url(#tip)"/>' + _text(
        arrow.text, *arrow.at, "#222"
    )


def _text(text: str, x: int, y: int, colour: str, anchor: str = "start") -> str:
    return f'<text x="{x}" y="{y}" fill="{colour}" text-anchor="{anchor}">{text}</text>'


if __name__ == "__main__":
    print(state_diagram(), end="")
