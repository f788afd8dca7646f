"""Settings of a bench: its sensors, its renderer, and which individual robot it is."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from refseq_bench.robots import Robot
from refseq_bench.robots.individual import RobotSpread
from refseq_bench.sim.cameras.camera import CameraModel
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.rendering.renderer import DEFAULT_RENDERER, RendererKind
from refseq_bench.sim.sensors.inertial import InertialModel
from refseq_bench.sim.sensors.laser_model import LaserModel
from refseq_bench.sim.sensors.sonar import SonarModel


@dataclass(frozen=True, slots=True)
class BenchSettings:
    """Sensors of the bench, and the individual robot ``unit`` of those that differ by ``spread``.

    ``cameras`` are those that take images, None for all of the robot's: rendering is the cost of the bench.
    ``camera_models`` are the cameras that are no plain ``CameraModel()``, by name; a model's lens and sensor rule over
    the field of view in the robot's own file.
    """

    renderer: RendererKind = DEFAULT_RENDERER
    cameras: tuple[str, ...] | None = None
    camera_models: Mapping[str, CameraModel] = field(default_factory=dict)
    laser: LaserModel = field(default_factory=LaserModel)
    sonar: SonarModel = field(default_factory=SonarModel)
    inertial: InertialModel = field(default_factory=InertialModel)
    spread: RobotSpread = field(default_factory=RobotSpread)
    unit: int = 1


def resolved(settings: BenchSettings, robot: Robot) -> BenchSettings:
    """``settings`` with all cameras of the robot named and a model for each."""
    for name in (*(settings.cameras or ()), *settings.camera_models):
        if name not in robot.cameras:
            raise SimError(f"unknown camera {name!r} of robot {robot.name!r}: valid are {', '.join(robot.cameras)}")
    cameras = robot.cameras if settings.cameras is None else tuple(settings.cameras)
    models = {name: settings.camera_models.get(name) or CameraModel() for name in robot.cameras}
    return replace(settings, cameras=cameras, camera_models=models)
