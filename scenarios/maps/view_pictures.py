"""Pictures of a map's views, read again from the recordings that its paths were learnt from: a map keeps none."""

import logging
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

import numpy as np

from refseq.errors import LogError
from refseq.map.map import Map
from refseq.map.paths.path import MapPath
from refseq_bench.scenarios.drives.learnt_views import SOURCE, learnt_plan
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.report.images import picture

ViewPictures = Mapping[tuple[str, int], Mapping[str, str]]
"""Pictures as data URIs, by path and view, then by camera; a view without any is left out."""


def check_recordings(recordings: Sequence[Path]) -> None:
    """Raise ``ScenarioError`` for a recording, or a folder of them, that is not there."""
    for path in recordings:
        if not path.exists():
            raise ScenarioError(f"{path}: is not there; valid is a recording, or a folder with recordings")


def view_pictures(
    maps: Sequence[Map], recordings: Sequence[Path], wanted: Mapping[str, Collection[int]]
) -> ViewPictures:
    """Pictures of the views ``wanted`` of some paths of maps, by all cameras of their recordings.

    ``recordings`` are files, or folders that hold them. Where the recording of a path is not among them, or is not the
    one that it was learnt from, a warning says so, and the path has no pictures.
    """
    found: dict[tuple[str, int], Mapping[str, str]] = {}
    for map_ in maps:
        for path in map_.paths:
            if len(views := sorted(set(wanted.get(path.name, ())))):
                try:
                    found |= _pictures(map_, path, _recording(map_, path.name, recordings), views)
                except (LogError, ScenarioError) as error:
                    logging.getLogger(__name__).warning("no pictures of %s: %s", path.name, error)
    return found


def _recording(map_: Map, name: str, recordings: Sequence[Path]) -> Path:
    """The recording that a path was learnt from, by the name that its map noted. Raises ``ScenarioError``."""
    notes = map_.sequences[map_.names.index(name)].metadata if name in map_.names else {}
    if SOURCE not in notes:
        raise ScenarioError("its map does not tell which recording it was learnt from; valid is one of `refseq learn`")
    source = notes[SOURCE]
    for given in recordings:
        beneath = given / source
        if given.name == source or beneath.exists():
            return given if given.name == source else beneath
    raise ScenarioError(f"its recording {source} is not among {', '.join(map(str, recordings))}")


def _pictures(map_: Map, path: MapPath, recording: Path, views: Sequence[int]) -> ViewPictures:
    """Pictures of some views of a path, in the order of their numbers. Raises ``ScenarioError`` and ``LogError``."""
    read = learnt_plan(map_, path, recording, np.array(views, np.intp)).read()
    return {
        (path.name, number): {camera: picture(image) for camera, image in sorted(view.images.items())}
        for number, view in zip(views, read, strict=True)
        if view.images
    }
