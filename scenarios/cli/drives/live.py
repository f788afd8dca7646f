"""The command ``refseq live``: localise while the robot drives, and show what it believes."""

from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from refseq_bench.scenarios.cli.drives.localise import conclude
from refseq_bench.scenarios.cli.terminal.bars import status_line
from refseq_bench.scenarios.cli.terminal.options import (
    DEFAULT_RENDERER_NAME,
    SCRIPT,
    AtLeast,
    CarrierInMap,
    MapFile,
    RendererName,
    Sampling,
    Screen,
    Setting,
    Stages,
    World,
    drive_in,
    flag,
    grouped,
    only_one_of,
    option,
)
from refseq_bench.scenarios.cli.terminal.outputs import BELIEFS, DRIVE, SCREENING, file_to_write
from refseq_bench.scenarios.cli.terminal.screen import in_file, on_screen, page_told
from refseq_bench.scenarios.drives.inputs import check_output, load_map, stages, words

if TYPE_CHECKING:
    from refseq.logs import Recording
    from refseq.map.map import Map
    from refseq_bench.scenarios.drives.drive import Drive
    from refseq_bench.scenarios.drives.live import LiveRun

LIVE_HELP = """Examples:

* `refseq live map.refseq hallway --light 18:00`
* `refseq live map.refseq hallway --serve 9090 --recording query.mcap -o beliefs.parquet`
* `refseq live map.refseq hallway --script keys.txt --rrd live.rrd`

Only the sensors of the map are simulated. Exit codes: as those of `refseq localise`, and 1 where
the robot is stuck."""


@grouped
def live(
    map_file: MapFile,
    world: World,
    output: Annotated[Path | None, BELIEFS] = None,
    recording: Annotated[Path | None, file_to_write(DRIVE, "Keep the drive as a recording")] = None,
    script: Annotated[Path | None, SCRIPT] = None,
    keys: Annotated[bool, flag("--keys", "Lead the robot in the browser, as with `refseq drive`.")] = False,
    stage: Stages = None,
    localiser_seed: Annotated[int, option("N", "Seed of the localiser's random draws.", min=0)] = 1,
    at_least: AtLeast = None,
    setting: Setting = Setting(light="18:00", seed=2),
    carrier: CarrierInMap = CarrierInMap(),
    sampling: Sampling = Sampling(),
    rrd: Annotated[
        Path | None, file_to_write(SCREENING, "File for the viewer to write instead", rich_help_panel=Screen.panel)
    ] = None,
    screen: Screen = Screen(),
) -> None:
    """Localise while the robot drives, and show what it believes."""
    only_one_of(script=script, keys=keys)
    only_one_of(rrd=rrd, connect=screen.connect, serve=screen.serve)
    check_output(output, recording, rrd, of=[map_file, script])
    screen.check(rrd)
    from refseq.map.localiser import StagedLocaliser
    from refseq.viewer.belief_log import LocaliserLayer
    from refseq.viewer.places import Places
    from refseq_bench.scenarios.drives.evaluate import comparison_of
    from refseq_bench.scenarios.drives.live import LiveRun, live_logger

    wanted, map_ = stages(stage), load_map(map_file)
    drive = _drive(map_, world, setting, carrier, sampling)
    title = f"{map_file.name} ← {drive.world} at {drive.light}"
    layer = LocaliserLayer("map", tuple(one.value for one in wanted), Places.of(map_))
    localiser = StagedLocaliser(map_, stages=wanted, sensors=words(carrier.sensors, "sensors"), seed=localiser_seed)
    run = LiveRun(localiser.update, layer.places)
    with in_file(rrd, title) if rrd is not None else on_screen(title, screen, live=True) as stream:
        run.logger = live_logger(stream, title, drive, layer)
        driven = _driven(drive, recording, script, run, keys=keys)
        conclude(comparison_of(title, map_, driven, run.beliefs), map_, output, at_least)


def _drive(map_: "Map", world: str, setting: Setting, carrier: CarrierInMap, sampling: Sampling) -> "Drive":
    """The drive that is asked for; where nothing else is said, with the map's robot, and images as sensors need."""
    from dataclasses import replace

    from refseq.view import LASER
    from refseq_bench.scenarios.drives.live import sensors_for

    sensors = sensors_for(map_, words(carrier.sensors, "sensors"))
    needed = RendererName.NONE if set(sensors) == {LASER} else DEFAULT_RENDERER_NAME
    robot = carrier.robot or str(map_.sequences[0].metadata.get("robot", "robuter"))
    carrier = replace(carrier, robot=robot, renderer=carrier.renderer or needed)
    return drive_in(world, setting, carrier, sampling, sensors=sensors)


def _driven(drive: "Drive", path: Path | None, script: Path | None, run: "LiveRun", *, keys: bool) -> "Recording":
    """Lead the robot as asked; its views are localised as they come."""
    from refseq_bench.scenarios.drives.record import record
    from refseq_bench.scenarios.drives.teleop import TeleopDrive, by_viewer, controls_in, record_by_hand
    from refseq_bench.sim.teleop.script import ScriptSource

    with status_line(f"{drive.world} at {drive.light}") as run.told:
        if script is None and not keys:
            return record(drive, path, told=run.take, whole=False)
        session = TeleopDrive(path.stem if path else "live", drive, drive.trigger)
        if script is None:
            return record_by_hand(session, path, by_viewer(session, page_told(session.name)), run.take).recording
        commands = controls_in(script)
        return record_by_hand(session, path, lambda bench: nullcontext(ScriptSource(commands)), run.take).recording
