"""The render mode 'human': what the viewer is shown is what the environment tells, and nothing stays behind."""

import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path
from urllib.request import urlopen

import gymnasium as gym
import numpy as np
import pytest

import refseq_bench.sim.envs  # noqa: F401 - registers the ids
from refseq.viewer import recording
from refseq_bench.sim.envs import display
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.rendering.drivers import gl_backend
from tests.refseq.viewer.readback import rows, values

NAME = "refseq/CrossDoorTwist-v0"
needs_gl = pytest.mark.skipif(gl_backend() is None, reason="no OpenGL")


@needs_gl
def test_each_step_is_shown_as_it_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "shown.rrd"

    @contextmanager
    def to_file(port: int, name: str, batches: object):
        with recording.saved(file, name) as stream:
            yield stream, "http://here"

    monkeypatch.setattr(display, "served", to_file)
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    env = gym.make(NAME, render_mode="human", renderer="classic")
    told, rewards = [], []
    for seed in (1, 2):
        _, info = env.reset(seed=seed)
        told.append(info)
        rewards.append(0.0)
        for _ in range(3):
            _, reward, _, _, info = env.step(np.array([0.5, 0.1], np.float32))
            told.append(info)
            rewards.append(reward)
        assert env.render() is None
    env.close()
    remaining = [value[0] for value in values(file, "/score/remaining", "Scalars:scalars", "step")]
    assert remaining == pytest.approx([info["distance_to_goal"] for info in told])
    returns = [value[0] for value in values(file, "/score/return", "Scalars:scalars", "step")]
    assert returns == pytest.approx([*np.cumsum(rewards[:4]), *np.cumsum(rewards[4:])])
    trails = [np.array(value[0]) for value in values(file, "/plan/trail", "LineStrips2D:strips", "step")]
    ends = [trail[-1] * (1, -1) for trail in trails]
    assert ends == pytest.approx(np.array([info["pose"][:2] for info in told]), abs=1e-5)
    assert len(trails[4]) == 1
    moments = [moment.total_seconds() for moment, _ in rows(file, "/robot/picture", "EncodedImage:blob", "time")]
    assert len(moments) == len(told)
    assert moments[3] == pytest.approx(told[3]["time"])
    assert moments == sorted(moments)


SCRIPT = f"""
import sys, urllib.request
import gymnasium as gym, refseq_bench.sim.envs
env = gym.make("{NAME}", render_mode="human", renderer="classic")
env.reset(seed=1)
page = sys.stdin.readline().strip()
keeping = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
print(keeping.open(page).status)
"""


@needs_gl
def test_without_a_display_a_page_is_told_of_in_one_line_and_ends_with_the_program(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, "-c", SCRIPT], stdin=pipe, stdout=pipe, stderr=pipe, text=True) as program:
        assert program.stderr is not None
        line = program.stderr.readline()
        assert line.startswith(f"{NAME}: no display here; open http://127.0.0.1:")
        assert line.endswith(" in a browser of this machine\n")
        page = line.split("open ")[1].split(" in a")[0]
        said, complaints = program.communicate(f"{page}\n")
    assert (said, complaints, program.returncode) == ("200\n", "", 0)
    with pytest.raises(OSError, match="refused"):
        urlopen(page)


def test_a_batch_has_no_window() -> None:
    with pytest.raises(
        SimError, match=r"^render mode 'human' is not valid for a batch of robots; valid is 'rgb_array'"
    ):
        gym.make_vec(NAME, 2, render_mode="human")
