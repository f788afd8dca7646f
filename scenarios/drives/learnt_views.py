"""Views that a map was learnt from, found again in their recording by the times that the map keeps."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from refseq_bench.scenarios.drives.inputs import (
    WHOLE,
    DriveSelection,
    delays,
    plan_drive,
    read_answers,
    read_drive,
    read_map,
)
from refseq_bench.scenarios.errors import ScenarioError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from refseq.logs import ViewPlan
    from refseq.map.map import Map
    from refseq.map.paths.path import MapPath
    from refseq.view import View
    from refseq_bench.scenarios.scoring.comparison import Comparison

SOURCE = "source"
"""Note of a learnt map: the name of its recording."""
READ_WITH = ("topics", "tolerance", "late")
"""Choices that say what belongs to a view: a recording has other views, or sensors of other names, without them."""
NOTED = "read_with_"
"""Begins the key of a map's note on each of these."""


def reading_notes(selection: DriveSelection) -> dict[str, str]:
    """Notes for a map on how the drive was read that it is learnt from: what differs from the usual."""
    told = {**{name: getattr(selection, name) for name in READ_WITH}, "late": _late_sensors(selection)}
    return {f"{NOTED}{name}": str(value) for name, value in told.items() if value is not None}


def _late_sensors(selection: DriveSelection) -> str | None:
    """Delays of the selection without the truth's, which says nothing of views; None without any."""
    from refseq.logs import Role

    late = {name: seconds for name, seconds in delays(selection).items() if name != Role.TRUTH}
    return ",".join(f"{name}={seconds}" for name, seconds in late.items()) or None


def learnt_notes(recording: Path, metadata: Mapping[str, str], selection: DriveSelection) -> dict[str, str]:
    """Metadata of a map that is learnt from a recording: the drive's, the recording's name, and how it is read.

    Notes on another reading, or of a stranger, are left out.
    """
    its = {key: value for key, value in metadata.items() if not key.startswith(NOTED)}
    return {**its, SOURCE: recording.name, **reading_notes(selection)}


def place_views(map_: "Map", map_file: Path, recording: Path) -> "tuple[View, ...]":
    """The views that the places of a map of one path were learnt from, with their pictures, (K,).

    Motion and true pose are the map's own: it may have been learnt with noise, or with poses of another file. Raises
    ``ScenarioError`` for a map of several paths, and for another recording than its own.
    """
    from refseq_bench.scenarios.drives.evaluate import places_as_views

    if not map_.has_one_path:
        raise ScenarioError(
            f"{recording}: has the pictures of one drive, {map_file} is a map of several; valid is no reference"
        )
    views = learnt_plan(map_, map_.paths[0], recording, map_.learnt).read()
    return tuple(
        replace(view, distance=place.distance, truth=place.truth)
        for view, place in zip(views, places_as_views(map_), strict=True)
    )


def learnt_plan(map_: "Map", path: "MapPath", recording: Path, views: "NDArray[np.intp]") -> "ViewPlan":
    """The plan of some of a path's ``views``, rising, in the recording that it was learnt from.

    A map of an earlier version has no times: of it all views of the recording have to be the path's. Raises
    ``ScenarioError`` for a recording that lacks a view.
    """
    from refseq.logs import open_log

    reading = _reading_of(map_, path)
    plan = plan_drive(open_log(recording), reading)
    if len(path.times):
        _check_times(plan, path, recording)
        return plan.at(path.times[views].tolist())
    if len(plan) != len(path):
        raise ScenarioError(
            f"{recording}: has {len(plan)} views, the map {len(path)} places and no times of them, as maps of earlier "
            "versions have none; valid is a map that is learnt anew"
        )
    return plan.at([plan.views[view].time for view in views.tolist()])


def _reading_of(map_: "Map", path: "MapPath") -> DriveSelection:
    """Selection by which the drive of a path was read, from the notes of its map."""
    notes = map_.sequences[map_.names.index(path.name)].metadata if path.name in map_.names else {}
    told = {name: notes.get(f"{NOTED}{name}") for name in READ_WITH}
    try:
        tolerance = None if told["tolerance"] is None else float(told["tolerance"])
    except ValueError:
        raise ScenarioError(
            f"{path.name}: its map notes a tolerance of {told['tolerance']!r:.40}; valid is a number of seconds"
        ) from None
    return DriveSelection(topics=told["topics"], tolerance=tolerance, late=told["late"])


def _check_times(plan: "ViewPlan", path: "MapPath", recording: Path) -> None:
    """Raise ``ScenarioError`` for a recording that lacks a view of a path: another drive may have the same name."""
    import numpy as np

    from refseq.logs.pairing.plan import SAME_TIME

    off = _off(np.array([view.time for view in plan.views]), path.times)
    if (missed := np.flatnonzero(off > SAME_TIME)).size:
        view = int(missed[0])
        raise ScenarioError(
            f"{recording}: has no view at {path.times[view]:.6f} s, as view {view} of the map's {len(path)} is; valid "
            "is the recording that the map was learnt from"
        )


def _off(there: "NDArray[np.float64]", times: "NDArray[np.float64]") -> "NDArray[np.float64]":
    """Distance of each of some times to the nearest of those that are ``there``, (K,) [s]."""
    import numpy as np

    rising = np.sort(there)
    after = np.clip(np.searchsorted(rising, times), 0, len(rising) - 1)
    return np.minimum(np.abs(rising[after] - times), np.abs(rising[np.maximum(after - 1, 0)] - times))


def read_comparison(
    map_file: Path,
    query: Path,
    beliefs: Path,
    reference: Path | None,
    selection: DriveSelection = WHOLE,
) -> "Comparison":
    """A localised drive put together again from its files; the pictures of its places are those of ``reference``."""
    from refseq_bench.scenarios.drives.evaluate import comparison_of

    map_ = read_map(map_file)
    places = place_views(map_, map_file, reference) if reference else None
    found = read_answers(beliefs)
    drive = read_drive(query, replace(selection, times=found.times))
    try:
        return comparison_of(f"{map_file.name} ← {query.name}", map_, drive, found.beliefs, places)
    except ScenarioError as error:
        raise ScenarioError(f"{beliefs}: {error}") from error
