"""New paths of a map, made of what a drive shows beside it: learnt, written beside the map, and merged with it."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from refseq.atlas.decision import Decision
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


@dataclass(frozen=True)
class Extensible:
    """A map to merge new paths with: the ``files`` that it is made of, as ``read``, and a person's ``wishes``."""

    files: Sequence[Path]
    read: Sequence[Map]
    wishes: Sequence[Decision]
    min_overlap: float | None


def extensible(map_file: Path, target: Path) -> Extensible:
    """Take a map apart into its members where it was merged, as ``refseq map merge`` does.

    Raises what that does, and ``ScenarioError`` where the larger map would be written over the only file of a path that
    it is made of.
    """
    parts = members.with_members([map_file], otherwise="")
    read = read_maps(parts.files, parts.decisions, loaded=parts.loaded)
    for file, one in zip(parts.files, read, strict=True):
        if one.has_one_path and target.exists() and target.samefile(file):
            raise ScenarioError(f"{target}: becomes one path of the larger map; valid is --output with another name")
    return Extensible(parts.files, read, in_order(parts.decisions, read), parts.min_overlap())


def explored_map(larger: Extensible, found: Sequence[ExploredPath], target: Path) -> Exploration:
    """Merge a map with new paths, and write these beside ``target``, then the larger map as ``target``.

    Raises what ``merge_maps`` does, and ``ScenarioError`` for a file of a new path that is there already. Then nothing
    is written; where a file cannot be, none stays.
    """
    new = [target.with_name(f"{one.map.names[0]}.refseq") for one in found]
    if there := next((file for file in new if file.exists()), None):
        raise ScenarioError(f"{there}: is there already, and a new path would have its name; valid is to rename one")
    read = [*larger.read, *(one.map for one in found)]
    merged = merge_maps(read, members.overlap_settings(larger.min_overlap), wishes=larger.wishes)
    with _all_or_none(new):
        for file, one in zip(new, found, strict=True):
            one.map.save(file)
        files = [*larger.files, *new]
        whole = members.with_record(merged, read, files, target, larger.wishes, larger.min_overlap)
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
