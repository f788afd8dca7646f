import numpy as np
import pytest

from refseq.logs import RecordingWriter, ViewPlan, open_log, plan_views
from refseq.planar import Pose
from refseq.view import View
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.log_tools.rewriting.cutting import (
    by_distance,
    by_time,
    by_views,
    logged_span,
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
    span = logged_span(plan, by_views(plan, "10:20"))
    assert (span.first / 1e9, span.last / 1e9) == pytest.approx((105.0, 109.5), abs=1e-6)
