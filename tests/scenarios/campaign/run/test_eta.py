import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq_bench.scenarios.campaign.run.eta import Eta, in_words
from tests.scenarios.campaign.chores import Chore

DRIVE, ASK = Chore("d", "drive"), Chore("a", "ask")


def test_nothing_is_known_before_the_first_task_is_done() -> None:
    assert Eta().left([DRIVE], [], 1) is None
    assert Eta().left([], [], 1) == 0


def test_the_rest_is_the_mean_of_each_kind_shared_among_the_workers() -> None:
    pace = Eta()
    for seconds in (50.0, 70.0):
        pace.note(DRIVE, seconds)
    pace.note(ASK, 4.0)
    assert pace.left([DRIVE] * 4 + [ASK] * 5, [], 2) == pytest.approx((4 * 60 + 5 * 4) / 2)
    assert pace.left([DRIVE], [(DRIVE, 45.0)], 2) == pytest.approx(60)  # one task is not shared
    assert pace.left([], [(DRIVE, 45.0)], 2) == pytest.approx(15)
    assert pace.left([], [(DRIVE, 500.0)], 2) == 0
    assert pace.left([DRIVE] * 2, [(DRIVE, 500.0)], 1) == 120, "a task that takes too long makes no other shorter"


def test_a_kind_that_is_not_known_yet_takes_as_long_as_others() -> None:
    pace = Eta()
    pace.note(DRIVE, 10.0)
    assert pace.left([ASK, ASK], [], 1) == pytest.approx(20)


@given(st.lists(st.floats(0.1, 1e4), min_size=1), st.integers(1, 50), st.integers(0, 40))
def test_more_workers_are_never_slower_and_no_task_is_done_before_it_is(
    took: list[float], workers: int, count: int
) -> None:
    pace = Eta()
    for seconds in took:
        pace.note(DRIVE, seconds)
    one, more = (pace.left([DRIVE] * count, [], number) for number in (workers, workers + 1))
    assert one is not None
    assert more is not None
    assert more <= one
    if count:
        assert more >= min(took) * (1 - 1e-9)


@pytest.mark.parametrize(
    ("seconds", "words"), [(0.4, "0 s"), (99, "99 s"), (100, "2 min"), (5930, "99 min"), (7500, "2 h 05 min")]
)
def test_durations_are_read_at_a_glance(seconds: float, words: str) -> None:
    assert in_words(seconds) == words
