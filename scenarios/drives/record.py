"""Recording one drive from names: world, light, robot, seed."""

import itertools
import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path

from refseq.errors import LogError
from refseq.files import followed
from refseq.logs import Recording
from refseq.logs.closing import DriveWriter
from refseq.logs.foxglove.writer import RecordingFormat
from refseq.logs.notes import noted
from refseq.logs.rig import SensorRig
from refseq.logs.writing import OutputFormat
from refseq.view import LASER, View
from refseq_bench import robots
from refseq_bench.robots.individual import spread_named
from refseq_bench.scenarios.drives.drive import Drive, check_sensors, name_of_route
from refseq_bench.scenarios.drives.route import driven, plan_of
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.cameras.library import load_camera
from refseq_bench.sim.drives.behaviour_drive import run_and_sense
from refseq_bench.sim.drives.chase_camera import with_chase_camera
from refseq_bench.sim.drives.operator import OperatorStyle
from refseq_bench.sim.drives.recorder import RecordedView, describe, drive_and_sense, operator_for
from refseq_bench.sim.drives.sensor_rig import sensor_rig
from refseq_bench.sim.drives.trigger import Trigger
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.sim.sensors.laser_model import LaserModel
from refseq_bench.sim.teleop.session import AbortedError
from refseq_bench.worlds.build import build_world
from refseq_bench.worlds.change.change import change_named
from refseq_bench.worlds.light import light_named

OWN_FORMAT = RecordingFormat()
"""Format of drives that are kept: who asks for another brings it, so that no key of a recording follows the others."""

Progress = Callable[[float, float | None, int], None]
"""Told how far the robot has come [m], of how much [m] (None: nobody knows), and the number of views so far."""


ViewCallback = Callable[[RecordedView, int], None]
"""Told of each view, and of the number of views so far."""


class NoViewError(ScenarioError):
    """A drive ended before its first view."""


def open_bench(drive: Drive, *, watched: bool = False, pictured: bool = False) -> Bench:
    """The simulation of a drive, at its start; ``watched`` by a chase camera. Raises the rooms' errors for names.

    Its world has pictures where a camera takes images, and where it is to be ``pictured`` for somebody who looks on.
    """
    robot = robots.load(drive.robot)
    if drive.sensors is not None:
        check_sensors(drive.sensors, robot)
    cameras = tuple(name for name in robot.cameras if drive.sensors is None or name in drive.sensors)
    if drive.renderer is RendererKind.NONE and drive.sensors is not None and LASER not in drive.sensors:
        raise ScenarioError("renderer 'none' takes no images; valid is to record the laser as well, or to render")
    renderer = drive.renderer if cameras else RendererKind.NONE
    pictured = pictured or watched or renderer is not RendererKind.NONE
    world = build_world(plan_of(drive), light_named(drive.light), drive.world_seed, pictured=pictured)
    if watched:
        world = with_chase_camera(world)
    settings = BenchSettings(
        renderer=renderer,
        cameras=cameras,
        camera_models={name: load_camera(model) for name, model in drive.cameras.items()},
        laser=LaserModel(mode=drive.laser),
        spread=spread_named(drive.robot_spread),
        unit=drive.unit,
    )
    route = drive.route_name
    if route not in world.routes:
        raise ScenarioError(f"unknown route {route!r} in world {world.name!r}: valid are {', '.join(world.routes)}")
    return Bench(world, robot, route=driven(world.routes[route], drive), seed=drive.seed, settings=settings)


def record(
    drive: Drive,
    path: Path | None,
    progress: Progress | None = None,
    told: ViewCallback | None = None,
    form: OutputFormat = OWN_FORMAT,
    *,
    notes: str = "",
    whole: bool = True,
) -> Recording:
    """Simulate the drive and write it to ``path``, None: nowhere; returns what was recorded. ``told`` hears of views.

    Free ``notes`` are kept in its metadata.

    Unless ``whole`` the recording that is returned holds images and scan of its first view alone: those of a long drive
    fill the memory, half a gigabyte in 1000 views.
    When it is interrupted, or the robot is stuck, ``path`` stays as it was; the views up to then are kept beside it,
    marked as incomplete, and the error's note tells where. Raises ``LogError`` where a recording of this format cannot
    lie at ``path``.
    """
    check_recording(path, form)
    kept = noted(notes)
    with open_bench(drive) as bench:
        operator = operator_for(bench, drive.seed, drive.style)
        metadata = {**described(bench, drive, drive.trigger, drive.style), **kept, **_asked(drive)}
        if drive.behaviours:
            drive_on = run_and_sense(bench, drive.behaviours, drive.trigger, timeout=drive.patience)
        else:
            drive_on = drive_and_sense(bench, operator, drive.trigger, faults=drive.faults, timeout=drive.patience)

        def tell(taken: RecordedView, count: int) -> None:
            if told is not None:
                told(taken, count)
            if progress is not None:
                # How far behaviours will lead, nobody knows.
                progress(taken.progress, None if drive.behaviours else operator.length, count)

        rig = sensor_rig(bench)
        return write_drive(path, metadata, drive_on, scanning=scans(drive), told=tell, form=form, rig=rig, whole=whole)


def _asked(drive: Drive) -> dict[str, str]:
    """Metadata of the faults and behaviours that were asked for."""
    made = {}
    if drive.faults:
        made["faults"] = json.dumps([asdict(fault) for fault in drive.faults], sort_keys=True)
    if drive.behaviours:
        made["behaviours"] = json.dumps(drive.behaviours)
    return made


def check_recording(path: Path | None, form: OutputFormat = OWN_FORMAT) -> None:
    """Raise ``LogError`` where a recording of this format cannot lie at ``path``."""
    if path is not None:
        form.check(path)


def scans(drive: Drive) -> bool:
    """Tell whether the laser is among the sensors that are recorded."""
    return drive.sensors is None or LASER in drive.sensors


def sensors_of(drive: Drive) -> tuple[str, ...]:
    """The sensors that a drive records, by name."""
    cameras = () if drive.renderer is RendererKind.NONE else robots.load(drive.robot).cameras
    return tuple(name for name in (*cameras, LASER) if drive.sensors is None or name in drive.sensors)


def described(
    bench: Bench, drive: Drive, trigger: Trigger | None, style: OperatorStyle | None = None
) -> Mapping[str, str]:
    """Metadata of a recording about its drive, with the change from its plan."""
    told = describe(bench, route=name_of_route(drive), seed=drive.seed, trigger=trigger, style=style)
    return {**told, "change": change_named(drive.change).as_text(), "change_seed": str(drive.day)}


def write_drive(
    path: Path | None,
    metadata: Mapping[str, str],
    drive_on: Iterator[RecordedView],
    *,
    scanning: bool = True,
    told: ViewCallback | None = None,
    afterwards: Callable[[], Mapping[str, str]] = dict,
    form: OutputFormat = OWN_FORMAT,
    rig: SensorRig | None = None,
    whole: bool = True,
) -> Recording:
    """Write the views of a drive as they are taken, to ``path``, None: nowhere; ``told`` hears of each when it is kept.

    ``rig`` tells of mounts and calibrations where the format has a place for them. Where nothing is written, the
    recording holds no images and scans, and unless ``whole`` only those of its first view. ``afterwards`` gives what is
    known of a drive only when it has ended. Raises as ``record`` does, and ``NoViewError`` without a view; of a drive
    that is aborted nothing is kept.
    """
    views: list[View] = []
    taken_on = (taken if scanning else replace(taken, view=replace(taken.view, scan=None)) for taken in drive_on)
    every = _from_first(path, taken_on)

    def keep(taken: RecordedView, writer: DriveWriter | None) -> None:
        if writer is not None:
            writer.write(taken.view, taken.odometry)
        held = writer is not None and (whole or not views)
        views.append(taken.view if held else replace(taken.view, images={}, scan=None))
        if told is not None:
            told(taken, len(views))

    if path is None:
        for taken in every:
            keep(taken, None)
    else:
        _write(path, partial(form.open, path, metadata, rig), every, keep, afterwards)
    return Recording(tuple(views), {**metadata, **afterwards()})


def _from_first(path: Path | None, drive_on: Iterator[RecordedView]) -> Iterator[RecordedView]:
    """The views, once there is one. Raises ``NoViewError``, and notes in an interrupt that nothing is written."""
    try:
        first = next(drive_on, None)
    except KeyboardInterrupt as stop:
        stop.add_note(f"{path or 'the drive'} is not written")
        raise
    if first is None:
        raise NoViewError(f"{path or 'the drive'} is not written: no view was taken")
    return itertools.chain([first], drive_on)


def _write(
    path: Path,
    opener: Callable[[], DriveWriter],
    every: Iterator[RecordedView],
    keep: Callable[[RecordedView, DriveWriter], None],
    afterwards: Callable[[], Mapping[str, str]],
) -> None:
    _make_folder(path)
    with opener() as writer:
        try:
            for taken in every:
                keep(taken, writer)
        except AbortedError:
            writer.discard()
            raise
        except BaseException:
            with suppress(LogError):  # a full disk takes no more
                writer.note(afterwards())
            raise
        writer.note(afterwards())


def _make_folder(path: Path) -> None:
    """Make the folder of a file to write."""
    try:
        followed(path).parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ScenarioError(f"{path}: cannot be written: {path.parent}: {error.strerror}") from error
