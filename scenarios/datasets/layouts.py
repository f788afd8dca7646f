"""Layouts of published data sets: which folders are reference and query, and where the ground truth is."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

from refseq_bench.scenarios.errors import ScenarioError

REFERENCES = ("ref", "reference", "references", "database", "db", "gallery", "truth")
QUERIES = ("query", "queries", "q")
TRUTH_FILES = ("ground_truth.csv", "ground_truth.npy", "ground_truth.npz", "GT.npz", "ground_truth_new.npy")


@dataclass(frozen=True, slots=True)
class Layout:
    """A data set's folders: ``pairs`` of reference and query in its own, and a rule of ground truth, if it has one."""

    name: str
    pairs: tuple[tuple[str, str], ...]
    truth: str | None = None
    about: str = ""


SEASONS = ("spring", "summer", "fall", "winter")

LAYOUTS: tuple[Layout, ...] = (
    Layout(
        "gardens-point",
        (("day_left", "day_right"), ("day_right", "night_right"), ("day_left", "night_right")),
        "frame±2",
        "Gardens Point Walking, as VPR_Tutorial has it too",
    ),
    Layout(
        "nordland",
        tuple(combinations(SEASONS, 2)),
        "frame±10",
        "seasons of one railway line, picture k of each at one place",
    ),
    Layout("st-lucia", (("100909_0845", "180809_1545"),), None, "St Lucia, with GT.npz, as VPR_Tutorial has it"),
    Layout("sfu", (("dry", "jan"),), None, "SFU Mountain, with GT.npz, as VPR_Tutorial has it"),
    Layout(
        "vpr-bench",
        tuple((reference, query) for reference in REFERENCES for query in QUERIES),
        None,
        "a folder ref and a folder query, and ground_truth.csv, .npy or GT.npz",
    ),
)


@dataclass(frozen=True, slots=True)
class DatasetPair:
    """A reference folder, a query folder, and the ground truth that the data set has for them: a rule or a file."""

    reference: Path
    query: Path
    truth: str | None


def is_dataset(path: Path) -> bool:
    """Tell whether a folder is laid out as a data set, or holds some that are."""
    return path.is_dir() and any(_found(path, None))


def dataset_pairs(path: Path, layout: str | None = None) -> tuple[DatasetPair, ...]:
    """The pairs of drives in a data set's folder, or in those below it. Raises ``ScenarioError`` without any."""
    names = [one.name for one in LAYOUTS]
    if layout is not None and layout not in names:
        raise ScenarioError(f"layout {layout!r} is unknown; valid are {', '.join(names)}")
    if not path.is_dir():
        raise ScenarioError(f"{path}: is no folder; valid is that of a data set")
    found = tuple(_found(path, layout))
    if not found:
        wanted = [one for one in LAYOUTS if layout in (None, one.name)]
        folders = "; ".join(f"{one.name}: {' and '.join(one.pairs[0])}" for one in wanted)
        there = ", ".join(sorted(entry.name for entry in path.iterdir() if entry.is_dir())[:8]) or "none"
        raise ScenarioError(f"{path}: is laid out as no data set (its folders: {there}); valid are {folders}")
    return found


def _found(path: Path, layout: str | None) -> Iterator[DatasetPair]:
    own = tuple(_pairs(path, layout))
    yield from own
    if not own:
        for below in sorted(entry for entry in path.iterdir() if entry.is_dir()):
            yield from _pairs(below, layout)


def _pairs(path: Path, layout: str | None) -> Iterator[DatasetPair]:
    """Pairs of the first layout of which the folder has one."""
    for one in LAYOUTS:
        if layout not in (None, one.name):
            continue
        there = [pair for pair in one.pairs if all((path / name).is_dir() for name in pair)]
        for reference, query in there:
            yield DatasetPair(path / reference, path / query, _truth_file(path) or one.truth)
        if there:
            return


def _truth_file(path: Path) -> str | None:
    return next((str(path / name) for name in TRUTH_FILES if (path / name).is_file()), None)
