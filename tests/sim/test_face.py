"""The names that `sim` and `robots` give to programs."""

import subprocess
import sys

import gymnasium
import numpy as np
import pytest

import refseq_bench.sim.envs
from refseq_bench import robots, sim
from refseq_bench.sim.acceptance.floor import empty_floor
from refseq_bench.sim.drives.recorder import drive_and_sense, operator_for


@pytest.mark.parametrize("room", [sim, robots])
def test_every_name_is_found_and_listed(room: object) -> None:
    names = room.__all__
    assert [name for name in names if getattr(room, name) is None] == []
    assert set(names) <= set(dir(room))


def test_an_unknown_name_is_told_with_those_there_are() -> None:
    with pytest.raises(
        AttributeError, match=r"module 'refseq_bench.sim' has no attribute 'Bank'; it has Bench, .*record"
    ):
        _ = sim.Bank
    with pytest.raises(
        AttributeError, match=r"module 'refseq_bench.sim.envs' has no attribute 'Env'; it has IDS, .*RobotEnv"
    ):
        _ = refseq_bench.sim.envs.Env


def test_importing_a_room_imports_no_library() -> None:
    code = (
        "import sys; from refseq_bench import sim, robots; sys.exit('mujoco' in sys.modules or 'numpy' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_record_yields_the_views_of_the_drive_that_the_operator_leads() -> None:
    route, none = [[0.0, 0.0], [1.5, 0.0]], sim.BenchSettings(renderer=sim.RendererKind.NONE)
    seen = []
    for drive in (
        lambda bench: sim.record(bench),
        lambda bench: (one.view for one in drive_and_sense(bench, operator_for(bench, 0), sim.Trigger())),
    ):
        with sim.Bench(empty_floor(), robots.load("robuter"), route=np.array(route), settings=none) as bench:
            seen.append([(view.time, view.truth, view.scan.ranges.tolist()) for view in drive(bench)])
    assert len(seen[0]) == 2
    assert seen[0] == seen[1]


def test_environments_are_known_by_name_once_imported() -> None:
    env = gymnasium.make("refseq/FollowCorridor-v0", world="corridor:3")
    assert isinstance(env.unwrapped, refseq_bench.sim.envs.RobotEnv)
    env.close()
