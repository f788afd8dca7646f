"""Descriptions that are found once: the same as without, looked up by pixels and settings, within a bound of bytes."""

import time
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from refseq.features.boundary import ScanBoundary
from refseq.features.corners import CornerCounts
from refseq.features.dense import DenseSettings, DenseWords
from refseq.features.doors import DoorCounts, DoorSettings
from refseq.features.memory import DescriptionMemory, clock, described_once
from refseq.features.sectors import SectorRanges, SectorSettings
from refseq.features.sift import SiftSettings, SiftWords
from refseq.features.walls import WallLines, WallSettings
from refseq.planar import Pose
from refseq.view import Scan, View
from tests.refseq.rooms import cast, rectangle

CAMERA = "camera-1"


def image(seed: int) -> NDArray[np.uint8]:
    blocks = np.random.default_rng(seed).integers(0, 256, (12, 16), np.uint8)
    return np.ascontiguousarray(np.kron(blocks, np.ones((10, 10), np.uint8)))


def view(seed: int) -> View:
    room = [*rectangle(-3.0, -2.0, 5.0, 3.0), *rectangle(2.0, 0.5, 2.6, 1.1)]
    rng = np.random.default_rng(seed)
    return View(0.0, {CAMERA: image(seed)}, cast(room, Pose(0.3 * seed, 0.1, 0.2 * seed), rng=rng))


WALLS = WallSettings()
EXTRACTORS = [
    SiftWords(CAMERA, SiftSettings()),
    SiftWords(CAMERA, SiftSettings(cap=5)),
    SiftWords(CAMERA, SiftSettings(root=True)),
    DenseWords(CAMERA, DenseSettings()),
    DenseWords(CAMERA, DenseSettings(seed=1)),
    WallLines(WALLS),
    CornerCounts(WALLS),
    DoorCounts(DoorSettings(), WALLS),
    ScanBoundary(),
    SectorRanges(SectorSettings()),
    SectorRanges(SectorSettings(bins=9)),
]


def test_a_memory_changes_no_description() -> None:
    alone = [[one.describe(view(seed)) for one in EXTRACTORS] for seed in range(3)]
    with described_once(DescriptionMemory()):
        for _ in range(2):
            for seed, expected in enumerate(alone):
                for one, described in zip(EXTRACTORS, expected, strict=True):
                    np.testing.assert_array_equal(one.describe(view(seed)), described)
    shown = [sum(map(len, described)) for described in zip(*alone, strict=True)]
    assert [one.key for one, count in zip(EXTRACTORS, shown, strict=True) if not count] == ["doors/laser"]


def test_a_scan_is_described_once_and_anew_where_anything_about_it_is_different(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found: list[Scan] = []
    known = WallLines.bits
    monkeypatch.setattr(WallLines, "bits", lambda self, scan: found.append(scan) or known(self, scan))
    scan = view(1).scan
    assert scan is not None
    others = [replace(scan, start=-1.5), replace(scan, step=0.008), replace(scan, max_range=4.0), view(2).scan]
    with described_once(DescriptionMemory()):
        for _ in range(2):
            for one in (scan, *others):
                WallLines(WALLS).describe(View(0.0, {}, one))
        WallLines(replace(WALLS, points=WALLS.points + 1)).describe(View(0.0, {}, scan))
    assert len(found) == 6


def test_a_picture_is_described_once_by_all_extractors_of_the_same_settings(monkeypatch: pytest.MonkeyPatch) -> None:
    found: list[int] = []
    known = SiftWords.keys
    monkeypatch.setattr(SiftWords, "keys", lambda self, image: found.append(1) or known(self, image))
    twins = SiftWords(CAMERA, SiftSettings()), SiftWords(CAMERA, SiftSettings(), np.ones((3, 128), np.uint8))
    with described_once(DescriptionMemory()):
        for one in twins:
            one.describe(view(1))
    assert len(found) == 1
    for one in twins:  # the block has ended
        one.describe(view(1))
    assert len(found) == 3


def test_what_is_handed_out_cannot_be_changed() -> None:
    with described_once(DescriptionMemory()), pytest.raises(ValueError, match="read-only"):
        EXTRACTORS[0].describe(view(1))[0] = 0


def test_a_look_up_takes_what_finding_took() -> None:
    def slow() -> NDArray[np.uint8]:
        time.sleep(0.05)
        return np.ones(3, np.uint8)

    with described_once(DescriptionMemory()) as memory:
        times = []
        for _ in range(2):
            begin = clock()
            memory.describe("key", slow)
            times.append(clock() - begin)
    assert memory.spared >= 0.05
    assert times[1] >= memory.spared  # though nothing slept


@given(st.integers(0, 100), st.lists(st.tuples(st.integers(0, 9), st.integers(0, 60)), max_size=40))
def test_a_memory_keeps_what_was_used_last_within_its_bound(limit: int, asked: list[tuple[int, int]]) -> None:
    memory, sizes = DescriptionMemory(limit), dict[int, int]()
    used: list[int] = []  # the oracle: keys as they were used, the last at the end
    for key, size in asked:
        size = sizes.setdefault(key, size)
        found: list[int] = []
        memory.describe(key, lambda size=size, found=found: found.append(1) or np.zeros(size, np.uint8))
        assert bool(found) is (key not in used)
        used = [one for one in used if one != key] + [key]
        while sum(sizes[one] for one in used) > limit:
            used.pop(0)
        assert memory.nbytes == sum(sizes[one] for one in used) <= limit


def test_settings_that_differ_are_kept_apart() -> None:
    with described_once(DescriptionMemory()):
        few, many = (SiftWords(CAMERA, replace(SiftSettings(), cap=cap)).describe(view(1)) for cap in (3, 9))
    assert (len(few), len(many)) == (3, 9)
