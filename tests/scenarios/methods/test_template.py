"""The localiser that users begin with, on a made-up corridor."""

from dataclasses import replace

import numpy as np
import pytest

from refseq.view import View
from refseq_bench.scenarios.methods.templates.my_localiser import MyLocaliser
from tests.support import corridor_drive

COUNT = 12


@pytest.fixture(scope="module")
def reference() -> list[View]:
    return list(corridor_drive(np.random.default_rng(0), COUNT, size=120))


def test_it_finds_the_views_that_it_learnt(reference: list[View]) -> None:
    localiser = MyLocaliser(reference)
    beliefs = [localiser.update(view) for view in reference]
    assert [belief.best for belief in beliefs[1:]] == list(range(1, COUNT))  # one view alone may be two places
    assert all(belief.places.sum() == pytest.approx(1) for belief in beliefs)
    assert beliefs[-1].lost < 0.1


def test_a_darker_picture_says_the_same_and_none_says_nothing(reference: list[View]) -> None:
    bright, dark = MyLocaliser(reference), MyLocaliser(reference)
    for view in reference[:6]:
        images = {name: (image // 2).astype(np.uint8) for name, image in view.images.items()}
        assert bright.update(view).best == dark.update(replace(view, images=images)).best
    blind = bright.update(replace(reference[6], images={}, scan=None))
    assert blind.best == 6  # by odometry alone
    assert blind.places.max() < dark.update(reference[6]).places.max()


def test_it_forgets(reference: list[View]) -> None:
    localiser = MyLocaliser(reference)
    first = localiser.update(reference[3]).places
    localiser.update(reference[4])
    localiser.reset()
    np.testing.assert_array_equal(localiser.update(reference[3]).places, first)
