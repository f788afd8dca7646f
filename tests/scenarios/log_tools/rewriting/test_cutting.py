import numpy as np
import pytest

from refseq.logs import RecordingWriter, ViewPlan, open_log, plan_views
from refseq.planar import Pose
from refseq.view import View
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.log_tools.rewriting.copies import copy_stretch
from refseq_bench.scenarios.log_tools.rewriting.cutting import (
    by_distance,
    by_time,
    by_views,
    log_span,
    without_standing,
)
from tests.refseq.rooms import cast, rectangle

SCAN = cast(rectangle(-5, -5, 5, 5), Pose(0, 0, 0), beams=31)


def plan_of(path, positions, *, period=0.5, start=100.0) -> ViewPlan:
    with RecordingWriter(path, {}) as writer:
        for number, x in enumerate(positions):
            writer.write(View(start + period * number, {}, SCAN), Pose(float(x), 0.0, 0.0))
    return plan_views(open_log(path))


@pytest.fixture
def plan(tmp_path):
    """Five seconds of standing, ten metres in ten seconds, five seconds of standing."""
    way = np.concatenate([np.zeros(10), np.linspace(0, 10, 21), np.full(10, 10.0)])
    return plan_of(tmp_path / "drive.mcap", way)


def test_the_standing_at_both_ends_goes_but_for_a_second(plan):
    kept = without_standing(plan)
    assert kept.first == pytest.approx(104.0, abs=0.6)
    assert kept.last == pytest.approx(116.0, abs=0.6)


def test_a_robot_that_trembles_or_waits_on_its_way_is_not_cut_there(tmp_path):
    way = np.concatenate([np.zeros(6), np.linspace(0, 4, 9), np.full(20, 4.0), np.linspace(4, 8, 9), np.full(6, 8.0)])
    rng = np.random.default_rng(0)
    kept = without_standing(plan_of(tmp_path / "waits.mcap", way + rng.normal(0, 0.002, len(way))))
    assert kept.views.stop - kept.views.start == pytest.approx(38 + 4, abs=3)


def test_a_robot_that_never_moves_is_refused(tmp_path):
    with pytest.raises(ScenarioError, match="never moves"):
        without_standing(plan_of(tmp_path / "stands.mcap", np.zeros(8)))


def test_stretches_by_views_time_and_distance(plan):
    assert by_views(plan, "10:20").views == slice(10, 20)
    assert by_time(plan, "5:7.5").views == slice(10, 16)
    assert by_distance(plan, "2:4").views == slice(14, 19)
    assert by_distance(plan, ":").views == slice(0, len(plan))


@pytest.mark.parametrize("text", ["7:5", "5", "a:b", "500:600", "-1:3", ".:.", "5:5", "nan:3", ""])
def test_what_is_no_stretch_is_told_with_what_is_valid(plan, text):
    with pytest.raises(ScenarioError, match=r"time '.*' is no stretch of it; valid is FROM:TO within 0:20\.0 s"):
        by_time(plan, text)


def test_the_times_of_logging_of_a_stretch(plan):
    span = log_span(plan, by_views(plan, "10:20"))
    assert (span.first / 1e9, span.last / 1e9) == pytest.approx((105.0, 109.5), abs=1e-6)


RANGES = "4 1.5 2.0 2.5 3.0"


def flaser(k: int) -> str:
    return f"FLASER {RANGES} {k / 10} 0 0 {k / 5} 0 0"


def rawlaser(k: int) -> str:
    return f"RAWLASER1 0 0 3 1 20 0.01 0 {RANGES} 0"


def carmen(path, scan, clock) -> ViewPlan:
    """Ten scans a second by the stamps, from 1000 s on, each after an ODOM, with a logger's clock of its own."""
    with path.open("w") as file:
        for k in range(60):
            time = 1000 + k / 10
            file.write(f"ODOM {k / 5} 0 0 0.5 0 0 {time - 0.02:.6f} host {clock(time):g}\n")
            file.write(f"{scan(k)} {time:.6f} host {clock(time):.6f}\n")
    return plan_views(open_log(path))


CLOCKS = {
    "same": lambda time: time,
    "70 s behind": lambda time: time - 70,
    "1e9 s ahead": lambda time: time + 1e9,
    "overflown": lambda time: 4.29497e9,
    "backwards": lambda time: 5000 - time,
}


@pytest.mark.parametrize("scan", [flaser, rawlaser])
@pytest.mark.parametrize("clock", CLOCKS)
@pytest.mark.parametrize(("first", "last"), [(0, 10), (20, 45), (50, 60)])
def test_a_cut_of_a_carmen_log_holds_its_views_whatever_the_loggers_clock(scan, clock, first, last, tmp_path):
    plan = carmen(tmp_path / "whole.clf", scan, CLOCKS[clock])
    kept = by_views(plan, f"{first}:{last}")
    copy_stretch(plan.source.path, tmp_path / "part.clf", log_span(plan, kept), {})
    part = plan_views(open_log(tmp_path / "part.clf"))
    assert [view.time for view in part.views] == [view.time for view in plan.views[first:last]]
    assert [view.truth for view in part.views] == [view.truth for view in plan.views[first:last]]
    assert [view.distance for view in part.views[1:]] == pytest.approx([0.2] * (last - first - 1))
    assert all(view.has_odometry for view in part.views)


def test_a_true_pose_told_before_the_cut_holds_within_it_where_there_is_odometry(tmp_path):
    lines = ["TRUEPOS 7 0 0 0 0 0 1 host 1", f"{rawlaser(0)} 1 host 1", f"{rawlaser(1)} 2 host 2"]
    told = ["ODOM 0 0 0 0 0 0 0 host 0", *lines]
    for name, text, truth in (("with", told, 7.0), ("without", lines, None)):
        (tmp_path / f"{name}.clf").write_text("\n".join([*text, ""]))
        plan = plan_views(open_log(tmp_path / f"{name}.clf"))
        target = tmp_path / f"{name}-cut.clf"
        copy_stretch(plan.source.path, target, log_span(plan, by_views(plan, "1:2")), {})
        (view,) = plan_views(open_log(target)).views
        assert view.truth == plan.views[1].truth
        assert (view.truth.x if view.truth else None) == truth
