"""New paths of a map, made of what a drive shows beside it: learnt, written beside the map, and merged with it."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from refseq.atlas.explore import ExploredPath
from refseq.atlas.merge import Merged, merge_maps
from refseq.map.map import Map
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.maps import members
from refseq_bench.scenarios.maps.checks import in_order, read_maps


@dataclass(frozen=True)
class Exploration:
    """A map with new paths, ``whole``; how it came about, and the maps that it was made of, which were ``read``."""

    whole: Map
    merged: Merged
    read: Sequence[Map]


def check_target(map_file: Path, map_: Map, target: Path) -> None:
    """Raise ``ScenarioError`` where the larger map would be written over the only file of a path that it is made of."""
    if map_.has_one_path and target.exists() and target.samefile(map_file):
        raise ScenarioError(f"{target}: becomes one path of the larger map; valid is --output with another name")


def explored_map(map_file: Path, found: Sequence[ExploredPath], target: Path) -> Exploration:
    """Merge a map with new paths, and write these beside ``target``, then the larger map as ``target``.

    A map that was merged before is taken apart into its members, as ``refseq map merge`` does. Raises what that does,
    and ``ScenarioError`` for a file of a new path that is there already. Then nothing is written; where a file
    cannot be, none stays.
    """
    files, before, loaded = members.with_members([map_file])
    new = [target.with_name(f"{one.map.names[0]}.refseq") for one in found]
    if there := next((file for file in new if file.exists()), None):
        raise ScenarioError(f"{there}: is there already, and a new path would have its name; valid is to rename one")
    read = [*read_maps(files, before, loaded=loaded), *(one.map for one in found)]
    wishes = in_order(before, read)
    merged = merge_maps(read, wishes=wishes)
    with _all_or_none(new):
        for file, one in zip(new, found, strict=True):
            one.map.save(file)
        whole = members.with_record(merged, read, [*files, *new], target, wishes)
        whole.save(target)
    return Exploration(whole, merged, read)


@contextmanager
def _all_or_none(files: Sequence[Path]) -> Iterator[None]:
    """Remove ``files``, none of which was there before, where the block fails: they would bar a second try."""
    try:
        yield
    except BaseException:
        for file in files:
            file.unlink(missing_ok=True)
        raise
