"""Pictures of a map's views, read again from the recordings that its paths were learnt from: a map keeps none."""

import logging
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from refseq.errors import LogError
from refseq.logs import ViewPlan, open_log, plan_views
from refseq.logs.pairing.plan import SAME_TIME
from refseq.map.map import Map
from refseq.map.paths.path import MapPath
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.report.images import picture

SOURCE = "source"
"""Note of a learnt map: the name of its recording."""

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
                    found |= _pictures(path, _recording(map_, path.name, recordings), views)
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


def _pictures(path: MapPath, recording: Path, views: Sequence[int]) -> ViewPictures:
    """Pictures of some views of a path, in the order of their numbers. Raises ``ScenarioError`` and ``LogError``."""
    if not len(path.times):
        raise ScenarioError("its map is of before, and does not tell when its views were taken; valid is to learn anew")
    plan = plan_views(open_log(recording))
    _check_times(plan, path, recording)
    read = plan.at(path.times[list(views)].tolist()).read()
    return {
        (path.name, number): {camera: picture(image) for camera, image in sorted(view.images.items())}
        for number, view in zip(views, read, strict=True)
        if view.images
    }


def _check_times(plan: ViewPlan, path: MapPath, recording: Path) -> None:
    """Raise ``ScenarioError`` for a recording that lacks a view of a path: another drive may have the same name."""
    there = np.array([view.time for view in plan.views])
    off = _off(there, path.times)
    if (missed := np.flatnonzero(off > SAME_TIME)).size:
        view = int(missed[0])
        raise ScenarioError(
            f"{recording} has no view at {path.times[view]:.6f} s, as view {view} is; valid is the recording that the "
            "map was learnt from"
        )


def _off(there: NDArray[np.float64], times: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance of each of some times to the nearest of those that are ``there``, (K,) [s]."""
    rising = np.sort(there)
    after = np.clip(np.searchsorted(rising, times), 0, len(rising) - 1)
    return np.minimum(np.abs(rising[after] - times), np.abs(rising[np.maximum(after - 1, 0)] - times))
