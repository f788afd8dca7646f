"""Check that a drive can be driven, before anything is simulated."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from refseq.view import LASER
from refseq_bench import robots
from refseq_bench.robots import Robot
from refseq_bench.robots.behaviours.written import parse_behaviour
from refseq_bench.scenarios.drives.drive import Drive, check_sensors, name_of_route
from refseq_bench.scenarios.drives.route import driven, plan_of
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.sim.bench.faults import CameraBlack, check_driven, check_fault
from refseq_bench.sim.cameras.library import load_camera
from refseq_bench.sim.drives.operator import Operator
from refseq_bench.sim.drives.signal_faults import SignalFault
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.plans.load import written_ns


def check_drive(drive: Drive, sensors: Sequence[str] | None) -> None:
    """Raise the rooms' own errors for a drive that cannot be driven, or shows nothing to those ``sensors``."""
    robot = _robot(drive.robot)
    check_sensors(tuple(sensors or ()), robot)
    if drive.renderer is RendererKind.NONE and LASER not in (sensors or (LASER,)):
        raise ScenarioError(
            f"renderer 'none' takes no images, and sensors are {', '.join(sensors or ())}; valid is to "
            "render, or to look at the laser as well"
        )
    light_named(drive.light)
    if len(drive.waypoints) == 1:
        raise ScenarioError("one of waypoints is no route; valid are two or more, or none for a route of the world")
    for words in drive.behaviours:
        parse_behaviour(words)
    for camera, model in drive.cameras.items():
        check_sensors((camera,), robot)
        load_camera(model)
    length = check_route(drive)
    for fault in drive.faults:
        check_fault(fault, robot, length)
        if isinstance(fault, CameraBlack):
            _check_asked(fault.kind, (fault.camera,), _recorded(drive))


def check_learnable(drive: Drive) -> None:
    """Raise ``ScenarioError`` for a drive that ends before its second view: no map is learnt from one alone.

    Where views are taken by turns, by time or on behaviours' way, it is known only when it was driven.
    """
    trigger = drive.trigger
    if drive.behaviours or trigger.turn or trigger.time or not trigger.distance:
        return
    length = check_route(drive)
    if length < trigger.distance:
        raise ScenarioError(
            f"{name_of_route(drive)}: {length:g} m, too short to learn from; valid are {trigger.distance:g} m or more, "
            "where the second view is taken"
        )


def check_signal_faults(drive: Drive, faults: Sequence[SignalFault], sensors: Sequence[str] | None) -> None:
    """Raise ``ScenarioError`` or ``SimError`` for a fault that no view of the drive can have.

    It is beyond the drive's end, or of a sensor that is not looked at or not there.

    ``sensors`` are those that are looked at, None: all.
    """
    length, asked = check_route(drive), tuple(sensors or _recorded(drive))
    for fault in faults:
        check_sensors(fault.sensors, _robot(drive.robot))
        _check_asked(fault.kind, fault.sensors, asked)
        if not drive.behaviours:  # they drive as far as they come
            check_driven(fault.kind, "at", fault.at, length)


def _check_asked(kind: str, wanted: Sequence[str], asked: Sequence[str]) -> None:
    for sensor in wanted:
        if sensor not in asked:
            raise ScenarioError(f"fault {kind}: nothing is taken of {sensor!r} here; valid are {', '.join(asked)}")


def _recorded(drive: Drive) -> tuple[str, ...]:
    """The sensors of which a drive's views hold something."""
    cameras = () if drive.renderer is RendererKind.NONE else tuple(_robot(drive.robot).cameras)
    return (*cameras, LASER)


@cache
def _robot(name: str) -> Robot:
    """A robot that is looked at and not driven; hundreds of cases name the same."""
    return robots.load(name)


def check_route(drive: Drive) -> float:
    """Length of what is driven [m]. Raises ``WorldsError``, ``SimError``, ``ScenarioError`` for what cannot be."""
    written, day = written_ns(drive.world), drive.day
    return _length(
        _Route(drive.world, written, drive.change, day, drive.route, drive.waypoints, drive.start, drive.end)
    )


@dataclass(frozen=True, slots=True)
class _Route:
    """All that decides how long a drive is; ``written_ns`` is when the plan was last written."""

    world: str
    written_ns: int
    change: str
    change_seed: int
    route: str
    waypoints: tuple[tuple[float, float], ...]
    start: float
    end: float | None


@cache
def _length(asked: _Route) -> float:
    """Length of a route as the operator drives it [m]; many cases drive the same."""
    drive = Drive(
        world=asked.world,
        change=asked.change,
        change_seed=asked.change_seed,
        route=asked.route,
        waypoints=asked.waypoints,
        start=asked.start,
        end=asked.end,
    )
    plan = plan_of(drive)
    name = drive.route_name
    if name not in plan.routes:
        raise ScenarioError(f"unknown route {name!r} in world {plan.name!r}: valid are {', '.join(plan.routes)}")
    route = driven(np.array(plan.routes[name]), drive)
    return Operator(route, drive.style, np.random.default_rng(0)).length
