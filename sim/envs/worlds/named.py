"""The worlds of environments: by their names, built once a process, and without pictures where nobody looks."""

import re
from functools import lru_cache

from refseq_bench.sim.drives.chase_camera import with_chase_camera
from refseq_bench.sim.envs.worlds.rooms import FORMS, two_rooms
from refseq_bench.sim.errors import SimError
from refseq_bench.worlds.build import World, build_world
from refseq_bench.worlds.errors import UnknownWorldError, WorldsError
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.plans.load import load_plan, written_ns
from refseq_bench.worlds.plans.schema import FloorPlan

KEPT = 16
"""So many worlds are kept in a process: a choice. One with pictures takes some tens of megabytes."""


def plan_named(name: str) -> FloorPlan:
    """A plan of the library or a file, ``corridor:SEED``, or ``rooms:FORM``; raises ``SimError`` for what is none."""
    if made := re.fullmatch(r"rooms:(\d{1,9})", name):
        return two_rooms(int(made[1]))
    try:
        return load_plan(name)
    except UnknownWorldError as error:
        raise SimError(f"{error}, or rooms:FORM (0 to {len(FORMS) - 1})") from None
    except WorldsError as error:
        raise SimError(str(error)) from None


def check_light(light: str) -> None:
    """Raise ``SimError`` for a light that there is not."""
    if not isinstance(light, str):
        raise SimError(f"light = {light!r:.60} is not valid: valid is a name or an hour, such as '16:00'")
    try:
        light_named(light)
    except WorldsError as error:
        raise SimError(str(error)) from None


def world_named(name: str, light: str, pictured: bool) -> World:
    """A world, the same object for all who ask, until its file is written anew: a bench leaves it as it is.

    It has a chase camera, and where it is ``pictured`` something to see for it. Raises ``SimError``.
    """
    return _built(name, written_ns(name), light, pictured)


@lru_cache(maxsize=KEPT)
def _built(name: str, _written: int, light: str, pictured: bool) -> World:
    try:
        return with_chase_camera(build_world(plan_named(name), light_named(light), pictured=pictured))
    except WorldsError as error:
        raise SimError(str(error)) from None
