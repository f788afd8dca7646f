"""Facts about robots: figures taken from its compiled model and from its Control layer."""

import math
from collections.abc import Iterator, Sequence

import numpy as np
from rich.table import Table
from rich.text import Text

from refseq_bench import robots
from refseq_bench.robots import Robot
from refseq_bench.robots.odometry import true_geometry
from refseq_bench.scenarios.robot_checks.body import Body
from refseq_bench.scenarios.robot_checks.sources import RobotMeasure, measures, sourced
from refseq_bench.scenarios.tables import TextTable
from refseq_bench.worlds.arrays import Floats


def robots_table() -> TextTable:
    """All robots, a row each, for a terminal of 80 characters."""
    table = TextTable("robot", ">mass [kg]", ">size [m]", ">[m/s]", "sensors", wraps=("sensors",))
    for name in robots.names():
        body = Body(robots.load(name))
        size = " × ".join(f"{side:.2f}" for side in body.whole.size)
        speed = f"{body.robot.limits.speed:g}"
        table.add_row(name, f"{body.mass:.1f}", size, speed, sensors_text(body.robot))
    return table


def robots_facts() -> list[dict[str, object]]:
    """All robots, for other programs."""
    return [robot_facts(Body(robots.load(name))) for name in robots.names()]


def robot_facts(body: Body) -> dict[str, object]:
    """One robot, for other programs; measures as in ``sources.RobotMeasure``."""
    robot, limits = body.robot, body.robot.limits
    return {
        "name": robot.name,
        "mass_kg": body.mass,
        "size_m": body.whole.size.tolist(),
        "measures_m": {measure.value: value for measure, value in measures(body).items()},
        "speed_mps": limits.speed,
        "turn_rate_radps": limits.turn_rate,
        "pulses_per_turn": robot.pulses_per_turn,
        "cameras": list(robot.cameras),
        "sonars": list(robot.sonars),
        "bumpers": list(robot.bumpers),
    }


def sensors_text(robot: Robot) -> str:
    """Sensors of a robot in a few words."""
    counted = {"cameras": len(robot.cameras), "sonars": len(robot.sonars), "bumpers": len(robot.bumpers)}
    return ", ".join(("laser", *(f"{count} {what}" for what, count in counted.items() if count)))


def robot_table(body: Body) -> Table:
    """All about one robot, for a terminal of 80 characters."""
    table = Table.grid(padding=(0, 2))
    table.add_column(style="bold", no_wrap=True)
    table.add_column()
    for about, line in (*_body_lines(body), *_drive_lines(body), *_sensor_lines(body)):
        table.add_row(about, Text(line))
    return table


def _body_lines(body: Body) -> Iterator[tuple[str, str]]:
    whole, vehicle = body.whole, body.vehicle
    yield body.robot.name, "x ahead, y left, z up, from midway between the drive wheels"
    yield "size", f"{_size(whole.size)} m, x {whole.low[0]:.3f} to {whole.high[0]:.3f}"
    yield "", f"{_size(vehicle.size)} m without mast, cameras and laser"
    yield "mass", f"{body.mass:.1f} kg, its centre at {_point(body.centre)} m"
    yield "inertia", f"{_point(np.diag(body.inertia), 2)} kg m², roll, pitch, yaw"
    yield "geoms", f"{len(body.seen)} seen, {len(body.touched)} touched"


def _drive_lines(body: Body) -> Iterator[tuple[str, str]]:
    robot, limits = body.robot, body.robot.limits
    radius = float(body.hubs[0, 2])
    yield "drive wheels", f"radius {radius:.3f} m, track {body.track:.3f} m, {body.wheel_mass:.2f} kg each"
    yield "motors", f"up to {body.torque:g} N m a wheel, {robot.drive.max_wheel_speed:g} rad/s"
    pulse = 2e6 * math.pi * radius / robot.pulses_per_turn
    yield "encoders", f"{robot.pulses_per_turn} pulses a wheel turn, {pulse:.1f} µm each"
    yield "speed", f"{limits.speed:g} m/s, {limits.turn_rate:g} rad/s"
    yield "acceleration", f"{limits.acceleration:g} m/s², {limits.angular_acceleration:g} rad/s²"
    yield "electronics", f"a tick every {1000 * robot.control(true_geometry(robot.drive)).period:g} ms"


def _sensor_lines(body: Body) -> Iterator[tuple[str, str]]:
    robot, data = body.robot, body.data
    yield "laser", f"scan plane at {_point(data.site(robot.laser).xpos)} m"
    for name in robot.cameras:
        axes = data.camera(name).xmat.reshape(3, 3)
        bearing = round(math.degrees(math.atan2(-axes[1, 2], -axes[0, 2])))  # a camera looks along its -z
        seen = f"looks to {bearing}°, {body.model.camera(name).fovy[0]:.1f}° high"
        yield name, f"at {_point(data.camera(name).xpos)} m, {seen}"
    if robot.sonars:
        heights = [data.site(name).xpos[2] for name in robot.sonars]
        yield "sonars", f"{len(robot.sonars)}, {min(heights):.3f} to {max(heights):.3f} m above the floor"
    if robot.bumpers:
        yield "bumpers", ", ".join(robot.bumpers)


def _size(sides: Floats) -> str:
    return " × ".join(f"{side:.3f}" for side in sides)


def _point(values: Sequence[float] | Floats, digits: int = 3) -> str:
    """Three numbers in brackets; no minus before a zero."""
    return f"({', '.join(f'{float(value):z.{digits}f}' for value in values)})"


def proportions_table(body: Body) -> TextTable | None:
    """Sourced measures beside the model's, also in wheel diameters; None where nothing of the robot was sourced."""
    known = sourced(body)
    if not known:
        return None
    model, wheel = measures(body), known[RobotMeasure.WHEEL].value
    table = TextTable("measure", "from", ">sourced [m]", ">model [m]", ">in wheels", ">model", ">off")
    for measure, found in known.items():
        ours = model[measure]
        cells = (found.value, ours, found.value / wheel, ours / model[RobotMeasure.WHEEL])
        off = f"{round(100 * (ours / found.value - 1), 1) + 0.0:+.1f} %"
        table.add_row(measure.value, found.tag, *(f"{cell:.3f}" for cell in cells), off)
    return table
