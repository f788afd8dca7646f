from pathlib import Path

import numpy as np
import pytest

from refseq.logs import write_carmen
from refseq.view import View
from refseq_bench.scenarios.drives.benchmark import (
    Benchmark,
    first_view,
    kidnapped,
    pairs_of,
    query_views,
    run_benchmark,
)
from refseq_bench.scenarios.errors import ScenarioError
from tests.support import corridor_drive

LOG = Path("run.log")


def numbered(count: int) -> list[View]:
    return [View(float(number)) for number in range(count)]


def numbers(views: tuple[View, ...]) -> list[int]:
    return [int(view.time) for view in views]


@pytest.mark.parametrize(("start", "first"), [("0", 0), ("9", 9), ("40%", 4), ("45%", 4), ("0%", 0), ("99%", 9)])
def test_a_start_is_a_number_or_a_share(start: str, first: int) -> None:
    assert first_view(start, 10, LOG) == first


@pytest.mark.parametrize("start", ["10", "100%", "-1", "half", "", "1.5"])
def test_a_start_outside_the_drive_is_told(start: str) -> None:
    with pytest.raises(
        ScenarioError, match=rf"^run.log: first view '{start}' is not in it; valid are 0 to 9 and 0% to 99%$"
    ):
        first_view(start, 10, LOG)


def test_a_kidnapped_robot_goes_on_from_elsewhere() -> None:
    assert numbers(kidnapped(tuple(numbered(10)), "3:7", LOG)) == [0, 1, 2, 7, 8, 9]
    assert numbers(kidnapped(tuple(numbered(6)), "4:1", LOG)) == [0, 1, 2, 3, 1, 2, 3, 4, 5]
    assert numbers(query_views(numbered(10), Benchmark((), start="20%", kidnap="2:6"), LOG)) == [2, 3, 8, 9]


@pytest.mark.parametrize("kidnap", ["0:3", "3:10", "10:3", "3", "a:b", "3:-1"])
def test_a_kidnap_outside_the_drive_is_told(kidnap: str) -> None:
    with pytest.raises(ScenarioError, match=rf"^run.log: kidnap '{kidnap}' is not in it; valid is FROM:TO, .* to 9$"):
        kidnapped(tuple(numbered(10)), kidnap, LOG)


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("logs")
    for name in ("first.log", "later.log"):
        write_carmen(folder / name, corridor_drive(np.random.default_rng(0), 12, size=24))
    return folder / "first.log", folder / "later.log"


def test_only_the_places_asked_for_are_learnt(logs: tuple[Path, Path]) -> None:
    steps: list[str] = []
    benchmark = Benchmark(pairs_of(logs), ("thesis/uniform",), places="3:9", start="2")
    failures: list[str] = []
    [found] = run_benchmark(benchmark, steps.append, failures.append)
    assert failures == []
    assert steps == ["pair 1 of 1"]
    assert len(found.reference_views) == 6
    assert len(found.query_views) == 10
    assert {len(belief.places) for belief in found.beliefs["thesis/uniform"]} == {6}
    assert found.name == "drives of unknown light, places 3:9 learnt, from view 2 on"


def test_a_missing_file_is_told_before_the_first_step(logs: tuple[Path, Path]) -> None:
    steps: list[str] = []
    with pytest.raises(ScenarioError, match=r"none.mcap: is no file; valid is a recording"):
        run_benchmark(Benchmark(pairs_of([*logs, logs[0], Path("none.mcap")])), steps.append, steps.append)
    assert steps == []
