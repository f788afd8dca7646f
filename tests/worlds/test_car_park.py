"""The world ``car-park``: its loop, what it has, and what a laser sees there."""

import itertools
from functools import cache

import mujoco
import numpy as np
import pytest

from refseq_bench.worlds.build import build_world
from refseq_bench.worlds.check import RobotBox, check_world
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.parts.site import SOLID, TOUCHED
from refseq_bench.worlds.plans.load import load_plan
from refseq_bench.worlds.plans.schema import FloorPlan

ROBOT = RobotBox("robuter", front=0.4, back=0.75, half_width=0.4, height=0.75)


@cache
def plan() -> FloorPlan:
    return load_plan("car-park")


@cache
def compiled() -> mujoco.MjModel:
    return build_world(plan(), light_named("18:00"), pictured=False).spec.compile()


def test_it_is_a_loop_of_300_m_both_ways() -> None:
    forward = np.array(plan().routes["forward"])
    assert np.hypot(*np.diff(forward, axis=0).T).sum() == pytest.approx(300.0, abs=5.0)
    assert np.hypot(*(forward[0] - forward[-1])) < 2.0
    assert plan().routes["reverse"] == plan().routes["forward"][::-1]
    turns = np.degrees(np.diff(np.unwrap(np.arctan2(*np.diff(forward, axis=0).T[::-1]))))
    assert abs(turns).max() < 60.0
    assert turns.sum() == pytest.approx(360.0)


def test_it_has_what_makes_a_car_park() -> None:
    assert 40 <= len(plan().car) <= 70
    assert {car.kind for car in plan().car} == {"hatchback", "saloon", "van"}
    assert len({car.albedo for car in plan().car}) > 6
    assert len(plan().tree) > 20
    assert len(plan().post) > 8


def test_a_car_across_the_loop_and_one_in_a_tree_are_found() -> None:
    across, tree = plan().car[0].model_copy(update={"at": (60.0, 8.0)}), plan().tree[0]
    inside = plan().car[1].model_copy(update={"at": tree.at})
    spoilt = plan().model_copy(update={"car": (across, inside, *plan().car[2:])})
    findings = check_world(spoilt, light_named("18:00"), [ROBOT]).findings
    assert any(across.name in line and "robuter" in line for line in findings)
    assert any(inside.name in line and tree.name in line for line in findings)


def test_a_laser_has_something_to_see_all_the_way() -> None:
    model = compiled()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    groups = np.zeros(6, np.uint8)
    groups[[SOLID, TOUCHED]] = 1
    for a, b in itertools.pairwise(plan().routes["forward"]):
        for share in np.linspace(0.0, 1.0, 8, endpoint=False):
            x, y = np.add(a, share * np.subtract(b, a))
            ahead = np.arctan2(b[1] - a[1], b[0] - a[0])
            angles = ahead + np.radians(np.arange(-90, 91, 2.0))
            rays = np.stack([np.cos(angles), np.sin(angles), np.zeros(91)], axis=1)
            geoms, ranges = np.zeros(91, np.int32), np.zeros(91)
            eye = np.array([x, y, 0.35])
            mujoco.mj_multiRay(model, data, eye, rays.ravel(), groups, 1, -1, geoms, ranges, None, 91, 80.0)
            assert np.mean(ranges > 0.0) > 0.75, (x, y)
            assert np.mean((ranges > 0.0) & (ranges < 30.0)) > 0.3, (x, y)
