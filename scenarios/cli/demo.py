"""The bench end to end: two drives in different light, the map of the first, the second localised in it, the report."""

from collections.abc import Iterator, Sequence
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from refseq.logs import read_recording
from refseq.logs.beliefs import write_beliefs
from refseq.map.learning import learn
from refseq.map.profile import THESIS, Profile
from refseq.viewer.belief_log import LocaliserLayer
from refseq.viewer.localise_tab import LocaliseTab
from refseq.viewer.map.tab import MapTab
from refseq.viewer.places import Places
from refseq.viewer.recording import write_recording
from refseq.viewer.tab import Tab
from refseq_bench.scenarios.campaign.run.workers import Processes
from refseq_bench.scenarios.cli.terminal.bars import Step
from refseq_bench.scenarios.drives.drive import QUERY_SEEDS, Drive
from refseq_bench.scenarios.drives.evaluate import compare
from refseq_bench.scenarios.drives.inputs import check_output
from refseq_bench.scenarios.drives.record import record
from refseq_bench.scenarios.report.document import write_report
from refseq_bench.scenarios.scoring.comparison import Comparison

REFERENCE, MAP, QUERY, BELIEFS, VIEWS = "reference.mcap", "map.refseq", "query.mcap", "beliefs.parquet", "demo.rrd"
REPORT = "report.html"


@dataclass(frozen=True, slots=True)
class Demo:
    """A reference drive in one light and a query drive in each of ``lights``, for each of ``seeds``."""

    reference: Drive
    lights: Sequence[str]
    seeds: Sequence[int]
    profile: Profile = THESIS


def run_demo(demo: Demo, folder: Path, step: Step) -> list[Comparison]:
    """Record, learn, localise, and leave everything to look at in ``folder``.

    The first seed and light are ``reference.mcap``, ``query.mcap``, ``map.refseq``, ``beliefs.parquet`` and
    ``demo.rrd``; further ones lie in folders of their own. ``report.html`` holds all. Raises ``ScenarioError`` before
    the first drive where one of them cannot be written.
    """
    check_output(*_files(demo, folder), making=True)
    homes = _homes(demo, folder)
    with _beside() as beside:
        by_seed = [_one_seed(demo, seed, home, step, beside) for seed, home in zip(demo.seeds, homes, strict=True)]
    # By light first, so that the seeds of each experiment stand together.
    comparisons = [comparison for of_one_light in zip(*by_seed, strict=True) for comparison in of_one_light]
    step("report")
    write_report(
        folder / REPORT,
        comparisons,
        title=f"{demo.reference.world}: {demo.reference.light} → {', '.join(demo.lights)}",
    )
    return comparisons


def _homes(demo: Demo, folder: Path) -> list[Path]:
    """The folder of each seed."""
    return [folder if seed == demo.seeds[0] else folder / f"seed-{seed}" for seed in demo.seeds]


def _places(demo: Demo, home: Path) -> list[Path]:
    """The folder of each light, within that of a seed."""
    return [home if index == 0 else home / light.replace(":", "-") for index, light in enumerate(demo.lights)]


def _files(demo: Demo, folder: Path) -> Iterator[Path]:
    """All that is written."""
    for home in _homes(demo, folder):
        yield from (home / REFERENCE, home / MAP)
        yield from (place / name for place in _places(demo, home) for name in (QUERY, BELIEFS, VIEWS))
    yield folder / REPORT


@contextmanager
def _beside() -> Iterator[Processes]:
    """A process that records later drives while this one drives the first and learns it."""
    process, ended = Processes(1, sharing=2), False
    try:
        yield process
        ended = True
    finally:
        process.close(at_once=not ended)


def _one_seed(demo: Demo, seed: int, home: Path, step: Step, beside: Processes) -> list[Comparison]:
    first = replace(demo.reference, seed=seed)
    later = [replace(first, light=light, seed=seed + QUERY_SEEDS) for light in demo.lights]
    places = _places(demo, home)
    drives = [_driven(beside, drive, place / QUERY) for drive, place in zip(later, places, strict=True)]
    reference = record(first, home / REFERENCE, step(f"drive at {first.light}"))
    step("learn")
    map_ = learn(reference.views, profile=demo.profile, metadata=reference.metadata)
    map_.save(home / MAP)
    known = Places.of(map_, reference.views)
    comparisons = []
    for light, place, drive in zip(demo.lights, places, drives, strict=True):
        step(f"await the drive at {light}")
        if (error := drive.result()) is not None:
            raise error
        query = read_recording(place / QUERY)
        step("localise")
        comparison = compare(f"{first.light} → {light}", map_, query, reference=reference.views)
        write_beliefs(place / BELIEFS, query.views, comparison.beliefs, query.metadata)
        layer = LocaliserLayer("beliefs", tuple(comparison.beliefs), known)
        tabs: list[Tab] = [
            MapTab(map_, reference.views),
            LocaliseTab(query.views, [layer], {layer.name: comparison.beliefs}),
        ]
        write_recording(place / VIEWS, tabs, name=comparison.name, active=1)
        comparisons.append(comparison)
    return comparisons


def _driven(beside: Processes, drive: Drive, file: Path) -> "Future[BaseException | None]":
    """Record a drive in the other process; in the end there is the error that it ended with, if any."""
    return beside.call(lambda error: error, None, _recorded, drive, file)


def _recorded(drive: Drive, file: Path) -> None:
    record(drive, file, whole=False)
