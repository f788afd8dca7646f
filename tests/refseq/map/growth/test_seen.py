"""A view by itself: Bayes' rule over the places and over being lost."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq.belief import Timings
from refseq.map.growth.seen import _alone
from refseq.map.matcher import Measurement


@given(
    st.lists(st.lists(st.floats(-20.0, 20.0), min_size=1, max_size=6), min_size=1, max_size=3),
    st.floats(0.01, 0.99),
)
def test_a_view_alone_is_weighed_against_being_lost_by_bayes_rule(sequences: list[list[float]], lost: float) -> None:
    """All places are alike before, those of several sequences as well; lost, a view is as likely as it is elsewhere."""
    measured = [Measurement(np.ones(len(told)), 0.0, Timings(), np.array(told)) for told in sequences]
    ratios = np.exp(np.concatenate([np.array(told) for told in sequences]))
    weights = (1 - lost) / len(ratios) * ratios
    found = _alone(measured, lost, with_scan=True)
    np.testing.assert_allclose(found, weights / (weights.sum() + lost), rtol=1e-9)
    assert 1 - found.sum() == pytest.approx(lost / (weights.sum() + lost), abs=1e-9)


def test_where_cameras_are_asked_a_view_alone_is_told_without_its_scan() -> None:
    words, scan = np.array([1.0, -1.0, 0.5]), np.array([-2.0, 3.0, 0.0])
    view = Measurement(np.ones(3), 0.0, Timings(), words + scan, never_blind=scan)
    assert _alone([view], 0.1, with_scan=False) == pytest.approx(_alone([view.with_log_ratio(words)], 0.1, True))
