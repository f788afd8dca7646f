"""Sources of views: a drive to simulate, a log, or a folder of images."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from refseq_bench.scenarios.drives.drive import Drive, name_of_route


@dataclass(frozen=True, slots=True)
class Log:
    """A real log: the ``views`` FROM:TO of it, one every ``thin`` [m] (0: all).

    ``noise`` is the seed of the noise that its odometry is given, None: none, for logs whose odometry is a real one.
    ``truth`` and ``odometry`` are a trajectory's file each or a topic of the log, None: the log's own. Files are looked
    for in the folder ``beside`` the scenario, then in that of real recordings. ``topics`` names sensors, name → topic;
    samples within ``tolerance`` [s] make one view; ``late`` is how late a sensor's stamps are, or the truth's [s].
    """

    file: str
    views: str | None = None
    thin: float = 0.0
    noise: int | None = None
    truth: str | None = None
    odometry: str | None = None
    topics: Mapping[str, str] = field(default_factory=dict)
    tolerance: float | None = None
    late: Mapping[str, float] = field(default_factory=dict)
    beside: Path | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class Images:
    """A folder of images of one camera, in the order of their names, looked for as a log is.

    There is no odometry: each view is ``spacing`` [m] after the last, and its true place is its number times that. The
    images are enlarged or shrunk to ``width`` [pixels].
    """

    folder: str
    spacing: float = 1.0
    width: int = 640
    beside: Path | None = field(default=None, compare=False)


Source = Drive | Log | Images


def names_of(sources: Sequence[Source]) -> tuple[str, ...]:
    """A name for each of some sources, by what was driven; one that comes again has its number behind."""
    found: list[str] = []
    for number, name in enumerate(map(_name, sources)):
        while name in found:
            name = f"{name} ({number + 1})"
        found.append(name)
    return tuple(found)


def _name(source: Source) -> str:
    match source:
        case Log(file, views):
            return Path(file).stem + (f" {views}" if views else "")
        case Images(folder):
            return Path(folder).name
    return name_of_route(source)
