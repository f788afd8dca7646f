"""Robots by name."""

from collections.abc import Callable

from refseq_bench.robots import robuter, segway_rmp
from refseq_bench.robots.errors import RobotsError
from refseq_bench.robots.robot import Robot

_LOADERS: dict[str, Callable[[], Robot]] = {
    "robuter": robuter.load,
    "segway_rmp": segway_rmp.load,
    "segway_rmp-tractor": segway_rmp.load_with_tail,
}


def names() -> tuple[str, ...]:
    """Names of all robots, in alphabetical order."""
    return tuple(sorted(_LOADERS))


def load(name: str) -> Robot:
    """Build a fresh robot by its name; raises ``RobotsError`` for an unknown one."""
    if name not in _LOADERS:
        raise RobotsError(f"unknown robot '{name}': valid are {', '.join(names())}")
    return _LOADERS[name]()
