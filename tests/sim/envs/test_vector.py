"""Simulations whose physics are stepped together against the same ones each by itself, bit for bit."""

from collections.abc import Callable, Generator
from pathlib import Path

import mujoco
import numpy as np
import pytest

from refseq_bench import robots
from refseq_bench.robots import Twist
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.envs.vector import PhysicsBatch
from refseq_bench.sim.envs.worlds.named import world_named
from refseq_bench.sim.physics import Due, Physics, alone
from refseq_bench.sim.rendering.renderer import RendererKind
from tests.sim.test_physics import BALL

BLIND = BenchSettings(renderer=RendererKind.NONE, cameras=())
PERIODS = 12
Meddling = Callable[[Bench], None]


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """MuJoCo writes its warnings into a file where it runs."""
    monkeypatch.chdir(tmp_path)


def bench(world: str, seed: int, robot: str = "robuter") -> Bench:
    return Bench(world_named(world, "16:00", pictured=False), robots.load(robot), seed=seed, settings=BLIND)


def going(robot: Bench, turn: float, meddling: Meddling | None = None) -> Generator[Due, None, list[bytes]]:
    """Drive for some periods, with some meddling in the middle; returns all that the physics came to."""
    seen = []
    for period in range(PERIODS):
        if meddling is not None and period == PERIODS // 2:
            meddling(robot)
        yield from robot.driving(Twist(0.4, turn))
        data = robot.data
        parts = (data.qpos, data.qvel, data.qacc, data.xpos, data.geom_xpos, data.site_xmat, data.contact.geom)
        seen.append(b"".join(part.tobytes() for part in (*parts, np.array(data.time), data.warning.number)))
    return seen


def slip(robot: Bench) -> None:
    robot.grip("left", 0.05)


def brake(robot: Bench) -> None:
    robot.control.emergency_stop()


def push(robot: Bench) -> None:
    robot.data.xfrc_applied[robot.model.body(f"{robot.robot.name}/base").id, :3] = (0.0, 40.0, 0.0)


def carry(robot: Bench) -> None:
    robot.place(robot.pose)


def spoil(robot: Bench) -> None:
    robot.data.xfrc_applied[-1, 0] = np.nan


ALIKE = ("rooms:0", "rooms:1", "rooms:5")
MIXED = ("corridor:3", "rooms:2", "corridor:3", "corridor:10")


@pytest.mark.quick_cases(
    "worlds1-None", "worlds1-push", "worlds1-carry", "worlds0-slip", "worlds0-brake", "worlds0-spoil"
)
@pytest.mark.parametrize("meddling", [None, slip, brake, push, carry, spoil])
@pytest.mark.parametrize("worlds", [ALIKE, MIXED])
def test_together_is_as_alone(worlds: tuple[str, ...], meddling: Meddling | None) -> None:
    """One of them is meddled with; neither it nor any other notices that they are stepped together."""
    apart = [bench(world, seed) for seed, world in enumerate(worlds)]
    beside = [bench(world, seed) for seed, world in enumerate(worlds)]
    meddlings = [None, meddling, *[None] * len(worlds)]
    lone = [alone(going(robot, 0.1 * i, meddlings[i])) for i, robot in enumerate(apart)]
    joint = PhysicsBatch().run({i: going(robot, 0.1 * i, meddlings[i]) for i, robot in enumerate(beside)})
    assert [joint[i] for i in range(len(worlds))] == lone
    assert [robot.fault for robot in beside] == [robot.fault for robot in apart]
    assert (beside[1].fault is not None) == (meddling is spoil)
    assert all(np.array_equal(one.scan().ranges, two.scan().ranges) for one, two in zip(apart, beside, strict=True))


def test_meddling_makes_a_difference() -> None:
    plain, *others = [alone(going(bench("rooms:0", 0), 0.0, by)) for by in (None, slip, brake, push, carry, spoil)]
    half = PERIODS // 2
    assert all(other[:half] == plain[:half] and other[-1] != plain[-1] for other in others)


@pytest.mark.quick_cases("1", "3")
@pytest.mark.parametrize("threads", [1, 2, 3, 0])
def test_nothing_depends_on_the_threads(threads: int) -> None:
    lone = [alone(going(bench("rooms:0", i, "segway_rmp"), 0.1 * i)) for i in range(4)]
    joint = PhysicsBatch(threads).run({i: going(bench("rooms:0", i, "segway_rmp"), 0.1 * i) for i in range(4)})
    assert list(joint.values()) == lone


def test_some_may_rest_and_others_may_be_another_robot_by_now() -> None:
    """Those of later runs are known by the same numbers; one of them is new, one does not take part."""
    together = PhysicsBatch()
    beside, apart = [bench("rooms:0", i) for i in range(3)], [bench("rooms:0", i) for i in range(3)]
    together.run({i: going(robot, 0.0) for i, robot in enumerate(beside)})
    lone = [alone(going(robot, 0.0)) for robot in apart]
    beside[2], apart[2] = bench("rooms:4", 9), bench("rooms:4", 9)
    joint = together.run({i: going(beside[i], 0.2) for i in (0, 2)})
    lone = [alone(going(apart[i], 0.2)) for i in (0, 2)]
    assert list(joint.values()) == lone
    assert np.array_equal(beside[1].data.qpos, apart[1].data.qpos)


def test_who_broke_and_is_set_down_goes_on_as_alone() -> None:
    """Its warnings are forgiven, and the batch has none of its own to remember."""
    together, fates = PhysicsBatch(), (None, spoil)
    beside, apart = [[bench("rooms:0", i) for i in range(2)] for _ in range(2)]
    together.run({i: going(robot, 0.0, fates[i]) for i, robot in enumerate(beside)})
    for robot, fate in zip(apart, fates, strict=True):
        alone(going(robot, 0.0, fate))
    assert [robot.fault is None for robot in beside] == [True, False]
    for robot in (beside[1], apart[1]):
        carry(robot)
    joint = together.run({i: going(robot, 0.2) for i, robot in enumerate(beside)})
    assert list(joint.values()) == [alone(going(robot, 0.2)) for robot in apart]
    assert beside[1].fault is None


def test_those_that_are_alike_but_for_their_steps_each_take_their_own() -> None:
    def falling(steps: int) -> Generator[Due, None, tuple[float, float]]:
        model = mujoco.MjModel.from_xml_string(BALL)
        physics = Physics(model, mujoco.MjData(model))
        for _ in range(4):
            yield Due(physics, steps)
        return float(physics.data.qpos[2]), physics.data.time

    counts = (3, 5, 3)
    joint = PhysicsBatch().run({i: falling(steps) for i, steps in enumerate(counts)})
    assert list(joint.values()) == [alone(falling(steps)) for steps in counts]


def test_no_simulation_steps_by_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    runs = {i: going(bench(world, i), 0.0) for i, world in enumerate(MIXED)}

    def refused(*_: object, **__: object) -> None:
        raise AssertionError("stepped alone")

    monkeypatch.setattr(mujoco, "mj_step", refused)
    together = PhysicsBatch()
    assert len(together.run(runs)) == len(MIXED)
    assert together.groups == [(0, 2), (1,), (3,)]
    with pytest.raises(AssertionError, match="stepped alone"):
        alone(going(bench("rooms:0", 0), 0.0))
