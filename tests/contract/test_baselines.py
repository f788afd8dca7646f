"""What holds for every baseline: the same as for our own localiser."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from refseq.belief import Belief
from refseq.view import View
from refseq_bench.scenarios.methods.baselines import BASELINES
from refseq_bench.scenarios.methods.reference import Reference
from tests.support import corridor_drive

every_baseline = pytest.mark.parametrize("name", list(BASELINES))


@pytest.fixture(scope="module")
def drives() -> tuple[list[View], list[View]]:
    rng = np.random.default_rng(0)
    return corridor_drive(rng, 9, size=96, spacing=1.0), corridor_drive(rng, 9, 1.0, brightness=0.7, size=96)


@pytest.fixture(scope="module")
def reference(drives: tuple[list[View], list[View]]) -> Reference:
    return Reference(drives[0])


@pytest.fixture(scope="module")
def another(drives: tuple[list[View], list[View]]) -> Reference:
    """The same drive, learnt once more."""
    return Reference(drives[0])


@pytest.fixture(scope="module")
def blindfold(drives: tuple[list[View], list[View]]) -> Reference:
    """The same drive, without its true poses."""
    return Reference([replace(view, truth=None) for view in drives[0]])


@pytest.fixture(scope="module")
def whole(reference: Reference, drives: tuple[list[View], list[View]]) -> Callable[[str], list[Belief]]:
    """Answers of a baseline to the whole second drive, asked for once."""
    return cache(lambda name: answers(name, reference, drives[1]))


def answers(name: str, reference: Reference, views: list[View]) -> list[Belief]:
    localiser = BASELINES[name](reference)
    localiser.reset()
    return [localiser.update(view) for view in views]


@pytest.mark.quick_cases("hamming", "topometric", "fabmap-naive")
@every_baseline
def test_answers_are_probabilities(name: str, whole: Callable[[str], list[Belief]]) -> None:
    for belief in whole(name):
        assert belief.places.shape == (9,)
        assert (belief.places >= 0).all()
        assert belief.places.sum() == pytest.approx(1.0)
        assert 0.0 <= belief.lost <= 1.0
        assert belief.places[belief.best] == belief.places.max()
        positive = belief.places[belief.places > 0]
        assert belief.entropy == pytest.approx(-np.sum(positive * np.log(positive)), abs=1e-9)
        assert belief.timings.features > 0


@pytest.mark.quick_cases("ransac", "sequence-graph", "fabmap")
@every_baseline
def test_answers_are_the_same_after_a_reset_and_for_another_learner(
    name: str,
    reference: Reference,
    another: Reference,
    drives: tuple[list[View], list[View]],
    whole: Callable[[str], list[Belief]],
) -> None:
    localiser = BASELINES[name](reference)
    for view in drives[1][:3]:
        localiser.update(view)
    localiser.reset()
    again = [localiser.update(view) for view in drives[1]]
    other = answers(name, another, drives[1])
    assert whole(name) == again == other


@pytest.mark.quick_cases("hamming", "sequence-graph", "fabmap")
@every_baseline
def test_answers_come_from_the_views_up_to_now_and_never_from_the_truth(
    name: str, blindfold: Reference, drives: tuple[list[View], list[View]], whole: Callable[[str], list[Belief]]
) -> None:
    part = answers(name, blindfold, [replace(view, truth=None) for view in drives[1][:6]])
    assert whole(name)[:6] == part


@every_baseline
def test_the_drive_that_was_learnt_is_found(
    name: str, reference: Reference, drives: tuple[list[View], list[View]]
) -> None:
    assert [belief.best for belief in answers(name, reference, drives[0])] == list(range(9))


@every_baseline
def test_a_view_without_any_sensor_is_answered(
    name: str, reference: Reference, drives: tuple[list[View], list[View]]
) -> None:
    belief = answers(name, reference, [*drives[0][:3], View(time=9.0, distance=1.0)])[-1]
    assert belief.places.sum() == pytest.approx(1.0)
