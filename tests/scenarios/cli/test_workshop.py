"""``refseq demo`` judges all that it was asked to drive."""

from collections.abc import Sequence
from itertools import permutations
from pathlib import Path
from types import SimpleNamespace

import pytest

from refseq_bench.scenarios.scoring.proportion import Proportion
from tests.scenarios.conftest import Refseq

RIGHT = {"noon": 95, "18:00": 99, "late-evening": 10}
"""Right answers of 100 in each light."""


@pytest.fixture
def driven(monkeypatch: pytest.MonkeyPatch) -> None:
    """A demo of which the drives are done: each light is as right as ``RIGHT``."""
    scenarios = "refseq_bench.scenarios"

    def compared(demo: SimpleNamespace, *_: object) -> list[SimpleNamespace]:
        return [SimpleNamespace(name=light) for light in demo.lights for _ in demo.seeds]

    def judged(same: Sequence[SimpleNamespace]) -> list[SimpleNamespace]:
        return [SimpleNamespace(success={"1.5 m": Proportion(RIGHT[same[0].name], 100)})]

    monkeypatch.setattr(f"{scenarios}.cli.demo.run_demo", compared)
    monkeypatch.setattr(f"{scenarios}.drives.evaluate.results", judged)
    monkeypatch.setattr(f"{scenarios}.cli.workshop.print_results", lambda *_: None)


@pytest.mark.usefixtures("driven")
@pytest.mark.parametrize("lights", list(permutations(RIGHT)))
@pytest.mark.parametrize(
    ("at_least", "below"), [(5, ()), (90, ("late-evening",)), (96, ("noon", "late-evening")), (100, tuple(RIGHT))]
)
def test_at_least_is_asked_of_every_light_in_any_order(
    refseq: Refseq, tmp_path: Path, lights: tuple[str, ...], at_least: int, below: tuple[str, ...]
) -> None:
    asked = [word for light in lights for word in ("--query-light", light)]
    answer = refseq("demo", "-o", tmp_path / "demo", "--runs", 2, *asked, "--at-least", at_least)
    told = [line for line in answer.err.splitlines() if "below what was asked" in line]
    assert answer.code == int(bool(below))
    assert [line.partition(": below")[0] for line in told] == [light for light in lights if light in below]


@pytest.mark.parametrize(
    "taken",
    [
        "reference.mcap", "query.mcap", "map.refseq", "beliefs.parquet", "demo.rrd", "report.html",
        "seed-2/map.refseq", "noon/beliefs.parquet", "seed-2/noon/query.mcap",
    ],
)  # fmt: skip
def test_a_folder_in_the_place_of_any_file_is_told_before_the_first_drive(
    refseq: Refseq, tmp_path: Path, taken: str
) -> None:
    (tmp_path / taken).mkdir(parents=True)
    asked = ("--query-light", "18:00", "--query-light", "noon", "--runs", 2)
    answer = refseq("demo", "-o", tmp_path, *asked)
    assert (answer.code, answer.out) == (2, "")
    assert answer.err == f"error: {tmp_path / taken}: is a folder; valid is the name of a file to write\n"
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []
