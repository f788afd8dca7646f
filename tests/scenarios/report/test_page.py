import numpy as np
import pytest

from refseq.belief import Stage
from refseq.view import Scan
from refseq_bench.scenarios.report.images import SCAN_REACH, scan_outline
from refseq_bench.scenarios.report.sections.tables import cost_table
from refseq_bench.scenarios.report.words import duration_text, size_text
from refseq_bench.scenarios.scoring.cost import Cost
from tests.support import corridor_comparison


@pytest.mark.parametrize(
    ("count", "text"), [(0, "0 B"), (999, "999 B"), (1000, "1 kB"), (27_430_000, "27.4 MB"), (1.5e12, "1.5e+03 GB")]
)
def test_bytes_have_the_unit_that_keeps_them_short(count: float, text: str) -> None:
    assert size_text(count) == text


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0.04, "0.0 s"),
        (59.94, "59.9 s"),
        (60, "1 min 00 s"),
        (119.7, "2 min 00 s"),
        (3600, "1 h 00 min"),
        (9000, "2 h 30 min"),
    ],
)
def test_times_are_in_the_units_of_a_clock(seconds: float, text: str) -> None:
    assert duration_text(seconds) == text


def test_a_scan_is_drawn_as_seen_from_above_with_the_robot_looking_up() -> None:
    """Walls only: where the beams go far, no line closes the corridor, and of what came from nowhere there is none."""
    ranges = np.full(361, np.inf, np.float32)
    ranges[[0, 180, 360]] = 2.0, 3.0, 4.0
    ranges[180:200] = 3.0
    ranges[90] = SCAN_REACH
    scan = Scan(ranges)
    assert scan.bearings[0] < 0 < scan.bearings[-1]  # from the right to the left
    first, *wall, last = scan_outline(scan).split()
    assert (first, wall[0], last) == ("M20,0h0", "M0,-30h0", "M-40,0h0")
    assert 3 < len(wall) <= 20
    assert all(point[0] == "L" for point in wall[1:])
    assert np.hypot(*np.array([point[1:].removesuffix("h0").split(",") for point in wall], int).T) == pytest.approx(
        30, abs=1
    )
    assert scan_outline(Scan(np.full(361, np.inf, np.float32))) == ""


def test_costs_are_means_over_the_drives_and_of_memory_the_most() -> None:
    run = corridor_comparison(0, count=4, size=24)
    costs = [
        Cost(learn_s=1.0, answer_s=10.0, places=10, bytes_kept=10_000, features=50, peak_bytes=3_000_000),
        Cost(learn_s=3.0, answer_s=20.0, places=30, bytes_kept=50_000, features=70, peak_bytes=2_000_000),
    ]
    table = cost_table([run], [Stage.CHAIN], {Stage.CHAIN: costs})
    assert table is not None
    (row,) = table.rows
    costs_told = dict(zip(table.headings[1:], row.cells, strict=True))
    assert (
        costs_told
        | {
            "bytes a place": "1.5 kB",
            "features a place": "3",
            "kept in all": "30 kB",
            "learning": "2.0 s",
            "answering": "15.0 s",
            "most memory": "3 MB",
        }
        == costs_told
    )
