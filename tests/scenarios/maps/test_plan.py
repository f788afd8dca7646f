"""Plan of a merged map without truth, and its error, against a drive whose truth is known."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from refseq.atlas.merge import merge_maps
from refseq.atlas.overlap import OverlapSettings
from refseq.map.learning import learn
from refseq.map.map import Map, MapFrame, beside
from refseq.map.profile import BEST
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.maps.drawings.plan import draw_plan
from refseq_bench.scenarios.maps.plan import aligned, check_plan, plan_error
from tests.refseq.rooms import named_maps
from tests.support import corridor_drive


@pytest.fixture(scope="module")
def halves() -> list[Map]:
    drive = corridor_drive(np.random.default_rng(1), count=30, size=96)
    return named_maps(["first", "second"], [learn(drive[:20], profile=BEST), learn(drive[10:], profile=BEST)])


@pytest.fixture(scope="module")
def joined(halves: list[Map]) -> Map:
    return merge_maps(halves, OverlapSettings(alone=0, clear=0)).map


def without_truth(map_: Map) -> Map:
    blind = tuple(replace(one, poses=(None,) * len(one)) for one in map_.sequences)
    return replace(map_, sequences=blind)


def test_points_that_were_turned_and_shifted_are_laid_back() -> None:
    points = np.random.default_rng(1).normal(size=(20, 2))
    turn = np.array([[math.cos(2), math.sin(2)], [-math.sin(2), math.cos(2)]])
    assert aligned(points @ turn + [3, -4], points) == pytest.approx(points)
    mirrored = points * [1, -1]
    assert np.abs(aligned(mirrored, points) - points).max() > 0.5  # rigid: not mirrored


def test_joined_paths_lie_in_one_frame_that_the_file_keeps(joined: Map, tmp_path: Path) -> None:
    without_truth(joined).save(tmp_path / "whole.refseq")
    loaded = Map.load(tmp_path / "whole.refseq")
    assert loaded.frame is MapFrame.JOINED
    assert loaded.places_in_frame == joined.joined_poses
    assert None not in loaded.places_in_frame
    assert joined.frame is MapFrame.TRUTH
    assert plan_error(loaded) is None


def test_the_error_is_that_of_what_the_paths_share(joined: Map) -> None:
    """Odometry without errors: what is left are views of the halves that were put together a place off at most."""
    found = plan_error(joined)
    assert found is not None
    assert found.places == len(joined)
    assert found.rmse <= found.worst < 1.0
    assert found.share == pytest.approx(found.rmse / sum(path.length for path in joined.paths))


def test_the_plan_is_a_picture(joined: Map, tmp_path: Path) -> None:
    draw_plan(tmp_path / "plan.png", joined)
    assert (tmp_path / "plan.png").read_bytes().startswith(b"\x89PNG")


def test_paths_that_are_not_joined_have_no_plan(halves: list[Map]) -> None:
    with pytest.raises(ScenarioError, match=r"^apart\.refseq: no two of its paths are joined with odometry"):
        check_plan(beside(halves), Path("apart.refseq"))
