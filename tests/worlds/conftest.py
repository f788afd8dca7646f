from collections.abc import Callable

import mujoco
import pytest

from refseq_bench.worlds.build import World, build_world
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.plans.load import load_plan

PLAIN = """
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
"""
"""Where the plans of tests lie, and their floor and ceiling."""

SMALL = (
    """
name = "small"
{top}"""
    + PLAIN
    + """[material]
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
)

CORNER = (
    'name = "corner"'
    + PLAIN
    + """[material]
plaster = { albedo = 0.7, roughness = 0.9 }
"""
)


OPEN = """
name = "open"
[place]
latitude = 40.63
longitude = -8.66
timezone = "Europe/Lisbon"
date = 2008-03-20
x_azimuth = 70
[floor]
material = "asphalt"
pattern = "asphalt"
area = [[-20, -15], [20, 15]]
[material]
asphalt = { albedo = 0.12, roughness = 1.0 }
paint = { albedo = 0.4, roughness = 1.0 }
"""


def in_the_open(things: str = "", y: float = 0.0) -> str:
    """Return the text of ground 40 x 30 m around the origin with ``things`` and a route along x at ``y``."""
    return f"{OPEN}{things}\n[routes]\nforward = [[-10, {y}], [10, {y}]]\n"


def corner(x: float = 0.0, length: float = 6.0, depth: float = 5.0) -> str:
    """Return the text of two corridors 2 m wide, along y = 0 from ``x`` on for ``length``, and up to y = ``depth``."""
    right, left = x + length, x + length - 2
    walls = {
        "outer-1": ([x, -1], [right, -1], "left"),
        "outer-2": ([right, -1], [right, depth], "left"),
        "end-2": ([right, depth], [left, depth], "left"),
        "inner-2": ([left, 1], [left, depth], "right"),
        "inner-1": ([x, 1], [left, 1], "right"),
        "end-1": ([x, -1], [x, 1], "right"),
    }
    text = [
        f'[[wall]]\nname = "{name}"\nstart = {start}\nend = {end}\ninside = "{inside}"\nmaterial = "plaster"\n'
        for name, (start, end, inside) in walls.items()
    ]
    return CORNER + "".join(text) + f"[routes]\nforward = [[{x + 1}, 0], [{right - 1}, 0]]\n"


def box(length: float, width: float, albedo: float = 0.7, end: str = "") -> str:
    """Return the text of a closed room along y = 0 from x = 0 on, 2.8 m high, all of one albedo."""
    half = width / 2
    corners = [[0, -half], [length, -half], [length, half], [0, half]]
    walls = "".join(
        f'[[wall]]\nname = "{name}"\nstart = {a}\nend = {b}\ninside = "left"\nthickness = 0.3\nmaterial = "plaster"\n'
        for name, a, b in zip(("right", "end", "left", "start"), corners, corners[1:] + corners[:1], strict=True)
    )
    text = CORNER.replace("albedo = 0.7", f"albedo = {albedo}").replace("corner", "box")
    return f"{text}{walls}{end}\n[routes]\nforward = [[0.5, 0], [{length - 0.5}, 0]]\n"


@pytest.fixture
def small() -> Callable[..., str]:
    """Return the text of a short corridor, with ``top`` and ``end`` put in."""

    def text(top: str = "", end: str = "") -> str:
        return SMALL.format(top=top, end=end)

    return text


@pytest.fixture(scope="session")
def hallway() -> World:
    return build_world(load_plan("hallway"), light_named("18:00"), seed=0)


@pytest.fixture(scope="session")
def hallway_model(hallway: World) -> mujoco.MjModel:
    return hallway.spec.compile()
