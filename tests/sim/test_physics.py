"""Physics gone wrong: MuJoCo would carry all back to the beginning; here the world stands still, and says so."""

import math
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pytest

from refseq.planar import Pose
from refseq_bench import robots
from refseq_bench.robots import Cause, Twist
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.control_period import CONTROL_PERIOD
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.physics import Physics
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.worlds.build import World, build_world
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.plans.load import parse_plan
from tests.worlds.conftest import SMALL

BALL = """
<mujoco><worldbody>
  <geom type="plane" size="1 1 1"/>
  <body name="ball" pos="0 0 1"><freejoint/><geom size="0.1"/></body>
</worldbody></mujoco>
"""


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """MuJoCo writes its warnings into a file where it runs."""
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def falling() -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_string(BALL)
    return model, mujoco.MjData(model)


@pytest.fixture(scope="module")
def corridor() -> World:
    return build_world(parse_plan(SMALL.format(top="", end="")), light_named("16:00"), pictured=False)


def test_while_all_is_well_it_is_mujocos_own_step(falling: tuple[mujoco.MjModel, mujoco.MjData]) -> None:
    model, data = falling
    twin = mujoco.MjData(model)
    physics = Physics(model, data)
    for _ in range(50):
        physics.look()
        physics.step(4)
        mujoco.mj_step(model, twin, nstep=4)
    assert physics.fault is None
    assert np.array_equal(data.qpos, twin.qpos)
    assert data.time == pytest.approx(twin.time, rel=1e-12)


def test_clock_is_exact_after_hours(falling: tuple[mujoco.MjModel, mujoco.MjData]) -> None:
    """MuJoCo adds up its steps, and their rounding; here time is a whole number of steps."""
    model, data = falling
    physics, hours = Physics(model, data), 5_000_000
    step = model.opt.timestep
    data.time = hours * step
    for number in range(1, 2001):
        physics.step(5)
        assert data.time == (hours + 5 * number) * step
    assert data.time != sum([step] * 10_000, hours * step), "rounding that this test would see"


def test_what_mujoco_does_by_itself(falling: tuple[mujoco.MjModel, mujoco.MjData]) -> None:
    """Why all this: should a version of MuJoCo stop doing so, this tells."""
    model, data = falling
    mujoco.mj_step(model, data, nstep=100)
    data.qpos[0] = math.nan
    mujoco.mj_step(model, data)
    assert data.time == pytest.approx(model.opt.timestep)
    assert data.qpos[2] == pytest.approx(1.0, abs=1e-3)


def nan_position(data: mujoco.MjData) -> None:
    data.qpos[0] = math.nan


def nan_velocity(data: mujoco.MjData) -> None:
    data.qvel[2] = math.nan


def huge_force(data: mujoco.MjData) -> None:
    data.xfrc_applied[-1, 0] = 1e30


def nan_force(data: mujoco.MjData) -> None:
    data.xfrc_applied[-1, 0] = math.nan


wrongs = pytest.mark.parametrize("wrong", [nan_position, nan_velocity, huge_force, nan_force])


@wrongs
def test_after_a_bad_state_all_stands_where_it_last_was_good_and_time_goes_on(
    falling: tuple[mujoco.MjModel, mujoco.MjData], wrong: Callable[[mujoco.MjData], None]
) -> None:
    model, data = falling
    physics = Physics(model, data)
    for _ in range(50):
        physics.look()
        physics.step(4)
    time, height = data.time, float(data.qpos[2])
    wrong(data)
    for _ in range(50):
        physics.look()
        physics.step(4)
    assert physics.fault is not None
    assert "\n" not in physics.fault
    assert data.time == pytest.approx(2 * time, abs=1e-9)
    assert data.qpos[2] == pytest.approx(height, abs=4 * 4.5 * model.opt.timestep)  # a tick's fall
    assert np.isfinite(data.qpos).all()
    assert not data.qvel.any()


def test_a_state_that_is_no_state_is_no_beginning(falling: tuple[mujoco.MjModel, mujoco.MjData]) -> None:
    model, data = falling
    data.qpos[0] = math.inf
    with pytest.raises(SimError, match=r"^physics: positions and velocities must be finite$"):
        Physics(model, data)


@wrongs
def test_a_robot_in_a_world_that_broke_says_so_and_is_not_carried_away(
    corridor: World, wrong: Callable[[mujoco.MjData], None]
) -> None:
    with Bench(corridor, robots.load("robuter"), settings=BenchSettings(renderer=RendererKind.NONE)) as bench:
        for _ in range(75):
            bench.drive(Twist(0.4, 0.0))
        assert bench.fault is None
        time, pose = bench.time, bench.pose
        wrong(bench.data)
        for _ in range(25):
            bench.drive(Twist(0.4, 0.0))
        assert bench.fault is not None
        assert bench.time == pytest.approx(time + 25 * CONTROL_PERIOD)
        assert math.dist((bench.pose.x, bench.pose.y), (pose.x, pose.y)) < 0.02
        assert Cause.SENSOR in {stop.cause for stop in bench.state.stops}
        scan = bench.sense().scan
        assert scan is not None
        assert scan.ranges[0] == pytest.approx(1.2, abs=0.1)


def test_set_down_anew_it_can_go_on(corridor: World) -> None:
    with Bench(corridor, robots.load("robuter"), settings=BenchSettings(renderer=RendererKind.NONE)) as bench:
        nan_position(bench.data)
        bench.drive(Twist(0.4, 0.0))
        assert bench.fault is not None
        bench.place(Pose(1.0, 0.0, 0.0))
        assert bench.fault is None
        bench.control.release()
        for _ in range(50):
            bench.drive(Twist(0.4, 0.0))
        assert bench.pose.x > 1.4
        assert bench.state.free
