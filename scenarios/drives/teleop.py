"""A drive that somebody leads by hand, recorded as any other drive is."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path

from refseq.logs import Recording, read_recording
from robots import Stop
from scenarios.drives.record import Drive, ViewCallback, check_recording, described, open_bench, scans, write_drive
from scenarios.errors import ScenarioError
from sim.bench.bench import Bench
from sim.drives.recorder import Trigger
from sim.teleop.commands import Hand, Orders, Phase, Status
from sim.teleop.script import Moment, Noting, parse, printed
from sim.teleop.session import familiarise

CONTROLS = "controls"
"""Where a recording tells what was asked for on the way, as a script."""

Controls = Callable[[Bench], AbstractContextManager[Hand]]
"""Makes the controls of a bench that stands at its start."""


@dataclass(frozen=True, slots=True)
class TeleopDrive:
    """A drive by hand: what it is called, and when a view is taken; ``sampling`` None: by hand only.

    Of the ``drive``'s route nothing but the start counts.
    """

    name: str
    drive: Drive
    sampling: Trigger | None


@dataclass
class StopRecorder:
    """A hand that keeps why the robot stopped, each reason once, from the start on, and how far it came."""

    hand: Hand
    stops: dict[tuple[str, float], Stop] = field(default_factory=dict)
    last: Status = field(default_factory=Status)

    def orders(self, status: Status) -> Orders:
        """What the other hand asks for now."""
        self.last = status
        if status.phase is not Phase.READY:  # while nobody has begun, nobody commands
            for stop in status.stops:
                self.stops.setdefault((stop.cause.value, stop.since), stop)
        return self.hand.orders(status)


@dataclass(frozen=True, slots=True)
class TeleopResult:
    """What became of a drive by hand: its recording, the robot's stops in their order, time [s] and way [m]."""

    recording: Recording
    stops: tuple[Stop, ...]
    time: float
    way: float


def record_by_hand(
    sitting: TeleopDrive, path: Path | None, controls: Controls, told: ViewCallback | None = None
) -> TeleopResult:
    """Let somebody lead the robot, and write what it senses to ``path``, None: nowhere; ``told`` hears of each view.

    Raises as ``scenarios.drives.record.write_drive`` does, and ``AbortedError`` when the hand gives up.
    """
    check_recording(path)
    drive = sitting.drive
    with open_bench(drive) as bench, controls(bench) as hand:
        noting = Noting(hand)
        heard = StopRecorder(noting)
        metadata = {
            **described(bench, drive, sitting.sampling),
            "name": sitting.name,
            "route": f"by hand from {drive.start:g} m of {drive.route}",
        }
        recording = write_drive(
            path,
            metadata,
            familiarise(bench, heard, sitting.sampling),
            scanning=scans(drive),
            told=told,
            afterwards=lambda: {CONTROLS: printed(noting.moments)},
        )
        return TeleopResult(recording, tuple(heard.stops.values()), heard.last.time, heard.last.gone)


def controls_in(path: Path) -> tuple[Moment, ...]:
    """The script in a file, or the one that a recording tells of its drive by hand."""
    if not path.is_file():
        raise ScenarioError(f"{path}: is no file; valid is a script of controls, or a recording that was led by hand")
    if path.suffix != ".mcap":
        try:
            return parse(path.read_text(encoding="utf-8"), str(path))
        except UnicodeDecodeError:
            raise ScenarioError(f"{path}: is no text; valid is a script of controls, in UTF-8") from None
    text = read_recording(path).metadata.get(CONTROLS)
    if text is None:
        raise ScenarioError(f"{path}: was not led by hand; valid is a recording of `refseq drive`")
    return parse(text, str(path))
