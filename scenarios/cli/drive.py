"""The command ``refseq drive``: somebody leads the robot, by keys, a gamepad or a script."""

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scenarios.cli.console import bars_on_terminal, err, out, say
from scenarios.cli.options import Sensors
from scenarios.drives.inputs import assignments, words
from scenarios.errors import ScenarioError

if TYPE_CHECKING:
    from scenarios.drives.teleop import Controls, TeleopDrive, TeleopResult
    from sim.drives.recorder import RecordedView, Trigger

BELOW, INTERRUPTED = 1, 130

EXAMPLES = """Examples:

* `refseq drive hallway -o reference.mcap`
* `refseq drive hallway --light 18:00 --sensors laser -o query.mcap`
* `refseq drive hallway --by-hand --gamepad /dev/input/js0 -o places.mcap`
* `refseq drive hallway --script keys.txt -o out/drive.mcap`
* `refseq drive hallway --script reference.mcap --light 18:00 -o again.mcap`

Keys: held, W A S D or the arrows lead the robot; Space starts, pauses and resumes sampling; V takes a view; + and -
change the speed; E is the emergency stop, R releases it; X stops and keeps the recording, Delete aborts and keeps
nothing; C looks from elsewhere. Gamepad: the left stick leads while a shoulder button is held.

A script has a line a moment, in seconds: `2.0 forward`, `5.5 left 0.3`, `6 sample`, `8 pause`, `9 resume`, `30 stop`;
see docs/live.md. A recording that was led by hand is a script as well.

Exit codes: 0 recorded; 1 aborted, or stopped before the first view: nothing is written; 2 bad input; 130
interrupted."""


def drive(
    world: Annotated[
        str, typer.Argument(help="A world of the library, corridor:SEED, or a floor plan: a path ending in .toml.")
    ],
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="Recording to write (.mcap).")],
    name: Annotated[
        str | None, typer.Option(metavar="NAME", help="What the sequence is called. [default: the file's name]")
    ] = None,
    script: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Controls from a file, without a viewer; see below.")
    ] = None,
    port: Annotated[
        int, typer.Option(min=0, max=65535, metavar="PORT", help="Port of the viewer's page; 0: any free one.")
    ] = 0,
    gamepad: Annotated[
        Path | None,
        typer.Option(metavar="DEVICE", help="Joystick device. [default: /dev/input/js0 if there is one]"),
    ] = None,
    every: Annotated[float | None, typer.Option(metavar="SECONDS", help="By timer: a view every so often.")] = None,
    distance: Annotated[
        float | None, typer.Option(metavar="METRES", help="By motion: a view after such a way. [default: 0.85]")
    ] = None,
    turn: Annotated[float | None, typer.Option(metavar="RADIANS", help="By motion: a view after such a turn.")] = None,
    by_hand: Annotated[bool, typer.Option("--by-hand", help="Views only where they are asked for.")] = False,
    sensors: Sensors = None,
    camera: Annotated[
        list[str] | None, typer.Option(metavar="NAME=MODEL", help="Another model of a camera, as for `refseq record`.")
    ] = None,
    renderer: Annotated[
        str, typer.Option(metavar="RENDERER", help="filament, classic, or none: laser only.")
    ] = "filament",
    robot: Annotated[str, typer.Option(metavar="ROBOT", help="Robot that is led.")] = "robuter",
    light: Annotated[str, typer.Option(metavar="LIGHT", help="A preset or an hour, as for `refseq record`.")] = "16:00",
    change: Annotated[
        str, typer.Option(metavar="CHANGE", help="What is not as the plan has it, as for `refseq record`.")
    ] = "none",
    change_seed: Annotated[
        int | None, typer.Option(min=0, metavar="N", help="Seed of the change. [default: the drive's]")
    ] = None,
    route: Annotated[str, typer.Option(metavar="ROUTE", help="Route on which the robot begins.")] = "forward",
    start: Annotated[float, typer.Option(metavar="METRES", help="So far along it.")] = 0.0,
    seed: Annotated[int, typer.Option(min=0, metavar="N", help="Seed of every random draw of the drive.")] = 1,
    rate: Annotated[float, typer.Option(metavar="FACTOR", help="Simulated over real time, in a viewer.")] = 1.0,
) -> None:
    """Lead a robot through a world by hand, and record what it senses."""
    from scenarios.drives.record import Drive
    from scenarios.drives.teleop import TeleopDrive, record_by_hand
    from sim.rendering.renderer import RendererKind

    if renderer not in set(RendererKind):
        raise ScenarioError(f"renderer '{renderer}' is unknown; valid are {', '.join(RendererKind)}")
    asked = Drive(
        world=world,
        light=light,
        change=change,
        change_seed=change_seed,
        robot=robot,
        route=route,
        start=start,
        seed=seed,
        renderer=RendererKind(renderer),
        sensors=words(sensors, "sensors"),
        cameras=assignments(camera, "camera"),
    )
    session = TeleopDrive(name or output.stem, asked, sampling_of(every, distance, turn, by_hand=by_hand))
    with ended_in_one_line(output):
        if script is not None:
            _check_alone(script, gamepad)
            led = _by_script(session, output, script)
        else:
            led = record_by_hand(session, output, by_viewer(session, port=port, gamepad=gamepad, rate=rate))
    sensed = ", ".join(sorted(led.recording.sensors))
    views = len(led.recording.views)
    say(out, f"{output}: {views} views of {sensed}, {led.way:.1f} m in {led.time:.1f} s")
    for stop in led.stops:
        say(out, f"stopped at {stop.since:.1f} s: {stop.cause.value}: {stop.detail}")


def sampling_of(
    every: float | None, distance: float | None, turn: float | None, *, by_hand: bool = False
) -> "Trigger | None":
    """When a view is taken; None: only when it is asked for. Raises ``ScenarioError`` for what does not go together."""
    from sim.drives.recorder import Trigger

    given = {"every": every, "distance": distance, "turn": turn}
    asked = {name: value for name, value in given.items() if value is not None}
    if by_hand:
        for name, value in asked.items():
            raise ScenarioError(f"by-hand and {name} {value:g} exclude each other; valid is one of them")
        return None
    return Trigger(distance=distance, turn=turn, time=every) if asked else Trigger()


def _check_alone(script: Path, gamepad: Path | None) -> None:
    if gamepad is not None:
        raise ScenarioError(f"script {script} and gamepad {gamepad} both say who leads; valid is one of them")


def _by_script(session: "TeleopDrive", output: Path, script: Path) -> "TeleopResult":
    """Lead the robot by a script, with a bar of its time."""
    from scenarios.drives.teleop import controls_in, record_by_hand
    from sim.teleop.script import ScriptSource

    moments = controls_in(script)
    end = moments[-1].time
    with bars_on_terminal() as bars:
        task = bars.add_task(f"{session.drive.world} by {script.name}", total=end or 1.0, seen="")

        def told(taken: "RecordedView", views: int) -> None:
            time = taken.view.time
            bars.update(task, completed=time, seen=f"{time:5.1f} of {end:.0f} s, {views:3d} views")

        led = record_by_hand(session, output, lambda bench: nullcontext(ScriptSource(moments)), told)
        bars.update(task, completed=end or 1.0)
    return led


@contextmanager
def ended_in_one_line(output: Path) -> Iterator[None]:
    """Say in one line why nothing was written, or what an interruption left."""
    from scenarios.drives.record import Interrupted, NoViewError
    from sim.teleop.session import AbortedError

    try:
        yield
    except (AbortedError, NoViewError) as none:
        say(err, f"{none}")
        raise typer.Exit(BELOW) from None
    except KeyboardInterrupt as stop:
        say(err, f"interrupted: {stop}" if isinstance(stop, Interrupted) else f"interrupted: {output} is not written")
        raise typer.Exit(INTERRUPTED) from None


def by_viewer(session: "TeleopDrive", *, port: int = 0, gamepad: Path | None = None, rate: float = 1.0) -> "Controls":
    """The controls in a viewer."""
    from scenarios.drives.record import sensors_of
    from sim.teleop.viewer import ViewerSettings, opened

    settings = ViewerSettings(session.name, described_sampling(session.sampling), sensors_of(session.drive), port, rate)
    return lambda bench: opened(bench, settings, gamepad)


def described_sampling(sampling: "Trigger | None") -> str:
    """When a view is taken, in words."""
    if sampling is None:
        return "by hand"
    parts = [
        f"every {sampling.time:g} s" if sampling.time is not None else "",
        f"after {sampling.distance:g} m" if sampling.distance is not None else "",
        f"after {sampling.turn:g} rad" if sampling.turn is not None else "",
    ]
    return " or ".join(part for part in parts if part)
