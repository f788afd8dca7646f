"""The commands ``refseq record`` and ``refseq drive``: a drive that leads itself, and one that a person leads."""

from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from refseq_bench.scenarios.cli.terminal.bars import progress_bar, shown_bars
from refseq_bench.scenarios.cli.terminal.console import out
from refseq_bench.scenarios.cli.terminal.options import (
    FORMAT,
    NOTES,
    RATE,
    RECORDING,
    SCRIPT,
    Access,
    Carrier,
    FormatName,
    Sampling,
    Setting,
    World,
    drive_in,
    flag,
    grouped,
    only_one_of,
    option,
)
from refseq_bench.scenarios.cli.terminal.outputs import DRIVE
from refseq_bench.scenarios.cli.terminal.screen import page_told
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.tables import plural, say

if TYPE_CHECKING:
    from refseq_bench.scenarios.drives.drive import Drive
    from refseq_bench.scenarios.drives.teleop import TeleopDrive, TeleopResult
    from refseq_bench.sim.drives.recorder import RecordedView

RECORD_HELP = """Examples:

* `refseq record hallway --light 16:00 --seed 1 -o reference.mcap`
* `refseq record hallway --light 17:45,cloud=0.6 --change busy --seed 3 -o another-day.mcap`
* `refseq record corridor:7 --camera camera-2=fire-i-wide -o wide.mcap`
* `refseq record hallway --renderer none -o laser-only.mcap`
* `refseq record hallway --operator-style weaving --side -0.3 --robot-spread as-built -o other-robot.mcap`
* `refseq record hallway --format rosbag2 -o hallway-bag`
* `refseq record hallway --behaviours "MN:12 MT:180 MN:10" -o there-and-back.mcap`
* `refseq record hallway --script keys.txt -o scripted.mcap`
* `refseq record hallway --script reference.mcap --light 18:00 -o again.mcap`

A script has one command a line, with its time in seconds: `2.0 forward`, `5.5 left 0.3`, `6 sample`, `8 pause`,
`9 resume`, `30 stop` (docs/live.md). A recording of `refseq drive` is a script as well.

Exit codes: 0 recorded; 1 the robot is stuck, a behaviour failed, or the drive was aborted or ended before its first
view; 2 bad input; 130 interrupted. Of a drive that is interrupted or stuck the views up to then are kept beside, in
NAME.partial.mcap; of one that is aborted, or has no view yet, nothing."""

DRIVE_HELP = """Examples:

* `refseq drive hallway -o reference.mcap`
* `refseq drive hallway --light 18:00 --sensors laser -o query.mcap`
* `refseq drive hallway --on-request --gamepad /dev/input/js0 -o places.mcap`

Keys: hold W A S D or the arrows to lead the robot. Space starts, pauses and resumes sampling; V takes a view; + and -
change the speed; E is the emergency stop, R releases it; X stops and keeps the recording, Delete aborts and keeps
nothing; C changes the camera. Gamepad: the left stick leads while a shoulder button is held.

Exit codes: as those of `refseq record`."""

NAME = option("NAME", "Name of the sequence. [default: the file's]")
Form = Annotated[FormatName, FORMAT]
OnRequest = Annotated[
    bool, flag("--on-request", "Take views only where they are asked for.", rich_help_panel=Sampling.panel)
]


@grouped
def record(
    world: World,
    output: Annotated[Path, RECORDING],
    behaviours: Annotated[
        str | None, option("WORDS", "Run these from the start of the route, blanks between, instead of following it.")
    ] = None,
    script: Annotated[Path | None, SCRIPT] = None,
    operator_style: Annotated[
        str, option("STYLE", "Who leads along the route: careful, or weaving, 0.3 m to the sides and 10°.")
    ] = "careful",
    side: Annotated[float, option("METRES", "Lane to the left of the route; negative: to its right.")] = 0.0,
    name: Annotated[str | None, option("NAME", "With --script: name of the sequence. [default: the file's]")] = None,
    notes: Annotated[str, NOTES] = "",
    form: Form = FormatName.MCAP,
    setting: Setting = Setting(),
    carrier: Carrier = Carrier(),
    sampling: Sampling = Sampling(),
    on_request: OnRequest = False,
) -> None:
    """Record a robot that follows a route, behaviours or a script."""
    from refseq_bench.sim.drives.operator import OperatorStyle, style_named

    only_one_of(behaviours=behaviours, script=script)
    _check_output(output, form)
    _check_spared(script, output, form)
    style = replace(style_named(operator_style), side=side)
    if script is not None and style != OperatorStyle():
        raise ScenarioError("--operator-style and --side are of who follows the route; valid is none with --script")
    drive = drive_in(world, setting, carrier, sampling, behaviours=tuple((behaviours or "").split()), style=style)
    if script is not None:
        from refseq_bench.scenarios.drives.teleop import TeleopDrive

        session = TeleopDrive(name or output.stem, drive, sampling.trigger_unless(on_request), notes)
        tell_of(_by_script(session, output, script, form), output)
        return
    for given, value in (("--name", name), ("--on-request", on_request)):
        if value:
            raise ScenarioError(f"{given} goes with --script; valid is to lead the robot by a script, or without it")
    _by_itself(drive, f"{world} at {setting.light}", output, form, notes)


def _check_output(output: Path, form: FormatName) -> None:
    """Raise ``ScenarioError`` for a name that is none of a recording (a bag has any), or where none can be made."""
    from refseq_bench.scenarios.drives.inputs import check_room

    if form is FormatName.MCAP:
        DRIVE.check(output)
    check_room(output, making=True)


def _check_spared(script: Path | None, output: Path, form: FormatName) -> None:
    """Raise ``ScenarioError`` where a recording would replace the one that leads it."""
    from refseq_bench.scenarios.drives.inputs import check_beside, check_spared

    if form is FormatName.MCAP:
        check_spared(output, of=[script])
    elif script is not None:
        check_beside(script, output)


def _by_itself(drive: "Drive", title: str, output: Path, form: FormatName, notes: str) -> None:
    """Record a robot that nobody leads by a script, with a bar of its way, and tell of its views."""
    from refseq.logs.formats import DriveFormat, output_format
    from refseq_bench.scenarios.drives.record import record as record_drive

    with progress_bar(title) as progress:
        recording = record_drive(
            drive, output, progress, form=output_format(DriveFormat(form)), notes=notes, whole=False
        )
    say(out, f"{output}: {plural(len(recording.views), 'view')} of {', '.join(sorted(recording.sensors))}")


@grouped
def drive(
    world: World,
    output: Annotated[Path, RECORDING],
    name: Annotated[str | None, NAME] = None,
    form: Form = FormatName.MCAP,
    notes: Annotated[str, NOTES] = "",
    gamepad: Annotated[
        Path | None, option("DEVICE", "Joystick device. [default: /dev/input/js0 if there is one]")
    ] = None,
    rate: Annotated[float, RATE] = 1.0,
    setting: Setting = Setting(),
    carrier: Carrier = Carrier(),
    sampling: Sampling = Sampling(),
    on_request: OnRequest = False,
    access: Access = Access(port=0),
) -> None:
    """Record drives of a robot that you set up and lead in the browser."""
    from refseq.logs.formats import DriveFormat, output_format
    from refseq.logs.notes import checked_notes

    _check_output(output, form)
    asked, kind = drive_in(world, setting, carrier, sampling), output_format(DriveFormat(form))

    from refseq_bench.scenarios.drives.record import check_recording, open_bench, sensors_of

    check_recording(output, kind)
    with open_bench(asked, pictured=True):
        pass  # what cannot be opened is told before a page is

    from refseq_bench.scenarios.drives.capture import CaptureFiles, record_captures
    from refseq_bench.sim.teleop.capture.setup import CaptureSetup
    from refseq_bench.sim.teleop.viewer import ViewerSettings, capture_page

    files = CaptureFiles(output, name or output.stem)
    first = CaptureSetup(files.name, checked_notes(notes), sensors_of(asked), sampling.trigger_unless(on_request))
    settings = ViewerSettings(files.name, access.policy, rate, page_told(files.name))
    with capture_page(settings, gamepad) as page:
        for path, led in record_captures(page, asked, files, first, kind):
            tell_of(led, path)


def tell_of(led: "TeleopResult", output: Path) -> None:
    """Print how a drive that was led went, and where the robot stopped itself."""
    sensed = ", ".join(sorted(led.recording.sensors))
    say(out, f"{output}: {plural(len(led.recording.views), 'view')} of {sensed}, {led.way:.1f} m in {led.time:.1f} s")
    for stop in led.stops:
        say(out, f"stopped at {stop.since:.1f} s: {stop}")


def _by_script(session: "TeleopDrive", output: Path, script: Path, form: FormatName) -> "TeleopResult":
    """Lead the robot by a script, with a bar of its time."""
    from refseq.logs.formats import DriveFormat, output_format
    from refseq_bench.scenarios.drives.teleop import controls_in, record_by_hand
    from refseq_bench.sim.teleop.script import ScriptSource

    moments = controls_in(script)
    end = moments[-1].time
    with shown_bars() as bars:
        task = bars.add_task(f"{session.drive.world} by {script.name}", total=end or 1.0, seen="")

        def show(taken: "RecordedView", views: int) -> None:
            time = taken.view.time
            bars.update(task, completed=time, seen=f"{time:5.1f} of {end:.0f} s, {views:3d} views")

        led = record_by_hand(
            session, output, lambda bench: nullcontext(ScriptSource(moments)), show, output_format(DriveFormat(form))
        )
        bars.update(task, completed=end or 1.0)
    return led
