"""What ``refseq localise --live`` is asked for, and the drive that it then makes."""

import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING

from rich.markup import escape

from scenarios.cli.console import err, out, say
from scenarios.cli.drive import by_viewer, ended_in_one_line
from scenarios.drives.inputs import check_output, writing
from scenarios.errors import ScenarioError

if TYPE_CHECKING:
    import rerun as rr

    from refseq.belief import Stage
    from refseq.logs import Recording
    from refseq.map.map import Map
    from scenarios.drives.live import LiveRun
    from scenarios.drives.record import Drive
    from scenarios.scoring.comparison import Comparison

LEADERS = ("script", "keys")
SCREENS = ("save", "connect", "serve")


@dataclass(frozen=True, slots=True)
class LiveAsked:
    """The options that go with ``--live``, None or False where they were not given."""

    live: str | None
    light: str | None
    change: str | None
    robot: str | None
    route: str | None
    drive_seed: int | None
    every: float | None
    script: Path | None
    keys: bool
    record: Path | None
    save: Path | None
    connect: str | None
    serve: int | None

    def check(self, query: Path | None, afterwards: Mapping[str, object]) -> None:
        """Raise ``ScenarioError`` for options that do not go together; ``afterwards`` are those of recordings."""
        values = {one.name: getattr(self, one.name) for one in fields(self)}
        given = [name for name, value in values.items() if value is not None and value is not False]
        if self.live is None:
            if given:
                raise ScenarioError(f"--{_option(given[0])} goes with --live; valid is --live WORLD, or without it")
            if query is None:
                raise ScenarioError("there is no later drive; valid is a recording, or --live WORLD")
            return
        if query is not None:
            raise ScenarioError(f"{query} and --live {self.live} are both later drives; valid is one of them")
        for name, value in afterwards.items():
            if value is not None:
                raise ScenarioError(f"--{name} is for recordings; valid with --live is --every")
        for rivals in (LEADERS, SCREENS):
            chosen = [f"--{name}" for name in given if name in rivals]
            if len(chosen) > 1:
                raise ScenarioError(f"{' and '.join(chosen)}: valid is one of them, or none")
        if self.save is not None:
            check_output(self.save)

    def drive(self, sensors: tuple[str, ...], robot: str) -> "Drive":
        """The drive that is asked for; ``robot`` is the map's."""
        from refseq.view import LASER
        from scenarios.drives.record import Drive
        from sim.drives.recorder import Trigger
        from sim.rendering.renderer import RendererKind

        return Drive(
            world=self.live or "",
            light=self.light or "18:00",
            change=self.change or "none",
            robot=self.robot or robot,
            route=self.route or "forward",
            seed=2 if self.drive_seed is None else self.drive_seed,
            renderer=RendererKind.NONE if set(sensors) == {LASER} else RendererKind.FILAMENT,
            trigger=Trigger(distance=self.every) if self.every is not None else Trigger(),
            sensors=sensors,
        )


def localised_live(
    name: str,
    map_: "Map",
    asked: LiveAsked,
    stages: "Sequence[Stage]",
    sensors: Sequence[str] | None,
    seed: int,
    tell: "Callable[[Comparison], None]",
) -> None:
    """Drive, localise each view at once and show what is believed; ``tell`` is told of it when the robot has arrived.

    What is shown stays: a server goes on until Ctrl-C.
    """
    # Before Rerun is imported: it tells what goes wrong in several lines of its own.
    os.environ.setdefault("RUST_LOG", "off")
    from refseq.map.localiser import StagedLocaliser
    from refseq.viewer.belief_log import LocaliserLayer
    from refseq.viewer.places import Places
    from scenarios.drives.evaluate import comparison_of
    from scenarios.drives.live import LiveRun, live_logger, sensors_for

    chosen = sensors_for(map_, sensors)
    drive = asked.drive(chosen, str(map_.sequences[0].metadata.get("robot", "robuter")))
    title = f"{name} ← {drive.world} at {drive.light}"
    layer = LocaliserLayer("map", tuple(stage.value for stage in stages), Places.of(map_))
    localiser = StagedLocaliser(map_, stages=stages, sensors=sensors, seed=seed)
    run = LiveRun(localiser.update, layer.places)
    with ended_in_one_line(asked.record or Path("the drive")), _screen(title, asked) as stream:
        run.logger = live_logger(stream, title, drive, layer)
        recording = _driven(drive, asked, run)
        tell(comparison_of(title, map_, recording, run.beliefs))


def _driven(drive: "Drive", asked: LiveAsked, run: "LiveRun") -> "Recording":
    """Lead the robot as asked; its views are localised as they come."""
    from scenarios.drives.record import record
    from scenarios.drives.teleop import TeleopDrive, controls_in, record_by_hand
    from sim.teleop.script import ScriptSource

    with _status_line(f"{drive.world} at {drive.light}") as run.told:
        if asked.script is None and not asked.keys:
            return record(drive, asked.record, told=run.take)
        session = TeleopDrive(asked.record.stem if asked.record else "live", drive, drive.trigger)
        if asked.script is None:
            controls = by_viewer(session)
        else:
            moments = controls_in(asked.script)
            controls = lambda bench: nullcontext(ScriptSource(moments))  # noqa: E731
        return record_by_hand(session, asked.record, controls, run.take).recording


@contextmanager
def _status_line(title: str) -> Iterator[Callable[[str], None]]:
    """A line on the terminal that tells how it stands, until it is over."""
    with err.status(escape(title)) as line:
        yield lambda told: line.update(escape(f"{title}, {told}"))


@contextmanager
def _screen(name: str, asked: LiveAsked) -> "Iterator[rr.RecordingStream]":
    """Where it is shown: a file, a viewer elsewhere, browsers, or a viewer that is started here."""
    from refseq.viewer.recording import saved
    from refseq.viewer.sinks import connected, served, spawned
    from scenarios.drives.live import LIVE

    if asked.save is not None:
        with writing(asked.save), saved(asked.save, name) as stream:
            yield stream
        say(out, f"{asked.save}: open it with 'rerun {asked.save}'")
    elif asked.connect is not None:
        with connected(asked.connect, name, LIVE) as stream:
            yield stream
    elif asked.serve is not None:
        with served(asked.serve, name, batches=LIVE) as (stream, page):
            say(out, f"open {page} in a browser of this machine")
            yield stream
            say(out, f"{page} is served until Ctrl-C")
            with suppress(KeyboardInterrupt):
                while True:
                    time.sleep(3600)
    else:
        with spawned(name, batches=LIVE) as stream:
            yield stream


def _option(name: str) -> str:
    return name.replace("_", "-")
