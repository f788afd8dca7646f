from dataclasses import replace

import numpy as np
import pytest

from refseq.belief import Stage
from refseq.errors import MapError
from refseq.logs import Recording
from refseq.map.learning import learn
from refseq.map.map import Map
from refseq.view import View
from refseq_bench.scenarios.datasets.ground_truth import PictureTruth, ground_truth
from refseq_bench.scenarios.drives.evaluate import compare, places_as_views, results
from refseq_bench.scenarios.scoring.comparison import Comparison
from refseq_bench.scenarios.scoring.figures import figures
from refseq_bench.scenarios.scoring.path_geometry import NARROW, WIDE
from tests.support import beliefs_with_errors, certain, corridor_comparison, corridor_drive


@pytest.fixture(scope="module")
def drive() -> list[View]:
    return corridor_drive(np.random.default_rng(0), count=12, size=48)


@pytest.fixture(scope="module")
def laser_map(drive: list[View]) -> Map:
    return learn(drive, sensors=("laser",), features=("walls", "sectors"), metadata={"light": "16:00"})


def without_scan(views: list[View]) -> Recording:
    return Recording(tuple(replace(view, scan=None) for view in views))


def test_a_drive_without_any_of_the_maps_sensors_is_told(laser_map: Map, drive: list[View]) -> None:
    with pytest.raises(
        MapError,
        match=r"^a ← b: the drive's sensors \(forward, lateral\) have none in common with the map's; valid are laser, "
        r"or the drive's by those names \(--topics NAME=TOPIC\)$",
    ):
        compare("a ← b", laser_map, without_scan(drive))


def test_a_sensor_that_the_map_lacks_is_told_as_such(laser_map: Map, drive: list[View]) -> None:
    with pytest.raises(MapError, match=r"^sensor 'forward' is not in the map; valid are laser$"):
        compare("a ← b", laser_map, Recording(tuple(drive)), sensors=("forward",))


def test_a_wanted_sensor_that_the_drive_lacks_is_told(drive: list[View]) -> None:
    sequence = learn(drive, features=("sift", "sectors"))
    with pytest.raises(
        MapError, match=r"sensors \(forward, lateral\) have none in common with .* valid are laser, or the"
    ):
        compare("a ← b", sequence, without_scan(drive), sensors=("laser",))


def test_a_drive_is_localised_at_the_stages_asked_for(laser_map: Map, drive: list[View]) -> None:
    query = Recording(tuple(drive), {"light": "18:00"})
    found = compare("a ← b", laser_map, query, stages=(Stage.CHAIN, Stage.UNIFORM))
    assert set(found.beliefs) == {Stage.UNIFORM, Stage.CHAIN}
    assert all(len(beliefs) == len(drive) for beliefs in found.beliefs.values())
    assert found.reference_metadata["light"] == "16:00"
    assert found.query_metadata["light"] == "18:00"
    assert len(found.reference_views) == len(laser_map)
    assert not any(view.sensors for view in found.reference_views)


def test_places_stand_where_the_map_has_them(laser_map: Map) -> None:
    views = places_as_views(laser_map)
    assert tuple(view.truth for view in views) == laser_map.poses
    assert np.cumsum([view.distance for view in views]) == pytest.approx(laser_map.sequence.along)


def test_results_pool_the_views_of_all_seeds_and_say_how_often_lost() -> None:
    seeds = [corridor_comparison(seed, count=40, size=24) for seed in range(3)]
    alone = [results([one]) for one in seeds]
    pooled = results(seeds)
    assert [result.stage for result in pooled] == list(Stage)
    for index, result in enumerate(pooled):
        assert set(result.success) == {WIDE, NARROW}
        for tolerance, share in result.success.items():
            assert share.trials == sum(one[index].success[tolerance].trials for one in alone)
            total = sum(one[index].success[tolerance].value * one[index].success[tolerance].trials for one in alone)
            assert share.value * share.trials == pytest.approx(total)
        assert result.lost == sum(belief.lost > 0.5 for one in seeds for belief in one.beliefs[result.stage])
        assert result.failures == sum(one[index].failures for one in alone)
    assert pooled[0].lost > 0


def test_a_stage_that_one_comparison_lacks_has_no_result() -> None:
    rng = np.random.default_rng(0)
    full = corridor_comparison(0, count=20, size=24)
    part = replace(full, beliefs={Stage.PRIOR: beliefs_with_errors(rng, 20, 20, 0.1, 1.0)})
    assert [result.stage for result in results([full, part])] == [Stage.PRIOR]


def test_tolerances_in_pictures_hold_for_what_needs_no_truth_too() -> None:
    """Stages that mean places up to four pictures apart agree within five, as ``compare`` says of the same answers."""
    views = [View(float(number), distance=float(number > 0)) for number in range(20)]
    answers = {
        Stage.UNIFORM: [certain(20, min(19, number + 4 * (number % 2))) for number in range(20)],
        Stage.CHAIN: [certain(20, number) for number in range(20)],
    }
    truth = PictureTruth(ground_truth("frame±5"))
    comparison = truth.judging(Comparison("pictures", views, {}, views, {}, answers))
    for result, figure in zip(
        results([comparison], truth.tolerances), figures([comparison], *truth.tolerances), strict=True
    ):
        assert result.consistency == figure.consistency
        assert result.consistency.agreement.value == 1.0
        assert result.consistency.jumps.successes == 0
