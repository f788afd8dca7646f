"""Overlaps that words found, checked by the laser's scans: a share has to agree, or places have to tell much."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from refseq.atlas.consistency import Verdict
from refseq.atlas.found import FoundOverlap
from refseq.atlas.look_alikes import look_alikes
from refseq.atlas.overlap import Overlap, OverlapSettings
from refseq.atlas.scan_check import ScanCheck
from refseq.map.map import Map, beside
from refseq.planar import Pose
from refseq.scan_matching.panorama import panorama
from tests.refseq.rooms import Wall, bits_drive, bits_sequence, cast, rectangle

COUNT = 34
CORRIDOR: list[Wall] = rectangle(0, -1.2, 60, 1.2)


def boxes(start: float, step: float) -> list[Wall]:
    """Sides of boxes along both walls, from somewhere on, so many metres apart."""
    return [(x, side, x, side / 2) for x in np.arange(start, 58.0, step).tolist() for side in (-1.2, 1.2)]


FULL: list[Wall] = [*CORRIDOR, *boxes(12.0, 5.0)]
"""The corridor with boxes all along, which were not there before."""
LATER_FULL: list[Wall] = [*CORRIDOR, *boxes(30.0, 1.0)]
TRACK = np.column_stack([np.arange(COUNT, dtype=float), np.zeros((COUNT, 2))])
HELD = np.column_stack([np.arange(25)] * 2)


def mapped(name: str, walls: list[Wall]) -> Map:
    """A view a metre from x = 10 m on, and what the laser saw there."""
    scans = np.stack([panorama(cast(walls, Pose(10.0 + x, 0.0, 0.0))) for x in TRACK[:, 0].tolist()])
    views = bits_drive({"camera": np.eye(COUNT, dtype=np.bool_)})
    return Map.of(replace(bits_sequence(views), odometry=TRACK), name, scans=scans)


def checked(
    walls: list[Wall], pairs: NDArray[np.intp], nats: float, doubt: str = "", more: float = 0.0
) -> FoundOverlap:
    """An overlap of a drive past the corridor's walls and one past others, told of by so many ``nats`` a view.

    It was found ``doubt``ful, and so much longer [m] than its pairs are.
    """
    both = beside([mapped("one", CORRIDOR), mapped("other", walls)])
    length = float(np.ptp(pairs[:, 0])) + more
    overlap = Overlap(pairs, (length, length), {"laser": nats}, doubt=doubt, evidence=nats * length)
    return ScanCheck(both, [TRACK, TRACK], OverlapSettings()).checked(FoundOverlap(0, 1, pairs, overlap))


def test_the_same_walls_raise_no_doubt() -> None:
    found = checked(CORRIDOR, HELD, 1.5).overlap
    assert (found.objection, found.doubt) == ("", "")
    assert found.alike == pytest.approx(1.0, abs=0.005)


@pytest.mark.parametrize(("nats", "left"), [(30 / 24, ""), (20 / 24, "short")])
def test_scans_that_are_alike_to_the_last_beam_take_all_doubt_from_enough_evidence(nats: float, left: str) -> None:
    """Of 25 nats·m or more, over 24 m."""
    assert checked(CORRIDOR, HELD, nats, doubt="short").overlap.doubt == left


def test_what_scans_do_not_hold_tells_nothing() -> None:
    """Of 48 m they hold 24: half of the evidence, which is too little to take the doubt."""
    whole, half = checked(CORRIDOR, HELD, 2.0).overlap, checked(CORRIDOR, HELD, 1.0, doubt="short", more=24.0).overlap
    assert (whole.lengths, half.lengths) == ((24.0, 24.0), (24.0, 24.0))
    assert (whole.evidence, half.evidence) == pytest.approx((48.0, 24.0))
    assert half.doubt == "short"


@pytest.mark.parametrize(
    ("views", "nats", "doubted"),
    [
        (25, 1.5, True),  # little for long
        (15, 2.5, True),  # much for a few metres
        (25, 2.5, False),
    ],
)
def test_walls_that_hardly_agree_are_made_up_for_by_much_that_is_told_for_long(
    views: int, nats: float, doubted: bool
) -> None:
    found = checked(FULL, HELD[:views], nats).overlap
    assert found.alike is not None
    assert 0.87 < found.alike < 0.98
    assert found.objection == ""
    assert ("of scans that lie on each other to" in found.doubt) == doubted


def test_a_look_alike_is_told_by_what_comes_after_it() -> None:
    found = checked(LATER_FULL, HELD[:14], 3.0).overlap
    assert found.alike is not None
    assert found.alike > 0.98
    assert "where both paths go on for" in found.objection


def test_a_join_inside_what_its_path_shows_twice_is_doubted() -> None:
    check = ScanCheck(beside([mapped("one", CORRIDOR), mapped("other", CORRIDOR)]), [TRACK, TRACK], OverlapSettings())
    loop = np.column_stack([np.arange(10), np.arange(20, 30)])
    overlap = Overlap(loop, (9.0, 9.0), {}, alike=0.99)
    twice = FoundOverlap(0, 0, loop, overlap)
    inside, beyond = (FoundOverlap(0, 1, HELD[:views], replace(overlap, pairs=HELD[:views])) for views in (10, 20))
    every, verdicts = [twice, inside, beyond], [Verdict.CONTRADICTED, Verdict.AGREES, Verdict.AGREES]
    known = look_alikes(every, verdicts, OverlapSettings().same)
    doubts = [one.overlap.doubt for one in (check.doubted(each, known) for each in every)]
    assert doubts == ["", "inside a stretch that views 20 to 29 of 'one' look like", ""]
