"""A robot in a world as one simulation: clock, cameras, laser, sonar, odometry, recorded drives, environments.

    with Bench(build_world(load_plan("hallway"), light_named("16:00")), robots.load("robuter"), seed=1) as bench:
        views = list(record(bench))

``bench`` steps world and robot; ``drives`` leads the robot and takes views; ``missions`` carries out missions and LAMP
programs; ``envs`` holds the Gymnasium environments, which ``import refseq_bench.sim.envs`` registers; ``teleop`` is for
driving by hand. The names below are imported on first use.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from refseq_bench.sim.bench.bench import Bench
    from refseq_bench.sim.bench.faults import CameraBlack, Kidnap, LaserDazzled, WheelSlip
    from refseq_bench.sim.bench.settings import BenchSettings
    from refseq_bench.sim.cameras.camera import CameraModel
    from refseq_bench.sim.drives.operator import Operator, OperatorStyle
    from refseq_bench.sim.drives.recorder import record
    from refseq_bench.sim.drives.trigger import Trigger
    from refseq_bench.sim.errors import RendererError, SimError, StuckError
    from refseq_bench.sim.rendering.renderer import RendererKind
    from refseq_bench.sim.sensors.inertial import InertialModel
    from refseq_bench.sim.sensors.laser_model import LaserModel
    from refseq_bench.sim.sensors.sonar import SonarModel

if __name__ != "refseq_bench.sim":
    # In a checkout the path leads here too, under a name by which all classes would be there twice.
    raise ImportError(f"{__name__!r} is imported as 'refseq_bench.sim'")

_HOMES = {
    "bench.bench": ("Bench",),
    "bench.faults": ("CameraBlack", "Kidnap", "LaserDazzled", "WheelSlip"),
    "bench.settings": ("BenchSettings",),
    "cameras.camera": ("CameraModel",),
    "drives.operator": ("Operator", "OperatorStyle"),
    "drives.recorder": ("record",),
    "drives.trigger": ("Trigger",),
    "errors": ("RendererError", "SimError", "StuckError"),
    "rendering.renderer": ("RendererKind",),
    "sensors.inertial": ("InertialModel",),
    "sensors.laser_model": ("LaserModel",),
    "sensors.sonar": ("SonarModel",),
}
_HOME = {name: module for module, names in _HOMES.items() for name in names}

__all__ = [
    "Bench",
    "BenchSettings",
    "CameraBlack",
    "CameraModel",
    "InertialModel",
    "Kidnap",
    "LaserDazzled",
    "LaserModel",
    "Operator",
    "OperatorStyle",
    "RendererError",
    "RendererKind",
    "SimError",
    "SonarModel",
    "StuckError",
    "Trigger",
    "WheelSlip",
    "record",
]


def __getattr__(name: str) -> object:
    if name not in _HOME:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'; it has {', '.join(__all__)}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return [*__all__, *(name for name in globals() if name.startswith("__"))]
