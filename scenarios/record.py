"""Recording one drive from names: world, light, robot, seed."""

import itertools
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import robots
from refseq.logs import Recording, RecordingWriter, read_recording
from refseq.view import LASER, View
from robots import Robot
from scenarios.errors import ScenarioError
from sim.bench import Bench, BenchSettings
from sim.cameras import load_camera
from sim.laser import LaserModel, RangeMode
from sim.operator import OperatorStyle
from sim.recorder import Trigger, describe, drive_and_sense, operator_for
from sim.render import RendererKind
from worlds.build import build
from worlds.change import change_named, changed
from worlds.light import light_named
from worlds.plan import load_plan

Progress = Callable[[float, float, int], None]
"""Told how far the robot has come [m], of how much [m], and the number of views so far."""


@dataclass(frozen=True, slots=True)
class Drive:
    """A drive to record; equal drives give equal recordings. ``sensors`` None means all that the robot has.

    ``light`` and ``change`` are texts as ``light_named`` and ``change_named`` read them. The change is drawn from
    ``change_seed``, None: the drive's own. ``cameras`` names the model of each camera that is no Fire-i. ``laser``
    tells how far the laser reaches.
    """

    world: str = "hallway"
    light: str = "16:00"
    change: str = "none"
    change_seed: int | None = None
    robot: str = "robuter"
    route: str = "forward"
    seed: int = 1
    world_seed: int = 0
    renderer: RendererKind = RendererKind.FILAMENT
    trigger: Trigger = field(default_factory=Trigger)
    style: OperatorStyle = field(default_factory=OperatorStyle)
    sensors: tuple[str, ...] | None = None
    cameras: Mapping[str, str] = field(default_factory=dict)
    laser: RangeMode = RangeMode.METRES_80

    @property
    def day(self) -> int:
        """Seed of what is not as it was."""
        return self.seed if self.change_seed is None else self.change_seed


class Interrupted(KeyboardInterrupt):
    """The user stopped a drive of which views are already recorded; the message says where."""


def open_bench(drive: Drive) -> Bench:
    """The simulation of a drive, at its start. Raises the rooms' own errors for names that they do not know."""
    robot = robots.load(drive.robot)
    if drive.sensors is not None:
        check_sensors(drive.sensors, robot)
    cameras = tuple(name for name in robot.cameras if drive.sensors is None or name in drive.sensors)
    if drive.renderer is RendererKind.NONE and drive.sensors is not None and LASER not in drive.sensors:
        raise ScenarioError("renderer 'none' takes no images; valid is to record the laser as well, or to render")
    plan = changed(load_plan(drive.world), change_named(drive.change), drive.day)
    world = build(plan, light_named(drive.light), drive.world_seed)
    settings = BenchSettings(
        renderer=drive.renderer if cameras else RendererKind.NONE,
        cameras=cameras,
        camera_models={name: load_camera(model) for name, model in drive.cameras.items()},
        laser=LaserModel(mode=drive.laser),
    )
    return Bench(world, robot, route=drive.route, seed=drive.seed, settings=settings)


def check_sensors(wanted: tuple[str, ...], robot: Robot) -> None:
    """Raise ``ScenarioError`` for a sensor that the robot does not carry."""
    valid = (*robot.cameras, LASER)
    for sensor in wanted:
        if sensor not in valid:
            raise ScenarioError(f"sensor {sensor!r} is not on robot {robot.name!r}; valid are {', '.join(valid)}")


def record(drive: Drive, path: Path, progress: Progress | None = None) -> Recording:
    """Simulate the drive and write it to ``path``; returns what was recorded.

    When it is interrupted the recording is closed, readable, at ``path``, and ``Interrupted`` is raised; before the
    first view there is nothing to keep, and ``path`` stays as it was. Raises ``ScenarioError`` when ``path`` cannot be
    a file.
    """
    if path.is_dir():
        raise ScenarioError(f"{path}: is a folder; valid is the name of a recording to write")
    with open_bench(drive) as bench:
        scanning = drive.sensors is None or LASER in drive.sensors
        operator = operator_for(bench, drive.seed, drive.style)
        metadata = describe(bench, route=drive.route, seed=drive.seed, trigger=drive.trigger, style=drive.style)
        metadata = {**metadata, "change": change_named(drive.change).as_text(), "change_seed": str(drive.day)}
        drive_on = drive_and_sense(bench, operator, drive.trigger)
        first = next(drive_on)
        _make_folder(path)
        views: list[View] = []
        try:
            with RecordingWriter(path, metadata) as writer:
                for taken in itertools.chain([first], drive_on):
                    view = taken.view if scanning else replace(taken.view, scan=None)
                    writer.write(view, taken.odometry)
                    views.append(view)
                    if progress is not None:
                        progress(taken.progress, operator.length, len(views))
        except KeyboardInterrupt:
            kept = len(read_recording(path).views)  # the stop may have come between writing a view and noting it
            raise Interrupted(f"{path} is readable and holds all views up to now, {kept}") from None
        return Recording(tuple(views), metadata)


def _make_folder(path: Path) -> None:
    """Make the folder of a file to write."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ScenarioError(f"{path}: cannot be written: {path.parent}: {error.strerror}") from error
