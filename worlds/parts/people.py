"""People: who stands is part of the world, who walks is led by its clock.

Everyone is made of five solid geoms, ``person:<name>`` for the trunk, ``person:<name>:left-leg`` and so on. Those of a
person who walks have mocap bodies of the same names: they go where they are put, whatever is in the way.
"""

import math
from functools import partial

import mujoco
import numpy as np
from numpy.random import Generator

from refseq_bench.worlds.arrays import Floats
from refseq_bench.worlds.parts.facets import add_mesh
from refseq_bench.worlds.parts.figure import HEIGHT, HIP, PARTS, BodyPart, clothes, skin
from refseq_bench.worlds.parts.site import Draw, Site
from refseq_bench.worlds.parts.walk import STEP, Stance, Walk
from refseq_bench.worlds.plans.schema import FloorPlan, Material, Person

STRIDE = math.asin(STEP / 2 / HIP)
"""Angle of a leg from upright in the middle of a step [rad]."""
SINK = 0.5 * HIP * (1.0 - math.cos(STRIDE))
"""So much lower are the hips then [m]: half of what straight legs would need; the figure has no knees and toes to bend,
which make up for the rest."""
ARM_SWAY = -0.02, 0.14
"""Least and greatest angle of the arms of somebody who stands, backwards [rad]: hands keep within ``PERSON_RADIUS``."""
PIVOTS = [part.pivot for part in PARTS]
SWINGS = [part.swing * STRIDE for part in PARTS]

Placed = tuple[tuple[float, float, float], tuple[float, float, float, float]]
"""Position [m] and rotation (w x y z) of a body."""


def place_people(site: Site, plan: FloorPlan) -> None:
    """Put everybody where they are when the clock starts."""
    for person in plan.person:
        _place(site, person)


def _place(site: Site, person: Person) -> None:
    key = f"person:{person.name}"
    draw, swings = (_walking if person.walk else _standing)(person, site.rng(key))
    material = site.picture(key, draw, Material(albedo=person.albedo, roughness=0.9))
    posture = _posture(_first_stance(person), person.height / HEIGHT, swings.tolist(), 0.0)
    for part, (pos, quat) in zip(PARTS, posture, strict=True):
        name = add_mesh(site, _name(person, part), skin(part, person.height))
        if person.walk:
            body = site.spec.worldbody.add_body(name=name, pos=pos, quat=quat, mocap=True)
            site.meshed(name, name, material, body=body)
        else:
            site.meshed(name, name, material, pos=pos, quat=quat)


def _walking(person: Person, rng: Generator) -> tuple[Draw, Floats]:
    """The picture of somebody who walks, painted where it is wanted, and their arms, which hang straight down."""
    return partial(clothes, person.albedo, rng), np.zeros(len(PARTS))


def _standing(person: Person, rng: Generator) -> tuple[Draw, Floats]:
    """The picture of somebody who stands, and how their arms hang [rad], which is drawn after it."""
    image = clothes(person.albedo, rng)
    return lambda: image, rng.uniform(*ARM_SWAY, len(PARTS)) * ["arm" in part.name for part in PARTS]


def _first_stance(person: Person) -> Stance:
    return Walk.of(person).pose(0.0) if person.walk else Stance(*person.at, math.radians(person.heading), 0.0)


def _name(person: Person, part: BodyPart) -> str:
    return f"person:{person.name}" + ("" if part is PARTS[0] else f":{part.name}")


def _posture(stance: Stance, scale: float, swings: list[float], sink: float) -> list[Placed]:
    """Return where the parts are that have swung by angles [rad], of somebody whose hips are ``sink`` [m] too low."""
    x, y, heading, _ = stance
    cos, sin = scale * math.cos(heading), scale * math.sin(heading)
    w, z = math.cos(heading / 2), math.sin(heading / 2)
    placed = []
    for (aside, up), swing in zip(PIVOTS, swings, strict=True):
        c, s = math.cos(swing / 2), math.sin(swing / 2)
        # The rotation is the one about the vertical after the one about the line across.
        placed.append(((x - aside * sin, y + aside * cos, up * scale - sink), (w * c, -z * s, w * s, z * c)))
    return placed


class Crowd:
    """All who walk in a compiled world; tell it the time and they are where they are then.

    Raises ``KeyError`` where the model has no such people.
    """

    def __init__(self, model: mujoco.MjModel, plan: FloorPlan) -> None:
        walkers = [person for person in plan.person if person.walk]
        self._walks = [(Walk.of(person), person.height / HEIGHT) for person in walkers]
        bodies = [model.body(_name(person, part)).id for person in walkers for part in PARTS]
        self._mocap = model.body_mocapid[bodies]

    def at(self, data: mujoco.MjData, time: float) -> None:
        """Put everybody where they are at ``time`` [s]; what touches them notices at the next step."""
        if not self._walks:
            return
        placed = [one for walk, scale in self._walks for one in _striding(walk.pose(time), scale)]
        data.mocap_pos[self._mocap] = [pos for pos, _ in placed]
        data.mocap_quat[self._mocap] = [quat for _, quat in placed]


def _striding(stance: Stance, scale: float) -> list[Placed]:
    """Return where the parts are of somebody who makes steps: left and right forward in turn, arms against the legs."""
    step = math.sin(math.pi * stance.steps)
    return _posture(stance, scale, [swing * step for swing in SWINGS], SINK * scale * step * step)
