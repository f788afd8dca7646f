"""Two rooms with an open door between them, in a few forms."""

from refseq_bench.sim.errors import SimError
from refseq_bench.worlds.plans.load import parse_plan
from refseq_bench.worlds.plans.schema import FloorPlan

FORMS = tuple((angle, hinge) for angle in (85, 95, 105) for hinge in ("start", "end"))
"""Opening of the door [deg] and the side on which its leaf hangs: what leaves the Robuter room enough, by choice."""

ROOMS = """
name = "rooms-{form}"
wall = [
  {{ name = "front", start = [0, -2], end = [0, 2], inside = "left", material = "plaster" }},
  {{ name = "left", start = [0, 2], end = [-4, 2], inside = "left", material = "plaster" }},
  {{ name = "back", start = [-4, 2], end = [-4, -2], inside = "left", material = "plaster" }},
  {{ name = "right", start = [-4, -2], end = [0, -2], inside = "left", material = "plaster" }},
  {{ name = "far", start = [4.5, 2], end = [4.5, -2], inside = "right", material = "plaster" }},
]
[[door]]
name = "door"
wall = "front"
at = 2
depth = 3.5
open = {angle}
hinge = "{hinge}"
[place]
latitude = 40.63
longitude = -8.66
timezone = "Europe/Lisbon"
date = 2008-03-20
x_azimuth = 110
[floor]
material = "carpet"
[ceiling]
height = 2.8
material = "plaster"
[[lamp]]
name = "room"
first = [-2.0, 0.0]
step = [0.0, 1.0]
count = 1
lumen = 3000
switch = "always"
[[lamp]]
name = "beyond"
first = [2.0, 0.0]
step = [0.0, 1.0]
count = 1
lumen = 3000
switch = "always"
[material]
plaster = {{ albedo = 0.7, roughness = 0.9 }}
carpet = {{ albedo = 0.25, roughness = 0.95 }}
door = {{ albedo = 0.3, roughness = 0.5 }}
[routes]
forward = [[-1.7, 0], [0, 0]]
"""


def two_rooms(form: int) -> FloorPlan:
    """A room of 4 m by 4 m and behind its door another one, 3.5 m deep; ``form`` is one of ``FORMS`` by its number."""
    if not 0 <= form < len(FORMS):
        raise SimError(f"world 'rooms:{form}' is unknown; valid are rooms:0 to rooms:{len(FORMS) - 1}")
    angle, hinge = FORMS[form]
    return parse_plan(ROOMS.format(form=form, angle=angle, hinge=hinge), f"rooms:{form}")
