import math

import numpy as np
import pytest

from refseq.features.sectors import SHIFTS, SectorRanges, SectorSettings, sector_ranges
from refseq.view import Scan, View

GRIDS = len(SHIFTS) ** 2


def scan_of(ranges: float | np.ndarray, beams: int = 360) -> Scan:
    """Beams a quarter of a degree off the half degrees, so that none lies on the border of two sectors."""
    step = math.pi / beams
    return Scan(np.broadcast_to(np.asarray(ranges, np.float32), beams).copy(), -math.pi / 2 + step / 2, step)


@pytest.mark.parametrize("beams", [360, 180])
@pytest.mark.parametrize("sectors", [4, 36])
def test_each_sector_gives_its_own_range(beams: int, sectors: int) -> None:
    own = 1.0 + np.arange(beams) * sectors // beams
    medians = sector_ranges(scan_of(own, beams), sectors)
    np.testing.assert_array_equal(medians[:sectors], 1.0 + np.arange(sectors))
    assert np.isinf(medians[sectors])


def test_a_shifted_grid_begins_half_a_sector_earlier() -> None:
    own = np.repeat(1.0 + np.arange(8), 45)  # eighths of the half turn
    assert list(sector_ranges(scan_of(own), 4, 0.5)) == [1.0, 2.5, 4.5, 6.5, 8.0]


def test_median_ignores_a_few_outliers_and_half_without_return_is_none() -> None:
    ranges = np.full(360, 3.0, np.float32)
    ranges[[2, 5]] = 70.0  # two of the first sector's ten beams
    ranges[10:15] = np.inf  # half of the second sector's
    medians = sector_ranges(scan_of(ranges), 36)
    assert medians[0] == 3.0
    assert np.isinf(medians[1])
    assert (medians[2:36] == 3.0).all()


def test_sectors_that_no_beam_reaches_are_empty() -> None:
    narrow = Scan(np.full(90, 2.0, np.float32), -math.pi / 4 + 0.001, math.pi / 180)
    assert list(np.isfinite(sector_ranges(narrow, 4))) == [False, True, True, False, False]


def cells(ranges: float | np.ndarray, settings: SectorSettings) -> set[tuple[int, int, int, int]]:
    """The cells that a scan sets: turn and range shift of the grid, sector, bin."""
    extractor = SectorRanges(settings)
    ids = extractor.observe(View(0.0, scan=scan_of(ranges))).ids
    assert list(ids) == sorted(set(ids))
    assert all(0 <= i < extractor.size for i in ids)
    shape = (2, 2, int(settings.sectors) + 1, int(settings.bins) + 2)
    return set(zip(*(axis.tolist() for axis in np.unravel_index(ids, shape)), strict=True))


@pytest.mark.parametrize(
    ("reach", "plain", "shifted"),
    # Bins begin at 1, 2, 4 m; in the shifted grid at 0.71, 1.41, 2.83 m. The last one has no end.
    [(0.1, 0, 0), (0.6, 0, 0), (0.8, 0, 1), (1.2, 1, 1), (1.6, 1, 2), (2.5, 2, 2), (3.5, 2, 3), (900.0, 4, 4)],
)
def test_bins_grow(reach: float, plain: int, shifted: int) -> None:
    found = cells(reach, SectorSettings(sectors=2, bins=3, nearest=1.0, growth=2.0))
    # Unshifted there are two sectors, shifted by half three.
    assert found == {
        *((0, 0, sector, plain) for sector in range(2)),
        *((0, 1, sector, shifted) for sector in range(2)),
        *((1, 0, sector, plain) for sector in range(3)),
        *((1, 1, sector, shifted) for sector in range(3)),
    }


def test_a_small_turn_leaves_some_cells() -> None:
    """What the four grids are for: ranges that change by a quarter of a cell keep at least one of two grids' cells."""
    settings = SectorSettings()
    rng = np.random.default_rng(1)
    for reach in rng.uniform(0.5, 20, 50):
        here, there = cells(reach, settings), cells(reach * settings.growth**0.24, settings)
        assert here & there


def test_medians_are_taken_once_for_each_shift_of_the_sectors(monkeypatch: pytest.MonkeyPatch) -> None:
    shifts: list[float] = []

    def counted(scan: Scan, sectors: int, shift: float = 0.0) -> np.ndarray:
        shifts.append(shift)
        return sector_ranges(scan, sectors, shift)

    monkeypatch.setattr("refseq.features.sectors.sector_ranges", counted)
    assert len(SectorRanges(SectorSettings()).bits(scan_of(4.0))) == 2 * 24 + 2 * 25
    assert shifts == list(SHIFTS)


def test_nothing_seen_sets_nothing() -> None:
    assert cells(np.inf, SectorSettings()) == set()
    extractor = SectorRanges(SectorSettings())
    view = View(0.0, scan=scan_of(4.0))
    np.testing.assert_array_equal(extractor.learn(view), extractor.observe(view).ids)
    assert len(extractor.observe(view).ids) == 2 * 24 + 2 * 25


@pytest.mark.parametrize("beams", [541, 1081])
def test_a_scanner_of_270_degrees_gives_the_sectors_of_one_of_180(beams: int) -> None:
    step = 1.5 * math.pi / (beams - 1)
    bearings = -0.75 * math.pi + step * np.arange(beams)
    wide = Scan((5 + np.sin(3 * bearings)).astype(np.float32), -0.75 * math.pi, step)
    ahead = np.abs(bearings) <= math.pi / 2 + 1e-9
    narrow = Scan(wide.ranges[ahead], float(bearings[ahead][0]), step)
    assert SectorRanges(SectorSettings()).bits(wide).tolist() == SectorRanges(SectorSettings()).bits(narrow).tolist()
