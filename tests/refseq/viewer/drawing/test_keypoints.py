from dataclasses import replace

import numpy as np
import pytest

from refseq.inference.matching.incidence import IncidenceMatrix
from refseq.map.learning import learn
from refseq.viewer.drawing.keypoints import Keypoints
from refseq.viewer.places import Places
from tests.support import corridor_drive


@pytest.mark.parametrize("profile", ["best", "neural"])
def test_keys_of_a_place_are_told_apart_whoever_found_them(profile: str) -> None:
    """Nearly all of a place's own picture are its words, and fewer of a picture of another place."""
    rng = np.random.default_rng(2)
    tiles = rng.integers(0, 256, (8, 12, 16), dtype=np.uint8).repeat(20, axis=1).repeat(20, axis=2)
    drive = corridor_drive(rng, count=8, size=48)
    views = [replace(view, images={"camera-1": tile}) for view, tile in zip(drive, tiles, strict=True)]
    keypoints = Keypoints(Places.of(learn(views, profile=profile)))
    assert keypoints.cameras() == {"camera-1"}
    own, other = (keypoints.marked(views[1], "camera-1", place) for place in (1, 7))
    assert own is not None
    assert other is not None
    assert len(own.matched) > 0.8 * (len(own.matched) + len(own.unmatched)) > 10
    assert len(other.matched) < 0.8 * len(own.matched)
    assert (own.matched >= -0.5).all()
    assert (own.matched <= (320, 240)).all()


def test_words_of_all_places_are_unpacked_once(monkeypatch: pytest.MonkeyPatch) -> None:
    views = corridor_drive(np.random.default_rng(2), count=4, size=96)
    keypoints, calls, columns = Keypoints(Places.of(learn(views))), list[int](), IncidenceMatrix.columns
    monkeypatch.setattr(IncidenceMatrix, "columns", lambda self: calls.append(1) or columns(self))
    for place, view in enumerate(views):
        assert keypoints.marked(view, "forward", place) is not None
    assert len(calls) == 1
