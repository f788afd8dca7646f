"""Record of drives: the same drive is known again by all that its views show, whatever it is called."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from refseq.map.growth.record import AddedDrive, GrowthRecord, digest_of
from refseq.view import Scan, View

PIXELS = np.arange(12, dtype=np.uint8).reshape(3, 4)
SCAN = Scan(np.array([1.0, 2.0, np.inf], np.float32))
DRIVE = (
    View(0.0, {"left": PIXELS, "right": PIXELS[::-1]}, SCAN),
    View(1.0, {"left": PIXELS}, None, 0.5, 0.1),
)


def test_a_drive_is_the_same_at_another_time_and_whichever_camera_is_named_first() -> None:
    later = [replace(view, time=view.time + 60.0, images=dict(reversed(view.images.items()))) for view in DRIVE]
    assert digest_of(later) == digest_of(DRIVE)


@pytest.mark.parametrize(
    "changed",
    [
        lambda first, second: (second, first),
        lambda first, second: (first,),
        lambda first, second: (first, replace(second, distance=0.51)),
        lambda first, second: (first, replace(second, turn=-0.1)),
        lambda first, second: (first, replace(second, images={"right": PIXELS})),
        lambda first, second: (first, replace(second, images={"left": PIXELS.reshape(4, 3)})),
        lambda first, second: (first, replace(second, images={"left": PIXELS[::-1]})),
        lambda first, second: (replace(first, scan=None), second),
        lambda first, second: (replace(first, scan=replace(SCAN, ranges=2 * SCAN.ranges)), second),
    ],
)
def test_a_drive_that_shows_or_goes_otherwise_is_another(changed: Callable[[View, View], tuple[View, ...]]) -> None:
    assert digest_of(changed(*DRIVE)) != digest_of(DRIVE)


def test_joined_records_hold_each_drive_once_by_its_first_name() -> None:
    one, other, again = AddedDrive("one", "aa", 9, 3), AddedDrive("other", "bb", 8, 2), AddedDrive("again", "aa", 9, 1)
    joined = GrowthRecord.joined([GrowthRecord((one, other)), GrowthRecord(()), GrowthRecord((again,))])
    assert joined == GrowthRecord((one, other))
    assert joined.drive("aa") == one
    assert joined.drive("cc") is None
