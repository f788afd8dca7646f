"""Sources of views: a drive to simulate, a log, or a folder of images."""

from collections.abc import Sequence
from pathlib import Path

from refseq_bench.scenarios.campaign.declare.real_recordings import Images, Log
from refseq_bench.scenarios.drives.record import Drive, name_of_route

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
