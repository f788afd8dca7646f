"""Where two sequences run through the same places: stretches that both find in each other (4.4.1, 4.4.2).

Localising the views of one sequence in the other says where it runs along it, but a chain may be wrong about where it
comes off. So each is localised in the other, and only what both say alike counts.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from refseq.alignment import Alignment, align
from refseq.errors import MapError
from refseq.profile import Matching
from refseq.sequence import ReferenceSequence
from refseq.similarity import Translation, translated
from refseq.view import LASER

TOLD: Mapping[Matching, float] = MappingProxyType({Matching.EVIDENCE: 0.9, Matching.MIXTURE: 0.3})
"""What every camera has to tell for an overlap [nats a view]; chosen in the world ``annex``, see docs/atlas.md."""


@dataclass(frozen=True, slots=True)
class OverlapSettings:
    """What counts as running through the same places, all lengths in metres along the sequences.

    A view is matched where it is on the other sequence with probability above ``sure``, and the place that it is at
    leads back to within ``near`` of it. Matched views no farther apart than ``bridge`` make one stretch. It is an
    overlap where it is at least ``least`` long in both sequences, and neither length more than ``stretched`` times the
    other; where at least the share ``met`` of its views is matched, in either; and where each camera, if there are any,
    tells at least ``told`` [nats] a view for it: look-alikes deceive one camera, and the laser takes a corridor for its
    reverse. None is the profile's own measure, ``TOLD``.
    """

    sure: float = 0.5
    near: float = 2.5
    bridge: float = 3.0
    least: float = 5.0
    stretched: float = 1.5
    met: float = 0.6
    told: float | None = None

    def __post_init__(self) -> None:
        """Raise ``MapError`` for what is no probability or length."""
        if not 0 <= self.sure < 1:
            raise MapError(f"overlap.sure is {self.sure}; valid is at least 0 and less than 1")
        for name in ("near", "bridge", "least"):
            if not 0 <= getattr(self, name) < np.inf:
                raise MapError(f"overlap.{name} is {getattr(self, name)} m; valid is 0 or more")
        if not 1 <= self.stretched < np.inf:
            raise MapError(f"overlap.stretched is {self.stretched}; valid is 1 or more")


@dataclass(frozen=True, slots=True)
class Overlap:
    """A stretch of one sequence beside a stretch of another: ``pairs`` (n, 2) of places, rising in both.

    ``lengths`` are those of the two stretches [m]; ``told`` is what each sensor says for it [nats a view], the mean of
    log(likelihood · K) of the places that the views were matched with. ``objection`` says why it is none, if it is.
    """

    pairs: NDArray[np.intp]
    lengths: tuple[float, float]
    told: dict[str, float]
    objection: str = ""


def overlaps(
    one: ReferenceSequence, other: ReferenceSequence, settings: OverlapSettings | None = None
) -> list[Overlap]:
    """All stretches that two sequences seem to share, those that are objected to among them.

    Raises ``MapError`` for maps of other features or settings.
    """
    settings = settings or OverlapSettings()
    ways = translated(one, other), translated(other, one)
    there, back = map(align, ways)
    pairs = matched(one, there, back, settings)
    found = stretches(pairs, one.along, other.along, settings.bridge)
    return [_judged(trimmed(pairs), one, other, ways, settings) for pairs in found]


def matched(one: ReferenceSequence, there: Alignment, back: Alignment, settings: OverlapSettings) -> NDArray[np.intp]:
    """Places of one sequence and of the other that lead to each other, (n, 2)."""
    places = np.arange(len(one))
    returned = one.along[back.places[there.places]]
    agree = (there.on > settings.sure) & (back.on[there.places] > settings.sure)
    agree &= np.abs(returned - one.along) <= settings.near
    return np.stack([places[agree], there.places[agree]], axis=1)


def trimmed(pairs: NDArray[np.intp]) -> NDArray[np.intp]:
    """Pairs without those at the ends that repeat a place: there the other sequence had already ended."""
    new = np.append(True, np.diff(pairs[:, 1]) > 0)
    first = int(np.flatnonzero(pairs[:, 1] == pairs[0, 1])[-1])
    last = int(np.flatnonzero(new)[-1])
    return pairs[first : last + 1] if first <= last else pairs[:1]


def stretches(
    pairs: NDArray[np.intp], along: NDArray[np.float64], other: NDArray[np.float64], bridge: float
) -> list[NDArray[np.intp]]:
    """Pairs in runs: in a run both sequences go on, neither by more than ``bridge`` [m] without a pair."""
    if not len(pairs):
        return []
    steps = np.diff(along[pairs[:, 0]]), np.diff(other[pairs[:, 1]])
    broken = (steps[0] > bridge) | (steps[1] > bridge) | (steps[1] < 0)
    return np.split(pairs, np.flatnonzero(broken) + 1)


def _judged(
    pairs: NDArray[np.intp],
    one: ReferenceSequence,
    other: ReferenceSequence,
    ways: tuple[Translation, Translation],
    settings: OverlapSettings,
) -> Overlap:
    lengths = float(np.ptp(one.along[pairs[:, 0]])), float(np.ptp(other.along[pairs[:, 1]]))
    if min(lengths) < settings.least:
        return Overlap(pairs, lengths, {}, f"only {min(lengths):.1f} m long; valid is {settings.least:g} m")
    if max(lengths) > settings.stretched * min(lengths):
        return Overlap(pairs, lengths, {}, f"{lengths[0]:.1f} m beside {lengths[1]:.1f} m: not the same way")
    met = len(pairs) / (1 + max(np.ptp(pairs, axis=0)))
    if met < settings.met:
        return Overlap(
            pairs, lengths, {}, f"only {met:.0%} of the views lead to each other; valid is {settings.met:.0%}"
        )
    told = {sensor: _told(pairs, ways, sensor) for sensor in sorted(one.sensors)}
    cameras = [value for sensor, value in told.items() if sensor != LASER]
    least = TOLD[one.profile.method.matching] if settings.told is None else settings.told
    if cameras and min(cameras) < least:
        seen = ", ".join(f"{sensor} {nats:.2f}" for sensor, nats in told.items())
        return Overlap(pairs, lengths, told, f"cameras tell too little: {seen} nats a view; valid is {least:g} each")
    return Overlap(pairs, lengths, told)


def _told(pairs: NDArray[np.intp], ways: tuple[Translation, Translation], sensor: str) -> float:
    """What a sensor says for the pairs [nats a view], asked both ways; the greater, for a short map tells little."""
    there, back = ways
    return max(_told_by_views(there, pairs, sensor), _told_by_views(back, pairs[:, ::-1], sensor))


def _told_by_views(way: Translation, places: NDArray[np.intp], sensor: str) -> float:
    seen = list(way.sightings(sensors=[sensor]))
    likelihoods = np.array([seen[i].likelihood[j] for i, j in places])
    return float(np.log(likelihoods * len(way.to)).mean())
