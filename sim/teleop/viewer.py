"""The controls in MuJoCo Studio's viewer: a page in the browser, that this machine alone can open.

The viewer has a thread and a copy of the world of its own, so that nothing done in it changes the drive but the keys.
A viewer that has not told of its keys for a while is one that nobody looks at: nobody is at the controls then
(deadman). One that was closed asks for stop.
"""

import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

from mujoco.studio import launch_thread, plugin, viewer_protocol, web_viewer

from sim.bench.bench import Bench
from sim.bench.serial_port import LOOPBACK
from sim.errors import SimError
from sim.teleop.commands import Button, Hand, Orders, Status
from sim.teleop.form import Ears, Form, Heading, StatusSnapshot
from sim.teleop.gamepad import FIRST, Gamepad
from sim.teleop.keys import Keyboard
from sim.teleop.mirror import Shadow
from sim.teleop.pictures import Picture, pictures_of
from sim.teleop.realtime import Steady

DEADMAN = 0.5
"""Keys count as held for so long after the viewer told of them [s]; a choice."""
FRAME = 1 / 30
"""The viewer is told so often how things stand [s]."""
PAGE_FRAME = 1 / 15
"""The page is drawn so often [s]; a choice."""


@dataclass(frozen=True, slots=True)
class Look:
    """What the form tells: a name, when views are taken, of which sensors; and the page's ``port``, 0: any free one.

    ``rate`` is simulated over real time.
    """

    name: str
    sampling: str
    sensors: tuple[str, ...]
    port: int = 0
    rate: float = 1.0


class Handle(Protocol):
    """What is needed of a viewer's handle, as ``mujoco.studio`` has it."""

    def is_running(self) -> bool:
        """Whether the viewer is still there; raises what it died of."""

    def sync(self, model: Any, data: Any) -> Any:
        """Hear what the viewer tells, and tell it how everything stands."""

    def send_to_viewer(self, message: Any) -> None:
        """Send a message."""


@contextmanager
def opened(bench: Bench, look: Look, gamepad: Path | None = None) -> Iterator[Hand]:
    """Open the viewer of a bench, and a gamepad: that one, or None, the first if there is one.

    Open one in a process: the thread of a second may not end (MuJoCo 4.0 waits in it for a browser, for ever). Raises
    ``SimError`` where the viewer, its port or the gamepad cannot be opened.
    """
    with ExitStack() as stack:
        pad = _pad(gamepad)
        if pad is not None:
            stack.enter_context(pad)
        ears = Ears()
        heading = Heading(look.name, look.sampling, ", ".join(look.sensors), str(pad.path) if pad else None)
        form = Form(heading, f"{bench.robot.name}/{bench.robot.base}", _cameras(bench))
        handle = stack.enter_context(_launched(look, [form, ears]))
        yield ViewerHand(handle, ears, Shadow(bench), Steady(look.rate), pad)


class ViewerHand:
    """Asks for what the keys of a viewer and a gamepad ask for, and shows there how things stand."""

    def __init__(self, handle: Handle, ears: Ears, shadow: Shadow, pace: Steady, pad: Gamepad | None = None) -> None:
        self._handle, self._ears, self._shadow, self._pace, self._pad = handle, ears, shadow, pace, pad
        self._keyboard = Keyboard()
        self._pictures: tuple[int, tuple[Picture, ...]] = (0, ())
        self._shown = float("-inf")

    def orders(self, status: Status) -> Orders:
        """What is asked for now."""
        if not self._handle.is_running():
            return Orders(None, (Button.STOP,))
        pad = self._pad.read() if self._pad is not None else None
        if self._pad is not None and pad is None:
            status = replace(status, note=f"gamepad {self._pad.path} is gone")
        self._show(status)
        self._pace.keep(status.time)
        orders = self._of_keys(status)
        if pad is None:
            return orders
        return Orders(orders.twist if pad.twist is None else pad.twist, orders.buttons + pad.buttons(status.phase))

    def _of_keys(self, status: Status) -> Orders:
        pressed, self._ears.pressed = self._ears.pressed, []
        orders = self._keyboard.orders(self._ears.held.keys, pressed, status.phase)
        if time.monotonic() - self._ears.held.at > DEADMAN:
            return replace(orders, twist=None)
        return orders

    def _show(self, status: Status) -> None:
        """Tell the viewer, unless it was told just now; at the end in any case."""
        now = time.monotonic()
        if now - self._shown < FRAME and not status.phase.over:
            return
        self._shown = now
        if status.view is not None and status.count != self._pictures[0]:
            self._pictures = status.count, pictures_of(status.view)
        self._shadow.follow()
        self._handle.send_to_viewer(StatusSnapshot(status, self._keyboard.speed, self._pictures[1]))
        self._handle.sync(self._shadow.model, self._shadow.data)


def _pad(asked: Path | None) -> Gamepad | None:
    """The gamepad that is asked for, or the first if there is one that may be read."""
    if asked is not None:
        return Gamepad(asked)
    try:
        return Gamepad(FIRST)
    except SimError:
        return None


def _cameras(bench: Bench) -> tuple[str, ...]:
    return tuple(f"{bench.robot.name}/{name}" for name in bench.robot.cameras)


@contextmanager
def _launched(look: Look, plugins: list[Any]) -> Iterator[Handle]:
    """A viewer that runs; what it dies of while it starts, or later, is one line."""
    if look.port:
        _check_free(look.port)
    config = viewer_protocol.ViewerConfig(
        title=f"refseq drive: {look.name}", gfx="web", http_port=look.port, open_browser=True
    )
    try:
        with _in_browser(config, plugins) as handle:
            yield handle
    except RuntimeError as error:
        reason = " ".join(str(error).split())
        raise SimError(f"the viewer cannot go on: {reason}; valid without one is a script") from error


def _in_browser(config: viewer_protocol.ViewerConfig, plugins: list[Any]) -> Any:
    """Launch a viewer in the browser, as ``mujoco.studio.launch_web`` does, but for this machine only."""

    class Viewer(web_viewer.WebViewer):  # type: ignore[misc]
        """MuJoCo's own listens on all of the machine's addresses, and lets anybody in."""

        _host = property(lambda self: LOOPBACK, lambda self, _: None)
        _drawn = 0.0

        def prepare_next_frame(self) -> bool:
            """Draw no more often than a browser without a graphics card may take: what it does not, piles up."""
            time.sleep(max(0.0, self._drawn + PAGE_FRAME - time.monotonic()))
            self._drawn = time.monotonic()
            return bool(super().prepare_next_frame())

    of_viewer, of_bench = plugin.split_plugins(plugins)
    return launch_thread.launch_thread(
        lambda endpoint: viewer_protocol.run_viewer_loop(Viewer(config, endpoint, plugins=of_viewer)),
        sim_plugins=of_bench,
    )


def _check_free(port: int) -> None:
    """Raise ``SimError`` where somebody listens at a port of this machine."""
    with socket.socket() as trial:
        trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            trial.bind((LOOPBACK, port))
        except OSError as error:
            raise SimError(
                f"port {port}: cannot be listened at: {error.strerror}; valid is a free port, or 0"
            ) from None
