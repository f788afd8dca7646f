"""The reference sequence (chapter 2): the places of one path, and which features each of them showed."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from refseq.errors import MapError
from refseq.features import Extractor
from refseq.inference.chain.emissions import Emissions
from refseq.inference.chain.lost_view import HeldOutViews, LostView
from refseq.inference.matching.incidence import IncidenceMatrix
from refseq.inference.matching.log_ratio import LogRatioModel, LogRatios
from refseq.inference.matching.mixture import Match, match_view
from refseq.map.growth.experiences import Experiences, LayeredRatios
from refseq.map.profile import Profile
from refseq.planar import Pose

EMISSION_SEED = 20080
"""Any number will do: it keeps the same map's emissions the same wherever it is loaded."""


@dataclass(frozen=True, eq=False)
class ReferenceSequence:
    """Places along a path.

    ``matrix`` is the feature incidence matrix (N, K), ``extractors`` give its features in the order of its rows,
    ``along`` (K,) is each place's odometric distance from the first [m], rising; ``poses`` the true poses of the places
    where they are known (for scoring and drawing only); ``metadata`` says which drive it was. ``odometry`` (K, 3) are
    the places' poses by the drive's own odometry, from its first view on: x, y [m] and heading [rad]; (0, 3) where the
    drive had none. ``experiences`` are what places showed on later drives, None where none was added.
    """

    matrix: IncidenceMatrix
    extractors: tuple[Extractor, ...]
    along: NDArray[np.float64]
    poses: tuple[Pose | None, ...]
    profile: Profile = field(default_factory=Profile)
    metadata: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    odometry: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 3)))
    experiences: Experiences | None = None

    def __len__(self) -> int:
        return self.matrix.K

    @property
    def sensors(self) -> frozenset[str]:
        """Sensors that the sequence can be asked with."""
        return frozenset(extractor.sensor for extractor in self.extractors)

    def match(self, ids: NDArray[np.intp], seed: tuple[int, ...]) -> Match:
        """Compare features (rows of the matrix) with all places; ``seed`` starts the mixture's random components.

        With ``mixture.all_features`` what a sensor shows that the view lacks counts as not seen.
        """
        settings, rng = self.profile.mixture, np.random.default_rng(seed)
        if not settings.all_features:
            return match_view(self.matrix.visible(ids), settings, rng)
        observed = np.zeros(self.matrix.N, np.bool_)
        observed[ids] = True
        return match_view(self.matrix.visible(np.arange(self.matrix.N)), settings, rng, observed)

    @cached_property
    def emissions(self) -> Emissions:
        """Emissions of each place: the sequence compared with itself (H3)."""
        posteriors = (
            self.match(ids, (EMISSION_SEED, place)).likelihood for place, ids in enumerate(self.matrix.columns())
        )
        learnt = self.profile.chain.lost_view is LostView.LEARNT
        held_out = HeldOutViews(self.along, self.profile.log_ratio.apart) if learnt else None
        return Emissions.from_posteriors(posteriors, self.profile.chain, held_out)

    @cached_property
    def log_ratio_model(self) -> LogRatioModel:
        """Log ratios of the features, calibrated on this sequence (docs/best.md)."""
        return LogRatioModel(self.matrix, self.along, self.profile.log_ratio)

    @cached_property
    def layered_ratios(self) -> LayeredRatios | None:
        """Log ratios over all experiences of the places; None where there is but the first."""
        if self.experiences is None:
            return None
        settings = self.profile.log_ratio
        return LayeredRatios(self.log_ratio_model, self.matrix, self.along, settings, self.experiences)

    def ratios(self, observed: Mapping[str, NDArray[np.intp]]) -> LogRatios:
        """Log-likelihood ratios of each place to elsewhere, by all its experiences."""
        return (self.layered_ratios or self.log_ratio_model).ratios(observed)


def check_comparable(one: ReferenceSequence, other: ReferenceSequence) -> None:
    """Raise ``MapError`` where sequences have other features or settings: their words then mean other things."""
    theirs, ours = (", ".join(extractor.key for extractor in each.extractors) for each in (other, one))
    if theirs != ours:
        raise MapError(f"features are {theirs}; valid are those of the first map, {ours}")
    its = dict(_leaves("profile", other.profile.to_dict()))
    for name, value in _leaves("profile", one.profile.to_dict()):
        if value != its[name]:
            raise MapError(f"{name} is {its[name]}; valid is that of the first map, {value}")


def _leaves(name: str, content: object) -> Iterator[tuple[str, object]]:
    """The settings of a profile by their whole names."""
    if not isinstance(content, Mapping):
        yield name, content
        return
    for key, value in content.items():
        yield from _leaves(f"{name}.{key}", value)
