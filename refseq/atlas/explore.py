"""Exploring: a drive that leaves a map makes paths of the stretches that no place of it shows.

Each such path begins before the drive leaves the map and ends behind its return, so that merging finds both joins.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from refseq.inference.matching.incidence import feature_of
from refseq.intake import each_view
from refseq.map.growth.adding import GrowthSettings, check_drive, check_map
from refseq.map.growth.astray import Astray, AstraySettings, astray
from refseq.map.growth.seen import lost_in_hindsight, seen_drive
from refseq.map.learning import learn_stretch
from refseq.map.map import Map
from refseq.view import View


@dataclass(frozen=True)
class ExploredPath:
    """A stretch of a drive that leads off a map, and the map of one path that was learnt of it."""

    astray: Astray
    map: Map


def explore(
    map_: Map,
    views: Iterable[View],
    *,
    name: str = "",
    metadata: Mapping[str, str] | None = None,
    settings: AstraySettings | None = None,
    seed: int = 0,
) -> list[ExploredPath]:
    """Learn each stretch of a drive that leads off a map, as a path of its own with the map's sensors and profile.

    The maps can be merged with the one given (``refseq.atlas.merge.merge_maps``), which stays as it is. Paths are
    called ``name`` and a number from 1 on. A drive that stays on the map makes none. A stretch in which a sensor was
    away has nothing of that sensor, which tells for no join of it then.

    Raises ``MapError`` for a map whose matching is not by log ratios, for a drive of another robot, one that lacks a
    sensor of the map or is too short, and ``ViewError`` for views that are not usable.
    """
    drive = list(each_view(views))
    check_map(map_)
    check_drive(map_, drive, metadata or {}, GrowthSettings())
    lost = lost_in_hindsight(seen_drive(map_, drive, seed))
    features = list(dict.fromkeys(feature_of(one.key) for one in map_.sequences[0].extractors))
    return [
        ExploredPath(
            each,
            learn_stretch(
                drive[each.path.start : each.path.stop],
                sorted(map_.sensors),
                features,
                map_.profile,
                metadata,
                f"{name}-{number}",
            ),
        )
        for number, each in enumerate(astray(drive, lost, settings or AstraySettings()), start=1)
    ]
