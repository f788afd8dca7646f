"""Familiarisation by behaviours: where its views are taken, what they tell, and what becomes of it in a recording."""

import math
from itertools import pairwise
from pathlib import Path

import pytest

from refseq.logs import RecordingWriter, read_recording
from refseq_bench import robots
from refseq_bench.robots.errors import RobotsError
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.control_period import CONTROL_PERIOD
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.drives.behaviour_drive import run_and_sense
from refseq_bench.sim.drives.recorder import RecordedView
from refseq_bench.sim.drives.trigger import Trigger
from refseq_bench.sim.errors import StuckError
from refseq_bench.sim.rendering.renderer import RendererKind
from tests.sim.drives.behaving_in import BOX, corridor

BEHAVIOURS = ("MN:2.5", "MT:180", "MW:left,1,1.5")
BARRIER = BOX.format(x=5, y=0).replace("depth = 0.5", "depth = 2.2")
CLOSED = '[[door]]\nname = "d"\nwall = "left"\nat = 4.5'


def toured(
    behaviours: tuple[str, ...] = BEHAVIOURS, trigger: Trigger | None = None, things: str = "", **more: float
) -> list[RecordedView]:
    settings = BenchSettings(RendererKind.NONE, cameras=())
    with Bench(corridor(things=things), robots.load("robuter"), seed=2, settings=settings) as bench:
        return list(run_and_sense(bench, behaviours, trigger or Trigger(distance=0.5), **more))


@pytest.fixture(scope="module")
def taken() -> list[RecordedView]:
    return toured()


def test_a_view_is_taken_where_each_behaviour_begins(taken: list[RecordedView]) -> None:
    told = [one.view.behaviour for one in taken]
    assert [words for words in told if words] == list(BEHAVIOURS)
    assert told[0] == BEHAVIOURS[0]
    assert told[-1] == "", "at the end nothing begins"
    turn, wall = (taken[told.index(words)].view.truth for words in BEHAVIOURS[1:])
    assert turn is not None
    assert wall is not None
    assert turn.x == pytest.approx(4.5, abs=0.1)
    assert math.dist((turn.x, turn.y), (wall.x, wall.y)) < 0.1
    assert math.cos(wall.heading - turn.heading) < -0.99


def test_between_them_views_stand_apart_as_asked(taken: list[RecordedView]) -> None:
    gaps = [after.view.distance for _, after in pairwise(taken)]
    assert all(gap <= 0.5 + 0.5 * CONTROL_PERIOD for gap in gaps)
    assert sum(abs(gap) for gap in gaps) == pytest.approx(4.0, abs=0.15)
    assert all(one.progress <= after.progress for one, after in pairwise(taken))
    assert taken[-1].progress == pytest.approx(4.0, abs=0.25)


@pytest.mark.quick_cases("0.2")
@pytest.mark.parametrize("period", [0.04, 0.2])
def test_no_two_views_are_taken_at_once_and_all_come_back(tmp_path: Path, period: float) -> None:
    """A file tells views apart by their times; what begins where a view was due is not lost."""
    views = toured(("MN:0.4", "MT:90", "MN:0.4"), Trigger(distance=None, time=period))
    times = [one.view.time for one in views]
    assert all(before < after for before, after in pairwise(times))
    with RecordingWriter(tmp_path / "tour.mcap", {}) as writer:
        for one in views:
            writer.write(one.view, one.odometry)
    read = read_recording(tmp_path / "tour.mcap").views
    assert [view.behaviour for view in read] == [one.view.behaviour for one in views]
    assert [view.time for view in read] == pytest.approx(times, abs=1e-6)


@pytest.mark.slow
def test_a_behaviour_that_fails_is_named() -> None:
    with pytest.raises(
        StuckError, match=r"^behaviour 2, MC:left, failed after \d\.\d m: door 0\.\d+ m open of 0\.\d+ m: closed$"
    ):
        toured(("MN:1", "MC:left", "MN:1"), things=CLOSED)
    with pytest.raises(StuckError, match=r"^behaviour 1, MN:5, failed after \d\.\d m: "):
        toured(("MN:5",), things=BARRIER)


def test_it_takes_no_longer_than_it_may() -> None:
    with pytest.raises(StuckError, match=r"^behaviour 2, MT:180, failed after 1\.0 m: not done after 5 s"):
        toured(("MN:1", "MT:180", "MN:1"), timeout=5.0)


def test_the_way_to_a_failure_is_told_from_the_start_and_not_from_the_last_view() -> None:
    settings = BenchSettings(RendererKind.NONE, cameras=())
    with Bench(corridor(), robots.load("robuter"), settings=settings) as bench:
        with pytest.raises(StuckError) as caught:
            list(run_and_sense(bench, ("MN:1", "MN:20"), Trigger(distance=50.0), timeout=8.0))
        gone = math.hypot(bench.odometry.x, bench.odometry.y)
    assert gone > 2.0
    assert str(caught.value) == f"behaviour 2, MN:20, failed after {gone:.1f} m: not done after 8 s"


def test_its_time_begins_with_the_drive() -> None:
    settings = BenchSettings(RendererKind.NONE, cameras=())
    with Bench(corridor(), robots.load("robuter"), settings=settings) as bench:
        for _ in range(150):
            bench.wait()
        assert len(list(run_and_sense(bench, ("MN:0.2",), Trigger(), timeout=5.0))) == 2


@pytest.mark.parametrize("bad", ["MX:3", "MN", "MW:up,1", "MW:left,0.1", "MT:0"])
def test_all_words_are_read_before_it_moves(bad: str) -> None:
    settings = BenchSettings(RendererKind.NONE, cameras=())
    with Bench(corridor(), robots.load("robuter"), settings=settings) as bench:
        with pytest.raises(RobotsError):
            next(run_and_sense(bench, ("MN:1", bad), Trigger()))
        assert bench.time == 0.0
