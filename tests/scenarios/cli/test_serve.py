"""``refseq serve``: what is typed reaches the server, and what is wrong is told before it listens."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from refseq.access.policy import AccessPolicy
from refseq.belief import Stage
from refseq.map.learning import learn
from refseq.map.map import Map
from refseq.serve.session import ServeOptions
from tests.scenarios.conftest import Refseq
from tests.support import corridor_drive

ADDRESS = "ws://127.0.0.1:1/token"


class Server:
    """A server that serves a drive as soon as it listens."""

    made: list["Server"]

    def __init__(self, map_: Map, options: ServeOptions, access: AccessPolicy, told: Callable[[str], None]) -> None:
        self.map, self.options, self.access, self.told = map_, options, access, told
        self.views = self.drives = 0
        self.made.append(self)

    async def run(self, opened: Callable[[str], None]) -> None:
        opened(ADDRESS)
        self.told("a drive begins")
        self.views, self.drives = 12, 1


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[Server]:
    """Servers that commands make, in a folder with a map."""
    Server.made = []
    monkeypatch.setattr("refseq.serve.server.BeliefServer", Server)
    monkeypatch.delenv("REFSEQ_TOKEN", raising=False)
    monkeypatch.chdir(tmp_path)
    learn(corridor_drive(np.random.default_rng(0), 3, size=96), sensors=["laser"]).save(Path("map.refseq"))
    return Server.made


def test_without_options_it_is_open_to_this_machine_with_a_token_of_chance(refseq: Refseq, made: list[Server]) -> None:
    answer = refseq("serve", "map.refseq")
    assert (answer.code, answer.err) == (0, "a drive begins\n")
    assert answer.out.splitlines() == [
        f"map.refseq: serves at {ADDRESS}; Ctrl-C ends it",
        "map.refseq: served 12 views of 1 drive",
    ]
    refseq("serve", "map.refseq")
    one, other = made
    assert one.options == ServeOptions()
    assert (one.access.host, one.access.port) == ("127.0.0.1", 8765)
    assert len(one.access.token) == 32
    assert one.access.token != other.access.token
    assert len(one.map) == 3


def test_all_that_is_typed_arrives(refseq: Refseq, made: list[Server]) -> None:
    words = ["--stage", "prior", "--sensors", "laser", "--seed", "4", "--distance", "0.5", "--leading", "laser"]
    words += ["--topics", "laser=/scan,camera-1=/front/image_raw", "--odometry-topic", "/odom", "--tolerance", "0.1"]
    words += ["--host", "0.0.0.0", "--port", "0", "--token", "3f9ab27c0d1e4856", "--origin", "https://example.org"]
    assert refseq("serve", "map.refseq", *words).code == 0
    (server,) = made
    assert server.options == ServeOptions(
        stage=Stage.PRIOR,
        sensors=("laser",),
        seed=4,
        distance=0.5,
        names={"/scan": "laser", "/front/image_raw": "camera-1"},
        odometry="/odom",
        leading="laser",
        tolerance=0.1,
    )
    access = server.access
    assert (access.host, access.port, access.token) == ("0.0.0.0", 0, "3f9ab27c0d1e4856")
    assert access.origins == ("https://example.org",)


def test_the_token_may_come_from_the_environment(
    refseq: Refseq, made: list[Server], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("REFSEQ_TOKEN", "a" * 20)
    assert refseq("serve", "map.refseq", "--host", "0.0.0.0").code == 0
    assert made[0].access.token == "a" * 20


@pytest.mark.parametrize(
    "words",
    [
        ["--host", "0.0.0.0"],  # to all the world without a token
        ["--token", "short"],
        ["--port", "65536"],
        ["--distance", "-1"],
        ["--stage", "best"],
        ["--topics", "laser"],
        ["--origin", "not an origin"],
    ],
)
def test_what_is_wrong_is_told_in_a_line_and_nobody_is_served(
    refseq: Refseq, made: list[Server], words: list[str]
) -> None:
    answer: Any = refseq("serve", "map.refseq", *words)
    assert answer.code == 2
    assert answer.out == ""
    assert len(answer.err.splitlines()) == 1, answer.err
    assert made == []
