"""Table 1.1: ten places along a corridor, and three landmarks that cannot tell them apart one by one."""

import numpy as np
import pytest

from refseq.belief import Stage
from refseq.inference.chain.chain import Chain, ChainSettings, Observation
from refseq.inference.chain.motion import MotionSettings
from refseq.inference.chain.viterbi import viterbi
from refseq.inference.matching.information import feature_information
from refseq.map.localiser import localise
from tests.refseq.rooms import bits_drive, bits_map, bits_sequence

CORNER, DOOR, WALL = range(3)
TABLE = np.array(
    [
        [0, 1, 0, 0, 0, 0, 0, 0, 0, 0],
        [0, 0, 1, 1, 0, 1, 0, 1, 1, 0],
        [1, 0, 0, 0, 1, 0, 1, 0, 0, 1],
    ],
    bool,
)
VIEWS = bits_drive({"camera": TABLE.T})


def test_the_table_is_the_incidence_matrix() -> None:
    matrix = bits_sequence(VIEWS).matrix
    np.testing.assert_array_equal(matrix.rows(np.arange(3)), TABLE)
    assert [list(matrix.column(place)) for place in range(10)] == [[np.flatnonzero(c)[0]] for c in TABLE.T]


def test_one_look_cannot_tell_doors_from_doors() -> None:
    """Perceptual aliasing: the posterior of a view is the same at all places with its landmark, and only there high."""
    for view, row in ((VIEWS[2], TABLE[DOOR]), (VIEWS[0], TABLE[WALL]), (VIEWS[1], TABLE[CORNER])):
        (belief,) = localise(bits_map(VIEWS), [view], stages=[Stage.UNIFORM])[Stage.UNIFORM]
        assert np.ptp(belief.places[row]) == pytest.approx(0.0)
        assert belief.places[row].min() > belief.places[~row].max()


def test_what_each_landmark_tells_about_the_place() -> None:
    """One of ten places has the corner, five have a door, four a wall: the entropies of such coins."""
    sequence = bits_sequence(VIEWS)
    shares = np.array([0.1, 0.5, 0.4])
    coins = -shares * np.log2(shares) - (1 - shares) * np.log2(1 - shares)
    np.testing.assert_allclose(feature_information(sequence.matrix, range(3)), coins)


@pytest.mark.parametrize("length", [3, 4])
def test_their_order_tells_the_places_apart(length: int) -> None:
    """With a sensor that is right nine times of ten. Two pairs of three places in a row look alike, of four none do."""
    chain = Chain(np.arange(10.0), MotionSettings(), ChainSettings(lost=0.05))
    for first in range(11 - length):
        shown = TABLE[:, first : first + length]
        observations = [
            Observation(1.0, np.log(np.where((column[:, None] == TABLE).all(axis=0), 0.9, 0.05)), np.log(1 / 3))
            for column in shown.T
        ]
        path = viterbi(observations, chain).path
        alike = [k for k in range(11 - length) if (TABLE[:, k : k + length] == shown).all()]
        assert path[0] in alike
        assert path == tuple(range(path[0], path[0] + length))
        assert len(alike) == (2 if length == 3 and first in (2, 3, 5, 7) else 1)
