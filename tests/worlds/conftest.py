from collections.abc import Callable

import pytest

from worlds.build import World, build
from worlds.light import light_named
from worlds.plan import load_plan

SMALL = """
name = "small"
{top}
[place]
latitude = 40.63
longitude = -8.66
timezone = "Europe/Lisbon"
date = 2008-03-20
x_azimuth = 110
[floor]
material = "plaster"
[ceiling]
height = 2.8
material = "plaster"
[material]
plaster = {{ albedo = 0.7, roughness = 0.9 }}
door = {{ albedo = 0.3, roughness = 0.5 }}
[[wall]]
name = "left"
start = [0, 1.2]
end = [8, 1.2]
inside = "right"
material = "plaster"
[[wall]]
name = "right"
start = [0, -1.2]
end = [8, -1.2]
inside = "left"
thickness = 0.3
material = "plaster"
[routes]
forward = [[1, 0], [7, 0]]
{end}
"""


@pytest.fixture
def small() -> Callable[..., str]:
    """Return the text of a short corridor, with ``top`` and ``end`` put in."""

    def text(top: str = "", end: str = "") -> str:
        return SMALL.format(top=top, end=end)

    return text


@pytest.fixture(scope="session")
def hallway() -> World:
    return build(load_plan("hallway"), light_named("18:00"), seed=0)
