import numpy as np
import pytest

from refseq.inference.chain.chain import Chain, ChainSettings
from refseq.inference.chain.run_out import run_out
from refseq.inference.paths import PathBounds, usual_step
from tests.refseq.chains import SPREAD


@pytest.mark.parametrize("views", [0, 1, 9, 45])
def test_a_stand_of_any_length_leaves_the_usual_step_as_it_is(views: int) -> None:
    """A robot that stood saw one place more often; it did not drive shorter steps."""
    along = np.insert(0.8 * np.arange(10.0), 4, np.full(views, 3.2))
    assert usual_step(along) == pytest.approx(0.8)
    assert PathBounds.of(along, (-1,)).gap == usual_step(along)
    np.testing.assert_allclose(run_out(along, 1.6), [8.0, 8.8])


def test_the_way_between_two_paths_is_no_step() -> None:
    assert usual_step(np.array([0.0, 1.0, 2.0, 1000.0, 1003.0]), (2, 4)) == 1.0
    assert usual_step(np.array([0.0, 0.0, 1000.0, 1000.0]), (1, 3)) == usual_step(np.zeros(1)) == 0.0


def test_motion_that_nobody_measured_moves_on_over_a_map_that_stood() -> None:
    """From the place before a long stand the belief comes past it, as without the stand."""
    along = np.insert(np.arange(6.0), 3, np.full(20, 3.0))
    settings = ChainSettings(lost=0.0, lost_at_start=0.0, exit_at_ends=False)
    states = np.zeros((2, len(along)))
    states[0, 2] = 1.0
    for _ in range(3):
        states = Chain(along, SPREAD, settings).transitions(np.nan).predict(states)
    assert states[0] @ along > 3.5
