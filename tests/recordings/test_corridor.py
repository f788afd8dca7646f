"""Two drives down a real corridor, images only (M. Milford, IJRR 32(7), 2013).

The set has no odometry, so every view is given a distance of 1 place; a place is counted as a metre. Its images, 160 ×
120, are enlarged four times for SIFT.
"""

import csv
from pathlib import Path

import cv2
import numpy as np
import pytest

from refseq.belief import Stage
from refseq.map.learning import learn
from refseq.map.localiser import localise
from refseq.map.matcher import Matcher
from refseq.map.tracking.trackers import tracker_for
from refseq.planar import Pose
from refseq.view import View
from refseq_bench.scenarios.scoring.comparison import Comparison
from refseq_bench.scenarios.scoring.path_geometry import ReferencePath, Tolerance
from tests.recordings.asking import PROFILES, ask, print_scores, recording, scores

ALLOWED = Tolerance(2.0)
"""The ground truth allows two places to both sides of the place of the same number."""


def drive(folder: Path) -> list[View]:
    images = [cv2.imread(str(file), cv2.IMREAD_GRAYSCALE) for file in sorted(folder.iterdir())]
    enlarged = [cv2.resize(image, (640, 480), interpolation=cv2.INTER_CUBIC) for image in images if image is not None]
    return [
        View(time=float(k), images={"camera": image}, distance=float(k > 0), truth=Pose(float(k), 0.0, 0.0))
        for k, image in enumerate(enlarged)
    ]


@pytest.fixture(scope="module")
def comparison() -> Comparison:
    folder = recording("corridor")
    (found,) = ask("corridor", PROFILES, drive(folder / "ref"), [drive(folder / "query")])
    return found


@pytest.mark.slow
def test_two_places_to_both_sides_are_what_the_ground_truth_allows(comparison: Comparison) -> None:
    path = ReferencePath(comparison.reference_views)
    with (recording("corridor") / "ground_truth.csv").open() as file:
        rows = [[int(number) for number in row] for row in list(csv.reader(file))[1:]]
    assert len(rows) == len(comparison.query_views) == len(comparison.reference_views) == 111
    for query, first, last in rows:
        right = np.flatnonzero(path.within(comparison.query_views[query].truth, ALLOWED))
        assert right.tolist() == list(range(first, last + 1))


@pytest.mark.slow
def test_two_drives_down_a_corridor(comparison: Comparison) -> None:
    found = scores([comparison], ALLOWED)
    print_scores("corridor, two places to both sides", found)
    for one in found.values():
        assert one.success.trials == 111
    assert found["thesis/uniform"].recall(1).value > 0.40
    assert found["thesis/prior"].recall(1).value > 0.70
    assert found["thesis/chain"].recall(1).value > 0.70
    assert found["best/uniform"].success.value > 0.65
    assert found["best/prior"].success.value > 0.95
    assert found["best/chain"].success.value > 0.95


@pytest.mark.slow
def test_watching_the_camera_changes_no_bit_of_the_answers() -> None:
    folder = recording("corridor")
    words_alone = "best+log_ratio.geometry=0+log_ratio.usual=0"  # what else is asked is not asked of the bare matcher
    map_ = learn(drive(folder / "ref")[:40], profile=words_alone)
    query = drive(folder / "query")[:40]
    guarded = localise(map_, query, stages=[Stage.CHAIN])[Stage.CHAIN]
    matcher, tracker = Matcher(map_), tracker_for(Stage.CHAIN, map_)
    for view, belief in zip(query, guarded, strict=True):
        bare = tracker.update(matcher.match(view))
        np.testing.assert_array_equal(bare.places, belief.places)
        assert (bare.lost, bare.best, bare.path, bare.entropy) == (
            belief.lost,
            belief.best,
            belief.path,
            belief.entropy,
        )
        assert belief.faults == ()
