import numpy as np
import pytest

from refseq.planar import Pose
from refseq.viewer.drawing.colours import LOST
from refseq.viewer.drawing.history import CELLS, HEIGHT, MARGIN, WIDTH, History
from refseq.viewer.drawing.pictures import inferno
from refseq.viewer.drawing.trail import Trail
from tests.support import certain, peaked


def spot(places: int, views: int, place: float, view: float) -> tuple[int, int]:
    """Where the middle of a place and a view is drawn."""
    high = HEIGHT - MARGIN
    return MARGIN + high - 1 - int((place + 0.5) * high / places), int((view + 0.5) * WIDTH / views)


@pytest.mark.parametrize("places", [5, 113, 700, 2000])
def test_one_sure_belief_among_many_places_is_as_bright_as_ever(places: int) -> None:
    history = History(places, expect=20)
    for view in range(20):
        history.add(certain(places, view * places // 20), None)
    picture = history.picture()
    assert picture.shape == (HEIGHT, WIDTH, 3)
    for view in range(20):
        row, column = spot(places, 20, view * places // 20, view)
        near = picture[max(MARGIN, row - 2) : row + 3, column].reshape(-1, 3)
        assert (near == inferno()[255]).all(axis=1).any(), (places, view)


@pytest.mark.parametrize("places", [113, 2000])
def test_the_truth_s_band_never_covers_the_belief(places: int) -> None:
    with_truth, without = History(places, expect=10), History(places, expect=10)
    for view in range(10):
        belief = peaked(places, places * view / 10, places / 50)
        with_truth.add(belief, places * view // 10)
        without.add(belief, None)
    assert (with_truth.picture() >= without.picture()).all()
    assert (with_truth.picture() != without.picture()).any()


def test_a_drive_of_any_length_fits_and_keeps_its_shape() -> None:
    """Places are driven through evenly: the picture is a diagonal whatever the number of views."""
    for views, expect in ((50, 50), (1000, 1000), (1000, None), (129, 113)):
        history = History(100, expect)
        for view in range(views):
            history.add(certain(100, view * 100 // views), None)
        bright = (history.picture()[MARGIN:].sum(axis=2) > 400).argmax(axis=0)
        filled = np.flatnonzero(history.picture()[MARGIN:].sum(axis=2).max(axis=0) > 400)
        assert filled[0] == 0
        assert (np.diff(bright[filled]) <= 0).all()
        assert filled[-1] > 0.45 * WIDTH


@pytest.mark.parametrize("views", [1, 100, 160, 161, 200, 319, 320, 321, 1001])
def test_views_that_were_expected_fill_the_width(views: int) -> None:
    history = History(1, expect=views)
    for _view in range(views):
        history.add(certain(1, 0), None)
    assert (history.picture()[MARGIN:].sum(axis=2) > 400).all()


def test_views_that_say_lost_are_marked_on_top() -> None:
    history = History(10, expect=10)
    for view in range(10):
        history.add(certain(10, view, lost=0.9 if view == 4 else 0.1), None)
    marked = (history.picture()[0] == LOST).all(axis=1)
    assert (np.flatnonzero(marked) * 10 // WIDTH == 4).all()
    assert marked.sum() == WIDTH // 10


def test_without_a_number_to_expect_it_starts_with_a_column_a_view() -> None:
    history = History(10)
    for _view in range(CELLS // 2):
        history.add(certain(10, 9), None)
    assert (history.picture()[MARGIN + 1, : WIDTH // 2].sum(axis=1) > 400).all()
    assert history.picture()[MARGIN:, WIDTH // 2 + 3 :].sum(axis=2).max() < 10


def test_a_trail_stays_short_and_ends_where_the_robot_is() -> None:
    trail = Trail(16)
    for k in range(1000):
        trail.add(Pose(float(k), 0.0, 0.0))
        assert len(trail.points) <= 17
        assert trail.points[-1][0] == k
    assert trail.points[0][0] == 0
    assert (np.diff(trail.points[:-1, 0]) == np.diff(trail.points[:2, 0])).all()
