"""Worlds that robots drive through: floor plans as TOML, surfaces drawn by code, light in photometric units.

    world = build_world(load_plan("hallway"), light_named("morning"))
    model = world.spec.compile()

``plans`` reads, checks and makes floor plans; ``change`` makes another day of one, ``drawing`` draws it on paper.
``parts`` builds what a plan holds; ``lighting`` lights it; ``meter`` measures the light; ``build`` puts all of it into
an ``MjSpec``, and ``check`` looks for what stands in the way. The names below are imported on first use.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from refseq_bench.worlds.build import World, build_world
    from refseq_bench.worlds.change.change import Change, change_named, changed
    from refseq_bench.worlds.check import Checkup, RobotBox, check_world
    from refseq_bench.worlds.drawing.draw import draw_plan
    from refseq_bench.worlds.errors import ChangeError, LightError, PlanError, WorldsError
    from refseq_bench.worlds.light import Lamps, LightSetting, light_named, light_names
    from refseq_bench.worlds.meter import Meter, Reading
    from refseq_bench.worlds.plans.generate import corridor
    from refseq_bench.worlds.plans.load import load_plan, parse_plan, world_names
    from refseq_bench.worlds.plans.schema import FloorPlan
    from refseq_bench.worlds.plans.write import plan_text

if __name__ != "refseq_bench.worlds":
    # In a checkout the path leads here too, under a name by which all classes would be there twice.
    raise ImportError(f"{__name__!r} is imported as 'refseq_bench.worlds'")

_HOMES = {
    "build": ("World", "build_world"),
    "change.change": ("Change", "change_named", "changed"),
    "check": ("Checkup", "RobotBox", "check_world"),
    "drawing.draw": ("draw_plan",),
    "errors": ("ChangeError", "LightError", "PlanError", "WorldsError"),
    "light": ("Lamps", "LightSetting", "light_named", "light_names"),
    "meter": ("Meter", "Reading"),
    "plans.generate": ("corridor",),
    "plans.load": ("load_plan", "parse_plan", "world_names"),
    "plans.schema": ("FloorPlan",),
    "plans.write": ("plan_text",),
}
_HOME = {name: module for module, names in _HOMES.items() for name in names}

__all__ = [
    "Change",
    "ChangeError",
    "Checkup",
    "FloorPlan",
    "Lamps",
    "LightError",
    "LightSetting",
    "Meter",
    "PlanError",
    "Reading",
    "RobotBox",
    "World",
    "WorldsError",
    "build_world",
    "change_named",
    "changed",
    "check_world",
    "corridor",
    "draw_plan",
    "light_named",
    "light_names",
    "load_plan",
    "parse_plan",
    "plan_text",
    "world_names",
]


def __getattr__(name: str) -> object:
    if name not in _HOME:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'; it has {', '.join(__all__)}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return [*__all__, *(name for name in globals() if name.startswith("__"))]
