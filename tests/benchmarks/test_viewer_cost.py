"""What it costs to log a view for the viewer, against making and localising it; and the memory of a long drive.

The drive is the hallway's first metres with both cameras, recorded and localised here; the long one is synthetic.
"""

import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from refseq.belief import Belief, Stage
from refseq.map.learning import learn
from refseq.map.localiser import Localiser
from refseq.view import View
from refseq.viewer.belief_log import LocaliserLayer
from refseq.viewer.live_logger import LiveLogger
from refseq.viewer.places import Places
from refseq.viewer.recording import saved
from refseq_bench.scenarios.drives.drive import Drive
from refseq_bench.scenarios.drives.record import record

pytestmark = pytest.mark.benchmark
SHARE = 0.05
"""Of the time that making and localising a view takes, logging it may take so much."""
VIEWS = 24
LONG = 10_000
SHORT = 1_000
PLACES = 400
GROWTH = 60.0
"""What nine thousand views more may add to the writer's memory [MB]: the file's table of its own chunks."""


@dataclass
class Spent:
    """Seconds of a drive's views, by what they went into, and bytes of the recording that came of it."""

    making: float
    localising: float
    logging: float
    size: int

    @property
    def share(self) -> float:
        """Logging over all else."""
        return self.logging / (self.making + self.localising)


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> tuple[tuple[View, ...], float]:
    """A drive with both cameras, and the seconds that a view took."""
    start = time.perf_counter()
    views = record(Drive(world="corridor:7", light="16:00"), tmp_path_factory.mktemp("cost") / "a.mcap", None).views
    return views[:VIEWS], (time.perf_counter() - start) / len(views)


def watched(views: tuple[View, ...], making: float, path: Path, *, keys: bool) -> Spent:
    """Localise a drive in itself, three stages a view, and log it as it comes; ``keys``: the map's own, not anew."""
    sequence = learn(views)
    other = sequence if keys else learn(views)
    places = Places.of(other, views)
    localisers = {stage: Localiser(sequence, stage=stage) for stage in (Stage.CHAIN,)}
    spent = Spent(making * len(views), 0.0, 0.0, 0)
    with saved(path, "cost") as stream:
        logger = LiveLogger(stream, [LocaliserLayer("own", tuple(localisers), places)])
        for view in views:
            start = time.perf_counter()
            beliefs = {stage.value: localiser.update(view) for stage, localiser in localisers.items()}
            middle = time.perf_counter()
            logger.update(view, {"own": beliefs})
            spent.localising += middle - start
            spent.logging += time.perf_counter() - middle
    spent.size = path.stat().st_size
    return spent


def test_logging_a_view_costs_little_of_making_and_localising_it(
    drive: tuple[tuple[View, ...], float], tmp_path: Path
) -> None:
    views, making = drive
    watched(views[:2], making, tmp_path / "first.rrd", keys=True)  # what the first view imports is no view's cost
    shared = watched(views, making, tmp_path / "a.rrd", keys=True)
    alone = watched(views, making, tmp_path / "b.rrd", keys=False)
    for name, spent in (("keys shared with the localiser", shared), ("keys found again", alone)):
        per_view = [1e3 * seconds / len(views) for seconds in (spent.making, spent.localising, spent.logging)]
        print(
            f"\n{name}: making {per_view[0]:.0f} ms, localising {per_view[1]:.0f} ms, logging {per_view[2]:.1f} ms a "
            f"view: {100 * spent.share:.1f} %; {spent.size / len(views) / 1e3:.0f} kB a view",
            end="",
        )
    print()
    assert shared.share <= SHARE
    assert shared.logging < alone.logging


LONG_DRIVE = """
import sys
from pathlib import Path
from tests.benchmarks.peak import peak_bytes
from tests.benchmarks.test_viewer_cost import long_drive, long_answers, PLACES
from refseq.viewer.belief_log import LocaliserLayer
from refseq.viewer.places import Places
from refseq.viewer.recording import saved
from refseq.viewer.live_logger import LiveLogger
from refseq.planar import Pose
count, path = int(sys.argv[1]), Path(sys.argv[2])
places = Places([Pose(0.85 * k, 0.0, 0.0) for k in range(PLACES)])
with saved(path, "long") as stream:
    logger = LiveLogger(stream, [LocaliserLayer("own", ("chain",), places)], expect=count)
    for view, belief in zip(long_drive(count), long_answers(count)):
        logger.update(view, {"own": {"chain": belief}})
print(peak_bytes() / 1e6, path.stat().st_size / 1e6)
"""


def long_drive(count: int) -> Iterator[View]:
    """Views of two cameras and a laser, over and over along the same corridor, each made when it is asked for."""
    from dataclasses import replace

    import numpy as np

    from tests.support import corridor_drive

    few = corridor_drive(np.random.default_rng(0), 20, size=120)
    for number in range(count):
        view = few[number % len(few)]
        assert view.truth is not None
        assert view.scan is not None
        few_beams = replace(view.scan, ranges=view.scan.ranges[::8], step=8 * view.scan.step)  # walls take their time
        place = replace(view.truth, x=0.85 * (number % PLACES))
        yield replace(view, time=2.0 * number, scan=few_beams, truth=place)


def long_answers(count: int) -> Iterator[Belief]:
    """A sharp belief for each view."""
    from tests.support import peaked

    for number in range(count):
        yield peaked(PLACES, float(number % PLACES), 2.0)


def peak_of(count: int, path: Path) -> tuple[float, float]:
    """Peak memory of writing so many views, and the size of the file [MB]."""
    words = [sys.executable, "-c", LONG_DRIVE, str(count), str(path)]
    done = subprocess.run(words, capture_output=True, text=True, check=True, cwd=Path(__file__).parents[2])
    peak, size = map(float, done.stdout.split())
    return peak, size


def test_memory_does_not_grow_with_the_drive(tmp_path: Path) -> None:
    short, long = peak_of(SHORT, tmp_path / "s.rrd"), peak_of(LONG, tmp_path / "l.rrd")
    for count, (peak, size) in ((SHORT, short), (LONG, long)):
        print(f"\n{count} views: peak {peak:.0f} MB, file {size:.0f} MB", end="")
    print()
    assert long[1] > 8 * short[1]  # it is all there
    assert long[0] - short[0] < GROWTH
