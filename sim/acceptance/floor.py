"""An empty floor in the open air, to try robots on."""

from refseq_bench.worlds.build import World, build_world
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.plans.load import parse_plan

FLOOR = """
name = "floor"
title = "Empty floor in the open air"
[place]
latitude = 40.63
longitude = -8.66
timezone = "Europe/Lisbon"
date = 2008-03-20
x_azimuth = 110
[floor]
area = [[-20, -20], [20, 20]]
material = "concrete"
pattern = "tiles"
tile = 1
[material]
concrete = { albedo = 0.45, roughness = 0.9 }
[routes]
forward = [[-15, 0], [15, 0]]
"""


def empty_floor(light: str | None = None) -> World:
    """A fresh floor of 40 m by 40 m of concrete, with one route along the x axis; without a ``light`` for no camera."""
    return build_world(parse_plan(FLOOR), light_named(light or "overcast"), pictured=light is not None)
