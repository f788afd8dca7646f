"""Teleoperated drives, recorded as any other drive."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from refseq.logs import Recording, read_recording
from refseq.logs.notes import noted
from refseq.logs.writing import OutputFormat
from refseq_bench.robots import Stop
from refseq_bench.robots.stops import StopLog
from refseq_bench.scenarios.drives.drive import Drive
from refseq_bench.scenarios.drives.record import (
    OWN_FORMAT,
    ViewCallback,
    check_recording,
    described,
    open_bench,
    scans,
    sensors_of,
    write_drive,
)
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.drives.sensor_rig import sensor_rig
from refseq_bench.sim.drives.trigger import Trigger
from refseq_bench.sim.teleop.commands import Commands, CommandSource, SessionPhase, SessionStatus
from refseq_bench.sim.teleop.script import CommandLog, TimedCommand, parse, printed
from refseq_bench.sim.teleop.session import run_session
from refseq_bench.text_file import TextFileError, read_text

CONTROLS = "controls"
"""Metadata key of the commands of a teleoperated drive, as a script."""

Controls = Callable[[Bench], AbstractContextManager[CommandSource]]
"""Opens the controls of a bench that stands at its start."""


@dataclass(frozen=True, slots=True)
class TeleopDrive:
    """A drive by hand: its name, free notes, and when views are taken; ``sampling`` None: on command only.

    Of the ``drive``'s route only the start counts.
    """

    name: str
    drive: Drive
    sampling: Trigger | None
    notes: str = ""


@dataclass
class StopRecorder:
    """Passes on commands; keeps the robot's stops from the start on, and the last status."""

    source: CommandSource
    stops: StopLog = field(default_factory=StopLog)
    last: SessionStatus = field(default_factory=SessionStatus)

    def commands(self, status: SessionStatus) -> Commands:
        """Return the other source's commands of this control period."""
        self.last = status
        if status.phase is not SessionPhase.READY:  # while nobody has begun, nobody commands
            self.stops.hear(status.stops)
        return self.source.commands(status)


@dataclass(frozen=True, slots=True)
class TeleopResult:
    """Result of a drive by hand: its recording, the robot's stops in their order, time [s] and path length [m]."""

    recording: Recording
    stops: tuple[Stop, ...]
    time: float
    way: float


def record_by_hand(
    session: TeleopDrive,
    path: Path | None,
    controls: Controls,
    told: ViewCallback | None = None,
    form: OutputFormat = OWN_FORMAT,
    notes: Callable[[], str] | None = None,
) -> TeleopResult:
    """Lead the robot by ``controls`` and record its views to ``path``, None: nowhere; ``told`` is called for each view.

    ``notes`` are asked for when it has ended, None: they are the session's.

    Raises as ``refseq_bench.scenarios.drives.record.write_drive`` does, and ``AbortedError`` on the abort command.
    """
    check_recording(path, form)
    drive = session.drive
    with open_bench(drive, pictured=True) as bench, controls(bench) as source:
        commands = CommandLog(source)
        stops = StopRecorder(commands)
        metadata = {
            **described(bench, drive, session.sampling),
            "name": session.name,
            "route": f"by hand from {drive.start:g} m of {drive.route}",
            **noted(session.notes),
        }
        recording = write_drive(
            path,
            metadata,
            run_session(bench, stops, session.sampling),
            scanning=scans(drive),
            told=told,
            afterwards=lambda: {CONTROLS: printed(commands.script), **(noted(notes()) if notes else {})},
            form=form,
            rig=sensor_rig(bench),
            whole=False,
        )
        return TeleopResult(recording, stops.stops.heard, stops.last.time, stops.last.travelled)


def controls_in(path: Path) -> tuple[TimedCommand, ...]:
    """Read a script of commands from a file, or from a recording of a drive by hand."""
    if not path.is_file():
        raise ScenarioError(f"{path}: is no file; valid is a script of controls, or a recording that was led by hand")
    if path.suffix != ".mcap":
        try:
            return parse(read_text(path), str(path))
        except TextFileError as error:
            raise ScenarioError(f"{path}: {error}; valid is a script of controls, in UTF-8") from None
    text = read_recording(path).metadata.get(CONTROLS)
    if text is None:
        raise ScenarioError(f"{path}: was not led by hand; valid is a recording of `refseq drive`")
    return parse(text, str(path))


def by_viewer(session: TeleopDrive, told: Callable[[str], object]) -> Controls:
    """Open the controls of one drive on a page in the browser; ``told`` is called with its address."""
    from refseq_bench.sim.teleop.capture.setup import CaptureSetup
    from refseq_bench.sim.teleop.viewer import ViewerSettings, capture_page

    setup = CaptureSetup(session.name, session.notes, sensors_of(session.drive), session.sampling)

    @contextmanager
    def controls(bench: Bench) -> Iterator[CommandSource]:
        with capture_page(ViewerSettings(session.name, told=told), setup=setup) as page, page.leading(bench) as source:
            yield source

    return controls
