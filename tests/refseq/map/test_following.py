"""Pictures laid on those a step before: of a robot that drives, that is carried, that turns, that sees bare walls."""

import math
from collections.abc import Mapping

import numpy as np
import pytest

from refseq.features.sift import NO_KEYS
from refseq.features.word_extractor import PictureKeys
from refseq.map.following import CHANCE, LARGEST_TURN, MOST, MOVED, PictureSteps
from tests.refseq.keys import moved, scene

HERE, ELSEWHERE = scene(np.random.default_rng(1), 60), scene(np.random.default_rng(2), 60)


def drive(count: int) -> list[Mapping[str, PictureKeys]]:
    """Views of a camera that looks ahead: the same plane, coming nearer."""
    return [{"forward": moved(HERE, 1 + 0.01 * number, 0.0, (0, 0))} for number in range(count)]


SHARE = 1 / 21
"""Share of misfits of 19 steps that all fitted, counted from one of two."""


def after(steps: PictureSteps, keys: PictureKeys, distance: float = 0.85, turn: float = 0.0) -> float:
    return steps.update({"forward": keys}, distance, turn)


def driven(count: int = 20) -> PictureSteps:
    steps = PictureSteps()
    for keys in drive(count):
        steps.update(keys, 0.85, 0.0)
    return steps


def test_the_first_picture_tells_nothing() -> None:
    assert after(PictureSteps(), HERE) == 0.0


def test_a_picture_that_follows_speaks_against_being_carried() -> None:
    assert after(driven(), HERE) == pytest.approx(math.log(CHANCE / (1 - SHARE)))


def test_a_picture_of_elsewhere_says_that_it_was_carried() -> None:
    assert after(driven(), ELSEWHERE) == pytest.approx(math.log((1 - CHANCE) / SHARE))


def test_one_picture_says_no_more_than_the_most() -> None:
    assert after(driven(200), ELSEWHERE) == MOST


def test_a_camera_whose_pictures_never_fit_says_nothing() -> None:
    """One that looks aside at bare walls: where it was is as if it were carried all the time."""
    steps = PictureSteps()
    for _ in range(40):
        told = after(steps, NO_KEYS)
    assert told == pytest.approx(0.0, abs=0.05)


def test_cameras_add_up() -> None:
    one, two = PictureSteps(), PictureSteps()
    for _ in range(20):
        alone = one.update({"forward": HERE}, 0.85, 0.0)
        both = two.update({"forward": HERE, "lateral": HERE}, 0.85, 0.0)
    assert both == pytest.approx(2 * alone)


def test_a_camera_that_comes_later_has_nothing_to_be_laid_on() -> None:
    steps = driven()
    alone = steps.update({"forward": HERE}, 0.85, 0.0)
    assert steps.update({"forward": HERE, "lateral": ELSEWHERE}, 0.85, 0.0) == pytest.approx(alone, abs=0.01)


def test_a_stand_shows_nothing_new() -> None:
    """It is carried where it stood: the picture from before that is what the next one on its way is laid on."""
    steps = driven()
    for keys in (HERE, ELSEWHERE, ELSEWHERE):
        assert after(steps, keys, distance=0.0) == 0.0
    assert after(steps, ELSEWHERE) > 2.0


def test_a_robot_that_creeps_is_compared_after_a_while() -> None:
    steps = driven()
    told = [after(steps, HERE, distance=0.4 * MOVED) for _ in range(6)]
    assert [one < 0 for one in told] == [False, False, True, False, False, True]


@pytest.mark.parametrize(("distance", "turn"), [(0.85, 1.1 * LARGEST_TURN), (math.nan, math.nan), (0.85, math.nan)])
def test_after_a_large_turn_or_one_that_nobody_measured_nothing_is_told(distance: float, turn: float) -> None:
    steps = driven()
    assert after(steps, ELSEWHERE, distance, turn) == 0.0
    assert after(steps, ELSEWHERE) < 0, "it is laid on that picture"


def test_a_reset_forgets() -> None:
    steps = driven()
    steps.reset()
    assert after(steps, ELSEWHERE) == 0.0
    assert after(steps, ELSEWHERE) == pytest.approx(math.log(2 * CHANCE)), "half of no steps were misfits"
