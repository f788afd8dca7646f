"""``refseq map merge`` and ``map plan`` of a path that comes back to itself, and a person's word about that."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from refseq.atlas.decision import Decision
from refseq.map.learning import learn
from refseq.map.map import Map
from refseq.map.profile import BEST
from refseq.view import View
from refseq_bench.scenarios.maps.joins import BY_A_PERSON, write_decisions
from tests.scenarios.conftest import Refseq
from tests.support import corridor_drive

ROUND, AGAIN = 40, 12
"""Views of a way round, and of those how many are passed again."""


def ring() -> list[View]:
    """A way round by its odometry, 34 m long, and on past its first views; what is seen there is the same."""
    once = corridor_drive(np.random.default_rng(1), count=ROUND, spacing=0.85, size=96)
    views = [*once, *once[:AGAIN]]
    turn = 2 * math.pi / ROUND
    return [replace(view, time=2.0 * n, distance=0.85 * bool(n), turn=turn * bool(n)) for n, view in enumerate(views)]


@pytest.fixture(scope="module")
def looped(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("looped")
    views = ring()
    learn(views, profile=BEST).save(folder / "ring.refseq")
    learn(views[:30], profile=BEST).save(folder / "open.refseq")
    return folder


@pytest.fixture
def here(looped: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(looped)
    return looped


def test_a_path_alone_is_joined_with_itself_and_has_a_plan(refseq: Refseq, here: Path) -> None:
    assert refseq("map", "plan", "ring.refseq").code == 2
    answer = refseq("map", "merge", "ring.refseq", "-o", "closed.refseq", "--page", "loops.html")
    assert (answer.code, answer.err) == (0, "")
    assert answer.out.splitlines()[-1].endswith(
        "closed.refseq: 1 path, 52 places of 52, 0 links, 1 of 1 stretch joined"
    )
    pairs = Map.load(here / "closed.refseq").paths[0].loops
    assert np.abs(pairs[:, 1] - pairs[:, 0] - ROUND).max() <= 1
    assert len(pairs) >= AGAIN - 2
    (first, again), (last, until) = pairs[[0, -1]].tolist()
    told = refseq("map", "plan", "closed.refseq").out
    assert f"ring comes back to itself: views {again} to {until} are at {first} to {last}" in told
    found = json.loads(refseq("map", "plan", "closed.refseq", "--json").out)["loops"]
    assert found == [{"path": "ring", "first": [first, last], "second": [again, until]}]
    page = (here / "loops.html").read_text()
    assert page.count('<section class="join"') == 1


def test_a_path_without_loops_is_told_to_have_no_plan(refseq: Refseq, here: Path) -> None:
    assert refseq("map", "merge", "open.refseq", "-o", "same.refseq").code == 0
    answer = refseq("map", "plan", "same.refseq")
    assert (answer.code, answer.out) == (2, "")
    assert "and none comes back to itself, so that they have no plan" in answer.err


@pytest.mark.slow
def test_a_persons_word_about_a_loop_survives_a_later_merge(refseq: Refseq, here: Path) -> None:
    no = Decision("ring", "ring", (0, 11), (40, 51), (0.0, 0.0), False, BY_A_PERSON)
    write_decisions(here / "no.toml", [no])
    assert refseq("map", "merge", "ring.refseq", "-o", "refused.refseq", "--decisions", "no.toml").code == 0
    assert refseq("map", "merge", "refused.refseq", "-o", "again.refseq", "--page", "again.html").code == 0
    assert not len(Map.load(here / "again.refseq").loops)
    page = (here / "again.html").read_text()
    assert "Where the path&#39;s odometry alone puts it." in page
    write_decisions(here / "wrong.toml", [replace(no, second=(8, 51))])
    answer = refseq("map", "merge", "ring.refseq", "-o", "none.refseq", "--decisions", "wrong.toml")
    assert (answer.code, answer.out, len(answer.err.splitlines())) == (2, "", 1)
    assert (
        "ring 0-11 = ring 8-51 is one path that comes back to itself; valid is an earlier stretch, then" in answer.err
    )
    assert not (here / "none.refseq").exists()


def test_similarity_of_two_maps_tells_what_they_share_and_no_loop(refseq: Refseq, here: Path) -> None:
    found = json.loads(refseq("map", "similarity", "open.refseq", "ring.refseq", "--json").out)
    assert found
    assert all(one["one"] != one["other"] for one in found)
