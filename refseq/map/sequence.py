"""The reference sequence: what a first drive becomes, and what later drives are localised in."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from refseq.errors import MapError
from refseq.features import Extractor, make_extractors
from refseq.inference.chain.emissions import Emissions
from refseq.inference.matching.incidence import IncidenceMatrix
from refseq.inference.matching.log_ratio import LogRatioModel
from refseq.inference.matching.mixture import Match, match_view
from refseq.map.annotations import Guide, guide_of
from refseq.map.profile import Profile
from refseq.planar import Pose
from refseq.view import View


@dataclass(frozen=True)
class ReferenceSequence:
    """Places along a path.

    ``matrix`` is the feature incidence matrix (N, K), ``extractors`` give its features in the order of its rows,
    ``along`` (K,) is each place's odometric distance from the first [m], rising; ``poses`` the true poses of the places
    where they are known (for scoring and drawing only); ``metadata`` says which drive it was. ``guide`` is what
    missions need of the path beside.
    """

    matrix: IncidenceMatrix
    extractors: tuple[Extractor, ...]
    along: NDArray[np.float64]
    poses: tuple[Pose | None, ...]
    profile: Profile = field(default_factory=Profile)
    metadata: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    guide: Guide = field(default_factory=Guide)

    def __len__(self) -> int:
        return self.matrix.K

    @property
    def sensors(self) -> frozenset[str]:
        """Sensors that the map can be asked with."""
        return frozenset(extractor.sensor for extractor in self.extractors)

    def match(self, ids: NDArray[np.intp], seed: tuple[int, ...]) -> Match:
        """Compare features (rows of the matrix) with all places; ``seed`` starts the mixture's random components."""
        return match_view(self.matrix.visible(ids), self.profile.mixture, np.random.default_rng(seed))

    @cached_property
    def emissions(self) -> Emissions:
        """What each place emits: the sequence compared with itself (H3)."""
        posteriors = (
            self.match(ids, (EMISSION_SEED, place)).likelihood for place, ids in enumerate(self.matrix.columns())
        )
        return Emissions.from_posteriors(posteriors, self.profile.chain)

    @cached_property
    def log_ratio_model(self) -> LogRatioModel:
        """How the features show up, and what they are worth (docs/best.md)."""
        return LogRatioModel(self.matrix, self.along, self.profile.log_ratio)


EMISSION_SEED = 20080
"""Any number will do: it keeps the same map's emissions the same wherever it is loaded."""


def learn(
    views: Sequence[View],
    *,
    sensors: Sequence[str] | None = None,
    features: Sequence[str] | None = None,
    profile: Profile | None = None,
    metadata: Mapping[str, str] | None = None,
) -> ReferenceSequence:
    """Make a reference sequence of a drive, one place a view, with all its sensors or only ``sensors``.

    ``features`` are names of ``refseq.features.FEATURES``, by default the profile's. Raises ``MapError`` when there is
    no view, when a sensor asked for is in none of them, and when a feature is unknown or none fits the sensors.
    """
    profile = profile or Profile()
    extractors = make_extractors(features or profile.features, check_sensors(views, sensors, "the drive"), profile)
    columns = [
        {extractor.key: extractor.learn(view) for extractor in extractors if extractor.sensor in view.sensors}
        for view in views
    ]
    matrix = IncidenceMatrix.from_columns(columns, {extractor.key: extractor.size for extractor in extractors})
    along = np.cumsum([0.0] + [abs(view.distance) for view in views[1:]])
    poses = tuple(view.truth for view in views)
    told = MappingProxyType(dict(metadata or {}))
    return ReferenceSequence(matrix, extractors, along, poses, profile, told, guide_of(views))


def check_sensors(views: Sequence[View], wanted: Sequence[str] | None, what: str) -> tuple[str, ...]:
    """The sensors to use, sorted; raises ``MapError`` for one that no view has."""
    if not views:
        raise MapError(f"{what} holds no view; valid is at least one")
    there = frozenset().union(*(view.sensors for view in views))
    for sensor in wanted or ():
        if sensor not in there:
            raise MapError(f"sensor {sensor!r} is not in {what}; valid are {', '.join(sorted(there)) or 'none'}")
    return tuple(sorted(set(wanted or there)))
