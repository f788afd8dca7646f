"""The controls in MuJoCo Studio's viewer: a page in the browser for whoever has its address.

The viewer has a thread and a copy of the world of its own: nothing done in it changes the drive but the keys. A viewer
that has not reported its keys for a while, or whose page is silent, has nobody at its controls (deadman). One that was
closed commands stop.
"""

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.realtime import RealTimePacer
from refseq_bench.sim.teleop.commands import Button, Commands, CommandSource, SessionStatus
from refseq_bench.sim.teleop.form import Heading, StatusSnapshot, TeleopForm, ViewerInput
from refseq_bench.sim.teleop.gamepad import FIRST, Gamepad
from refseq_bench.sim.teleop.keys import Keyboard
from refseq_bench.sim.teleop.mirror import WorldMirror
from refseq_bench.sim.teleop.page import launched
from refseq_bench.sim.teleop.pictures import Picture, pictures_of

DEADMAN = 0.5
"""Keys count as held for so long after the viewer reported them [s]; less stops the robot on a slow machine."""
SILENT = 1.5
"""A page is there for so long after it sent something [s]; a slow browser draws, and sends, once a second."""
FRAME = 1 / 30
"""Period in which the viewer gets the status [s]."""


@dataclass(frozen=True, slots=True)
class ViewerSettings:
    """The form's lines, the page's ``port`` (0: any free one), and ``rate``, simulated over real time (above 0).

    ``told`` is called with the page's address.
    """

    name: str
    sampling: str
    sensors: tuple[str, ...]
    port: int = 0
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


@contextmanager
def opened(bench: Bench, settings: ViewerSettings, gamepad: Path | None = None) -> Iterator[CommandSource]:
    """Open the viewer of a bench, and a gamepad: that one, or None, the first if there is one.

    Open one in a process: the thread of a second may not end (MuJoCo 4.0 waits in it for a browser, for ever). Raises
    ``SimError`` where the viewer, its port or the gamepad cannot be opened.
    """
    with ExitStack() as stack:
        pad = _pad(gamepad)
        if pad is not None:
            stack.enter_context(pad)
        input_ = ViewerInput()
        heading = Heading(settings.name, settings.sampling, ", ".join(settings.sensors), str(pad.path) if pad else None)
        form = TeleopForm(heading, f"{bench.robot.name}/{bench.robot.base}", _cameras(bench))
        title = f"refseq drive: {settings.name}"
        handle, heard = stack.enter_context(launched(title, settings.port, [form, input_], settings.told))
        yield ViewerSource(handle, input_, WorldMirror(bench), RealTimePacer(settings.rate), pad, heard)


class ViewerSource:
    """Commands of a viewer's keys and a gamepad; the viewer shows the status.

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
    ) -> None:
        self._heard = heard
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
        pressed, self._input.pressed = self._input.pressed, []
        commands = self._keyboard.commands(self._input.held.keys, pressed, status.phase)
        now = time.monotonic()
        if now - self._input.held.at > DEADMAN or now - self._heard() > SILENT:
            return replace(commands, twist=None)
        return commands

    def _show(self, status: SessionStatus) -> None:
        """Send the status to the viewer, at most once a frame; at the end in any case."""
        now = time.monotonic()
        if now - self._shown < FRAME and not status.phase.over:
            return
        self._shown = now
        if status.view is not None and status.count != self._pictures[0]:
            self._pictures = status.count, pictures_of(status.view)
        self._mirror.follow()
        self._handle.send_to_viewer(StatusSnapshot(status, self._keyboard.speed, self._pictures[1]))
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
    return tuple(f"{bench.robot.name}/{name}" for name in bench.robot.cameras)
