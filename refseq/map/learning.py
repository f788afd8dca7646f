"""Learning a map: a first drive becomes a reference sequence, one place a view (familiarisation)."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from numbers import Integral
from types import MappingProxyType

import numpy as np

from refseq.dead_reckoning import dead_reckoned, way_along
from refseq.errors import MapError, ViewError
from refseq.features.extractor import Extractor
from refseq.features.neural.words import NeuralWords, pinned
from refseq.features.sift import NO_KEYS, SiftWords
from refseq.features.word_extractor import PictureKeys
from refseq.inference.matching.incidence import IncidenceMatrix
from refseq.intake import check_motions, each_view, names_in, usable
from refseq.map.extractors import make_extractors
from refseq.map.map import Map
from refseq.map.paths.annotations import annotations_of
from refseq.map.paths.keys import PathKeys
from refseq.map.profile import THESIS, Profile, profile_of
from refseq.map.reduction import with_most_informative
from refseq.map.sequence import ReferenceSequence
from refseq.scan_matching.panorama import panoramas
from refseq.view import LASER, View


def learn(
    views: Iterable[View],
    *,
    profile: Profile | str = THESIS,
    sensors: Sequence[str] | None = None,
    features: Sequence[str] | None = None,
    metadata: Mapping[str, str] | None = None,
    name: str = "",
    most_informative: int | None = None,
) -> Map:
    """Make a map of a drive: one path, one place a view.

    ``profile`` is one of ``refseq.map.profile.PROFILES`` by its name, or one of your own. ``sensors`` are those to
    learn, by default all that a view has; without the laser among them the path has no doors. ``features`` are names of
    ``refseq.map.extractors.FEATURES``, by default the profile's. ``metadata`` say which drive it was, ``name`` is the
    path's; a path without one takes its file's. With ``most_informative`` only so many words are kept, those that tell
    most about the place (2.6).

    Raises ``MapError`` where there is no view, where no word is to be kept, where a sensor asked for is in none of the
    views, where the profile is unknown or has a value that is not valid, where a feature is unknown or none fits the
    sensors, and where a feature asks a neural network and there is none; also where the views are one place, or the
    odometry does not tell them apart. Raises ``ViewError`` for a view that is not ``usable``, for a motion that is no
    finite number, for a behaviour that begins nowhere, for a laser that no beam came back to, and where nothing is
    seen.
    """
    if most_informative is not None and not (isinstance(most_informative, Integral) and most_informative >= 1):
        raise MapError(f"{most_informative} words are to be kept; valid is a whole number of at least 1")
    if not isinstance(name, str) or name.splitlines() not in ([], [name]):
        raise MapError(f"the path's name is {name!r:.60}; valid is a text of one line")
    drive = list(each_view(views))
    chosen = profile_of(profile)
    wanted = check_sensors(drive, names_in(sensors), "the drive")
    return learn_stretch(drive, wanted, names_in(features) or chosen.features, chosen, metadata, name, most_informative)


def learn_stretch(
    drive: list[View],
    wanted: Sequence[str],
    names: Sequence[str],
    chosen: Profile,
    metadata: Mapping[str, str] | None,
    name: str,
    most_informative: int | None = None,
) -> Map:
    """Make a map as ``learn`` does, of ``sound`` views that may lack some of the sensors ``wanted``.

    Raises ``MapError`` and ``ViewError`` as ``learn`` does.
    """
    if any(sensor != LASER for sensor in wanted):
        chosen = with_network(chosen, names)
    extractors = make_extractors(names, wanted, chosen)
    check_motions(drive)
    check_way(drive)
    annotations = annotations_of(drive if LASER in wanted else [replace(view, scan=None) for view in drive])
    columns, keys = [], _KeysOnTheWay(extractors if chosen.log_ratio.geometry else ())
    for view in (usable(one, wanted) for one in drive):
        columns.append({one.key: one.learn(view) for one in extractors if one.sensor in view.sensors})
        keys.add(view)
    there = frozenset[str]().union(*(view.sensors for view in drive))
    check_seen(drive, [one for one in extractors if one.sensor in there])
    matrix = IncidenceMatrix.from_columns(columns, {extractor.key: extractor.size for extractor in extractors})
    along = way_along(drive)
    poses = tuple(view.truth for view in drive)
    notes = MappingProxyType(dict(metadata or {}))
    sequence = ReferenceSequence(matrix, extractors, along, poses, chosen, notes, dead_reckoned(drive))
    if most_informative is not None:
        sequence = with_most_informative(sequence, most_informative)
    scans = panoramas(drive if LASER in wanted else [])
    times = np.array([view.time for view in drive], np.float64)
    return Map.of(sequence, name, annotations, scans, times, keys.learnt())


def with_network(profile: Profile, features: Sequence[str] | None = None) -> Profile:
    """A profile with the user's neural network named, where one is asked. Raises ``MapError`` without one."""
    return replace(profile, neural=pinned(profile.neural)) if profile.asks_network(features) else profile


class _KeysOnTheWay:
    """Keys of each camera that some extractors find words of, view by view."""

    def __init__(self, extractors: Sequence[Extractor]) -> None:
        self._words = [one for one in extractors if isinstance(one, SiftWords)]
        self._found: dict[str, list[PictureKeys]] = {one.sensor: [] for one in self._words}

    def add(self, view: View) -> None:
        for one in self._words:
            self._found[one.sensor].append(one.shown(view) if one.sensor in view.sensors else NO_KEYS)

    def learnt(self) -> Mapping[str, PathKeys]:
        return {camera: PathKeys.of(views) for camera, views in self._found.items()}


def check_way(views: Sequence[View]) -> None:
    """Raise ``MapError`` for views that make no path: a single one, or views with no distance between them."""
    length = float(way_along(views)[-1])
    if length > 0:
        return
    if not any(view.has_odometry for view in views):
        cause = "there is no odometry on any topic"
    elif len(views) == 1:
        cause = "the drive holds a single view, or thinning left one"
    else:
        cause = "the odometry never moves"
    places = f"{len(views)} place{'s' * (len(views) > 1)}"
    raise MapError(
        f"a map would have {places} over {length:.1f} m: {cause}; "
        "valid are two views or more with odometry between them"
    )


def check_seen(views: Sequence[View], extractors: Sequence[Extractor]) -> None:
    """Raise ``ViewError`` for a laser that no beam came back to, and where no picture has any feature.

    A camera that saw bare walls says nothing later on; a blind laser would speak against every place.
    """
    sensors = {extractor.sensor for extractor in extractors}
    neural = [extractor for extractor in extractors if isinstance(extractor, NeuralWords)]
    if neural and not any(extractor.size for extractor in neural):
        floor = neural[0].settings.floor
        raise ViewError(f"no picture of {len(views)} views has a key of score {floor:g}; valid is a lower neural.floor")
    if LASER in sensors and not any(view.scan is not None and view.scan.returned.any() for view in views):
        raise ViewError(f"laser: no beam came back in any of {len(views)} views; valid is to learn from the others")
    if not any(extractor.size for extractor in extractors):
        raise ViewError(f"{', '.join(sorted(sensors))}: nothing is seen in any of {len(views)} views")


def check_sensors(views: Sequence[View], wanted: Sequence[str] | None, what: str) -> tuple[str, ...]:
    """The sensors to use, sorted; raises ``MapError`` for one that no view has."""
    if not views:
        raise MapError(f"{what} holds no view; valid is at least one")
    there = frozenset().union(*(view.sensors for view in views))
    for sensor in wanted or ():
        if sensor not in there:
            raise MapError(f"sensor {sensor!r} is not in {what}; valid are {', '.join(sorted(there)) or 'none'}")
    return tuple(sorted(set(wanted or there)))
