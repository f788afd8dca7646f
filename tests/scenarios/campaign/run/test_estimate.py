"""What is told of a scenario before it is run: how much of it is kept, and how the guess goes with what is left."""

from pathlib import Path

import pytest

from refseq_bench.scenarios.campaign.declare.case import Case
from refseq_bench.scenarios.campaign.declare.cases import load
from refseq_bench.scenarios.campaign.run.case_tasks import answer_tasks
from refseq_bench.scenarios.campaign.run.estimate import METRE, rest_of
from refseq_bench.scenarios.campaign.run.tasks import distinct
from refseq_bench.scenarios.campaign.store.cache import RECORDING, Store
from refseq_bench.sim.rendering.renderer import RendererKind

FILE = """
title = "T"
seeds = [1, 2]
[reference]
world = "annex"
renderer = "none"
end = 8.0
[query]
light = "18:00"
[localise]
methods = ["vlad", "topometric", "seqslam"]
judged = "vlad"
[vary.grid]
"query.start" = [0.0, 4.0]
"""


@pytest.fixture
def cases(tmp_path: Path) -> list[Case]:
    (tmp_path / "mine.toml").write_text(FILE)
    return load(tmp_path / "mine.toml")


def keep(store: Store, key: str) -> None:
    """Put a whole file there, of nothing."""
    magic = b"\x89MCAP0\r\n"
    store.make(key, RECORDING, lambda path: path.write_bytes(magic + bytes(100) + magic))


def test_what_cases_share_is_counted_once(cases: list[Case], tmp_path: Path) -> None:
    store = Store(tmp_path / "store")
    one, both = rest_of(cases[:1], store), rest_of(cases, store)
    # Two seeds: a map and a query each; VLAD's methods are asked together.
    assert (one.recordings, one.answers, one.recordings_kept, one.answers_kept) == (4, 4, 0, 0)
    assert (both.recordings, both.answers) == (6, 8)
    assert one.seconds < both.seconds < 2 * one.seconds


def test_what_is_kept_takes_no_time(cases: list[Case], tmp_path: Path) -> None:
    store = Store(tmp_path / "store")
    before = rest_of(cases[:1], store)
    drive = distinct(next(iter(answer_tasks(cases[0]).values())))[0]
    keep(store, drive.key)
    after = rest_of(cases[:1], store)
    assert (after.recordings_kept, after.answers_kept) == (1, 0)
    assert before.seconds - after.seconds == pytest.approx(8.0 * METRE[RendererKind.NONE])
    assert after.summary.startswith("kept: 1 of 4 drives, 0 of 4 answers; the rest: about ")


def test_what_is_not_on_this_machine_is_told_and_not_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("REFSEQ_RECORDINGS", str(tmp_path))
    (tmp_path / "real.toml").write_text('title = "T"\n[reference]\nlog = "no.log"\n[query]\n')
    rest = rest_of(load(tmp_path / "real.toml"), Store(tmp_path / "store"))
    assert (rest.recordings, rest.answers, rest.seconds) == (0, 0, 0.0)
    assert "; skipped here: " in rest.summary
    assert "no.log" in rest.summary
