"""The controls in MuJoCo Studio's viewer: a page in the browser for whoever has its address.

The viewer has a thread and a copy of the world of its own: nothing done in it changes the drive but the keys. A viewer
that has not reported its keys for a while, or whose page is silent, has nobody at its controls (deadman). One that was
closed commands stop.
"""

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol

from refseq.access.policy import AccessPolicy
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.realtime import RealTimePacer
from refseq_bench.sim.teleop.capture.desk import DEADMAN, SILENT, CaptureDesk
from refseq_bench.sim.teleop.capture.setup import CaptureSetup
from refseq_bench.sim.teleop.commands import Button, Commands, CommandSource, SessionStatus
from refseq_bench.sim.teleop.follow import FollowingView, LookEvent, RobotSnapshot, ViewerInput
from refseq_bench.sim.teleop.gamepad import FIRST, Gamepad
from refseq_bench.sim.teleop.keys import OTHER_LOOK, Keyboard
from refseq_bench.sim.teleop.mirror import WorldMirror
from refseq_bench.sim.teleop.page import launched
from refseq_bench.sim.teleop.pictures import Picture, pictures_of

FRAME = 1 / 30
"""Period in which the viewer gets the status [s]."""


@dataclass(frozen=True, slots=True)
class ViewerSettings:
    """Settings of the page: its ``policy`` says who may come in, ``rate``, simulated over real time (above 0).

    ``told`` is called with the page's address.
    """

    title: str
    policy: AccessPolicy = field(default_factory=AccessPolicy)
    rate: float = 1.0
    told: Callable[[str], object] = lambda address: None


class ViewerHandle(Protocol):
    """The part of ``mujoco.studio``'s viewer handle that is used here."""

    def is_running(self) -> bool:
        """Return True while the viewer runs; raises the error that ended it."""

    def sync(self, model: Any, data: Any) -> Any:
        """Exchange messages with the viewer, and send it the state of the world."""

    def send_to_viewer(self, message: Any) -> None:
        """Send a message."""


@dataclass(frozen=True)
class CapturePage:
    """A page that is served: its desk, and the controls of one bench after another."""

    desk: CaptureDesk
    rate: float
    _handle: ViewerHandle
    _input: ViewerInput
    _heard: Callable[[], float]
    _pad: Gamepad | None

    @contextmanager
    def leading(self, bench: Bench) -> Iterator[CommandSource]:
        """Lead the robot of a bench from the page."""
        self._handle.send_to_viewer(RobotSnapshot(bench.named(bench.robot.base), _cameras(bench)))
        pacer = RealTimePacer(self.rate)
        yield ViewerSource(self._handle, self._input, WorldMirror(bench), pacer, self._pad, self._heard, self.desk)


@contextmanager
def capture_page(
    settings: ViewerSettings, gamepad: Path | None = None, setup: CaptureSetup | None = None
) -> Iterator[CapturePage]:
    """Serve the page of captures; with a gamepad: that one, or None, the first if there is one.

    ``setup`` given: for one drive that has begun. Open one in a process: the thread of a second may not end (MuJoCo 4.0
    waits in it for a browser, for ever). Raises ``SimError`` where viewer, port or gamepad cannot be opened.
    """
    desk = CaptureDesk(setup)
    with ExitStack() as stack:
        pad = _pad(gamepad)
        if pad is not None:
            stack.enter_context(pad)
        input_ = ViewerInput()
        title = f"refseq drive: {settings.title}"
        plugins = [FollowingView(), input_]
        page = launched(title, settings.policy, plugins, settings.told, desk.routes())
        handle, heard = stack.enter_context(page)
        yield CapturePage(desk, settings.rate, handle, input_, heard, pad)


class ViewerSource:
    """Commands of the keys of a viewer and of the page around it, and of a gamepad; the page shows the status.

    ``heard`` tells when its page last sent something, by this machine's clock [s].
    """

    def __init__(
        self,
        handle: ViewerHandle,
        input_: ViewerInput,
        mirror: WorldMirror,
        pacer: RealTimePacer,
        pad: Gamepad | None = None,
        heard: Callable[[], float] = time.monotonic,
        desk: CaptureDesk | None = None,
    ) -> None:
        self._heard, self._desk = heard, desk or CaptureDesk()
        self._handle, self._input, self._mirror, self._pacer, self._pad = handle, input_, mirror, pacer, pad
        self._keyboard = Keyboard()
        self._pictures: tuple[int, tuple[Picture, ...]] = (0, ())
        self._shown = float("-inf")

    def commands(self, status: SessionStatus) -> Commands:
        """Return the commands of this control period."""
        if not self._handle.is_running():
            return Commands(None, (Button.STOP,))
        pad = self._pad.read() if self._pad is not None else None
        if self._pad is not None and pad is None:
            status = replace(status, note=f"gamepad {self._pad.path} is gone")
        self._show(status)
        self._pacer.keep(status.time)
        commands = self._of_keys(status)
        if pad is None:
            return commands
        return Commands(
            commands.twist if pad.twist is None else pad.twist, commands.buttons + pad.buttons(status.phase)
        )

    def _of_keys(self, status: SessionStatus) -> Commands:
        by_page, pressed = self._desk.take()
        pressed, self._input.pressed = self._input.pressed + pressed, []
        if OTHER_LOOK in pressed:
            self._handle.send_to_viewer(LookEvent())
        by_view = self._held_in_view()
        commands = self._keyboard.commands((by_page or frozenset()) | (by_view or frozenset()), pressed, status.phase)
        return replace(commands, twist=None) if by_page is None and by_view is None else commands

    def _held_in_view(self) -> frozenset[str] | None:
        """Keys that are held in the view of the world; None where nobody is."""
        now = time.monotonic()
        there = now - self._input.held.at <= DEADMAN and now - self._heard() <= SILENT
        return self._input.held.keys if there else None

    def _show(self, status: SessionStatus) -> None:
        """Show the status, and the world to the viewer, at most once a frame; at the end in any case."""
        now = time.monotonic()
        if now - self._shown < FRAME and not status.phase.over:
            return
        self._shown = now
        if status.view is not None and status.count != self._pictures[0]:
            self._pictures = status.count, pictures_of(status.view)
        self._mirror.follow()
        self._desk.show(status, self._keyboard.speed, self._pictures[1])
        self._handle.sync(self._mirror.model, self._mirror.data)


def _pad(path: Path | None) -> Gamepad | None:
    """Open the given gamepad, or the first if there is one that may be read."""
    if path is not None:
        return Gamepad(path)
    try:
        return Gamepad(FIRST)
    except SimError:
        return None


def _cameras(bench: Bench) -> tuple[str, ...]:
    return tuple(bench.named(name) for name in bench.robot.cameras)
