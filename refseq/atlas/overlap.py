"""Where two sequences run through the same places: stretches that both find in each other (4.4.1, 4.4.2).

Localising the views of one sequence in the other says where it runs along it, but a chain may be wrong about where it
comes off. So each is localised in the other, and only what both say alike counts. Runs of few metres, which a chain
passes over, are looked for pair by pair (``refseq.atlas.runs``); and where a frame is known that both lie in, what lies
beside each other there.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property

import numpy as np
from numpy.typing import NDArray

from refseq.atlas.alignment import Alignment, align, told_by_likelihood
from refseq.atlas.runs import RunSettings, best_runs
from refseq.atlas.similarity import Translation, translated
from refseq.errors import MapError
from refseq.map.sequence import ReferenceSequence
from refseq.planar import wrapped
from refseq.view import LASER

SPACING = 1.0
"""Stretches may differ by so much more [m]: places lie so far apart, and a short stretch ends at one or the next."""


@dataclass(frozen=True, slots=True)
class OverlapSettings:
    """Settings of the search for overlaps, all lengths in metres along the sequences.

    A view is matched where it is on the other sequence with probability above ``sure``, and the place that it is at
    leads back to within ``near`` of it. Matched views no farther apart than ``bridge`` make one stretch; it is cut to
    the part in which the cameras tell most beyond ``told`` [nats a view], so that it ends where they fall silent.

    It is an overlap where it is at least ``least`` long in both sequences, and neither length more than ``stretched``
    times the other; where at least the share ``met`` of its views is matched, in either; where they are on the other
    sequence with a mean probability of ``surely``, whichever is asked; and where each camera tells ``told`` for it:
    look-alikes deceive one camera, and the laser takes a corridor for its reverse. Without cameras the laser has to
    tell as much. ``surely`` and ``told`` were chosen in the world ``annex``, see docs/atlas.md.

    An overlap that is only the share ``held`` of ``least`` long, or less surely on each other, is doubtful: it is one
    where other overlaps hold it (``refseq.atlas.consistency``). An overlap stands by itself where the mean of what the
    witnesses tell is ``clear`` [nats a view], and times its length ``alone`` [nats·m]: a corridor and its way back are
    alike a little, for long. It stands as well where the log ratios of its pairs, which count against a place none that
    look like it, have a mean of ``striking`` [nats].

    Below ``surely_held`` it is none.

    A path is back at a place of its own, a loop, where it has gone ``loop`` at least since; less would find places in
    their own neighbours.

    Where the laser's scans are known, those of an overlap have to lie on each other (``refseq.atlas.scans``): of the
    beams whose ends both can see the share ``alike`` has to meet walls for both, else it is none. Below ``same`` it is
    doubtful: full rooms do not come to ``same``, and bare corridors that are not one come to more than ``alike``. It is
    not where places tell ``vivid`` [nats a view] for it, and ``weighty`` [nats·m] in all: look-alikes tell as much for
    a few metres, or little for long. Scans that are alike to ``exact`` take all doubt from an overlap with evidence of
    ``walled`` [nats·m]. One that is alike to ``same`` is none where both paths go on beside each other, alike to less
    by ``worse`` (``refseq.atlas.beyond``).

    Short joins (``SHORT_JOINS``) are looked for besides: up to ``most`` stretches of a pair of paths, as ``runs`` says
    (0: none), and again, up to ``rounds`` times, where the frame of the joins so far lays paths beside each other.
    There a run needs ``laid`` [nats a view]. For each pair of views the frame tells ``expected`` [nats], less the
    farther it lays them apart, of which ``apart`` [m] is usual: nothing where that is ``reach`` of its standard
    deviations, or where it turns them by more than ``askew`` [rad].
    """

    sure: float = 0.5
    near: float = 2.5
    bridge: float = 3.0
    least: float = 5.0
    stretched: float = 1.5
    met: float = 0.6
    surely: float = 0.95
    told: float = 0.3
    held: float = 0.6
    surely_held: float = 0.75
    alone: float = 17.0
    clear: float = 1.25
    striking: float = np.inf
    alike: float = 0.87
    same: float = 0.98
    exact: float = 0.995
    walled: float = 25.0
    vivid: float = 2.0
    weighty: float = 50.0
    worse: float = 0.08
    runs: RunSettings = field(default_factory=RunSettings)
    most: int = 0
    rounds: int = 0
    expected: float = 2.0
    laid: float = 3.0
    reach: float = 2.5
    askew: float = 0.5
    apart: float = 0.8
    loop: float = 10.0

    def __post_init__(self) -> None:
        """Raise ``MapError`` for what is no probability or length."""
        if not 0 <= self.sure < 1:
            raise MapError(f"overlap.sure is {self.sure}; valid is at least 0 and less than 1")
        for name, unit in (
            ("near", "m"),
            ("bridge", "m"),
            ("least", "m"),
            ("alone", "nats·m"),
            ("clear", "nats"),
            ("walled", "nats·m"),
            ("vivid", "nats"),
            ("weighty", "nats·m"),
            ("loop", "m"),
            ("laid", "nats"),
            ("reach", "standard deviations"),
            ("askew", "rad"),
        ):
            if not 0 <= getattr(self, name) < np.inf:
                raise MapError(f"overlap.{name} is {getattr(self, name)} {unit}; valid is 0 or more")
        for name in ("met", "surely", "held", "surely_held", "alike", "same", "exact", "worse"):
            if not 0 <= getattr(self, name) <= 1:
                raise MapError(f"overlap.{name} is {getattr(self, name)}; valid is 0 to 1")
        if not 0 < self.apart < np.inf:
            raise MapError(f"overlap.apart is {self.apart} m; valid is more than 0")
        if min(self.most, self.rounds) < 0:
            raise MapError(f"overlap.most is {self.most}, overlap.rounds {self.rounds}; valid are 0 and more")
        if not 1 <= self.stretched < np.inf:
            raise MapError(f"overlap.stretched is {self.stretched}; valid is 1 or more")


SHORT_JOINS = OverlapSettings(held=0.4, surely_held=0.0, striking=4.5, most=4, rounds=4)
"""Short joins as well: more of what real logs share, and more that is false where the frame is (decision 0025)."""


@dataclass(frozen=True, slots=True)
class Overlap:
    """A stretch of one sequence beside a stretch of another: ``pairs`` (n, 2) of places, rising in both.

    ``lengths`` are those of the two stretches [m]; ``told`` is what each sensor tells for it [nats a view], the mean of
    log(likelihood · K) of the places that the views were matched with. ``objection`` says why it is none, if it is, and
    ``doubt`` why others have to hold it. ``evidence`` is the mean of what the witnesses tell times its length [nats·m].
    ``alike`` is the share of the scans' beams that meet the same walls, None where no scans are known.
    """

    pairs: NDArray[np.intp]
    lengths: tuple[float, float]
    told: dict[str, float]
    objection: str = ""
    doubt: str = ""
    evidence: float = 0.0
    alike: float | None = None


Told = Callable[[str, NDArray[np.intp]], NDArray[np.float64]]
"""Information of a sensor about pairs of places (n, 2): (n,) [nats]."""


def overlaps(
    one: ReferenceSequence, other: ReferenceSequence, settings: OverlapSettings | None = None
) -> list[Overlap]:
    """All stretches that two sequences seem to share, those that are objected to among them.

    Raises ``MapError`` for maps of other features or settings.
    """
    return PairSearch(one, other, settings or OverlapSettings()).overlaps()


@dataclass(frozen=True, slots=True)
class LaidViews:
    """Poses of a sequence's places in a frame, (K, 3), and how uncertain each position is, ``sigmas`` (K,) [m]."""

    poses: NDArray[np.float64]
    sigmas: NDArray[np.float64]


@dataclass(frozen=True)
class PairSearch:
    """Search of two sequences for what they share. Raises ``MapError`` for maps of other features or settings."""

    one: ReferenceSequence
    other: ReferenceSequence
    settings: OverlapSettings = field(default_factory=OverlapSettings)

    @cached_property
    def _judge(self) -> "PairJudge":
        ways = translated(self.one, self.other), translated(self.other, self.one)
        there, back = map(align, ways)
        return PairJudge(self.one, self.other, there, back, told_by(*ways), self.settings)

    def looks(self) -> Iterator[list[Overlap]]:
        """All stretches that the sequences seem to share: they are looked through once."""
        yield self.overlaps()

    def overlaps(self) -> list[Overlap]:
        """All stretches that the sequences seem to share, those that are objected to among them."""
        judge, settings = self._judge, self.settings
        long = [judge.overlap(trimmed(pairs)) for pairs in self._stretches()]
        if not settings.most:
            return long
        left = self._without(self._judge.nats, [one.pairs for one in long if not one.objection])
        runs = best_runs(left, _track(self.one), _track(self.other), settings.runs)
        short = [judge.overlap(pairs) for pairs in runs]
        return long + [one for one in short if not one.objection][: settings.most]

    def _stretches(self) -> list[NDArray[np.intp]]:
        """Runs of places of the one and of the other that lead to each other, (n, 2) each."""
        return stretches(self._matched(), self.one.along, self.other.along, self.settings.bridge)

    def _matched(self) -> NDArray[np.intp]:
        """Places of the one and of the other that lead to each other, (n, 2)."""
        return matched(self.one, self._judge.there, self._judge.back, self.settings)

    def beside(self, laid: LaidViews, its: LaidViews, joined: Sequence[NDArray[np.intp]] = ()) -> list[Overlap]:
        """Stretches that a frame lays beside each other; each is doubtful, as it is found where it was looked for.

        Views that are ``joined`` already, pairs (n, 2), are left out.
        """
        given = self._given(laid, its)
        if not np.isfinite(given).any():
            return []
        nats = self._judge.nats + given
        for pairs in joined:
            nats[_between(pairs[:, 0])] = -np.inf
            nats[:, _between(pairs[:, 1])] = -np.inf
        valid = replace(self.settings.runs, score=self.settings.laid)
        runs = best_runs(nats, _track(self.one), _track(self.other), valid)
        found = [self._judge.laid(run, float(nats[tuple(run.T)].mean())) for run in runs]
        return [one for one in found if not one.objection]

    def _given(self, laid: LaidViews, its: LaidViews) -> NDArray[np.float64]:
        """Evidence of a frame for pairs being at one place (K, L) [nats]; −∞ for those that it lays too far apart."""
        valid = self.settings
        off = np.hypot(*(laid.poses[:, None, :2] - its.poses[None, :, :2]).transpose(2, 0, 1))
        turn = np.abs(wrapped(laid.poses[:, None, 2] - its.poses[None, :, 2]))
        variance = valid.apart**2 + np.add.outer(np.square(laid.sigmas), np.square(its.sigmas))
        told = valid.expected - np.log(variance / valid.apart**2) - np.square(off) / (2 * variance)
        return np.where((np.square(off) <= valid.reach**2 * variance) & (turn <= valid.askew), told, -np.inf)

    def _without(self, nats: NDArray[np.float64], runs: Sequence[NDArray[np.intp]]) -> NDArray[np.float64]:
        """Evidence of pairs, those too near to some runs to be another left out."""
        left = nats.copy()
        for i, j in (pair for run in runs for pair in run):
            rows = np.abs(self.one.along - self.one.along[i]) <= self.settings.bridge
            columns = np.abs(self.other.along - self.other.along[j]) <= self.settings.bridge
            left[np.ix_(rows, columns)] = -np.inf
        return left


BESIDE = "found where the frame of other joins lays it"


def _between(places: NDArray[np.intp]) -> NDArray[np.intp]:
    """All places from the first to the last of some."""
    return np.arange(places.min(), places.max() + 1)


def _track(sequence: ReferenceSequence) -> NDArray[np.float64]:
    """Poses by odometry, (K, 3); without any, places along a straight line."""
    if len(sequence.odometry):
        return sequence.odometry
    return np.column_stack([sequence.along, np.zeros((len(sequence), 2))])


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
    steps = np.diff(np.stack([along[pairs[:, 0]], other[pairs[:, 1]]]))
    broken = ((steps < 0) | (steps > bridge)).any(axis=0)
    return np.split(pairs, np.flatnonzero(broken) + 1)


def told_by(there: Translation, back: Translation) -> Told:
    """Information of the sensors of two maps about pairs of their places: the mean of both ways."""

    def table(way: Translation, sensor: str) -> NDArray[np.float64]:
        return np.array([told_by_likelihood(one) for one in way.measurements(sensors=[sensor])])

    @cache
    def nats(sensor: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        to = table(there, sensor)
        return to, to if back is there else table(back, sensor)

    def told(sensor: str, pairs: NDArray[np.intp]) -> NDArray[np.float64]:
        to, fro = nats(sensor)
        i, j = pairs.T
        return np.asarray((to[i, j] + fro[j, i]) / 2, np.float64)

    return told


def most_beyond(values: NDArray[np.float64], bar: float) -> slice:
    """The part of some values whose sum is most beyond a bar for each (Kadane's maximal segment); the first of equals.

    Empty where none is above the bar.
    """
    sums = np.concatenate([[0.0], np.cumsum(values - bar)])
    lowest = np.minimum.accumulate(sums)
    end = int(np.argmax(sums - lowest))
    return slice(int(np.argmin(sums[: end + 1])), end)


@dataclass(frozen=True)
class PairJudge:
    """Make an overlap of matched pairs, or object."""

    one: ReferenceSequence
    other: ReferenceSequence
    there: Alignment
    back: Alignment
    telling: Told
    settings: OverlapSettings

    @cached_property
    def nats(self) -> NDArray[np.float64]:
        """Evidence of each pair of places, the mean of both ways, (K, L)."""
        return np.asarray((self.there.nats + self.back.nats.T) / 2)

    def overlap(self, pairs: NDArray[np.intp]) -> Overlap:
        """The part of a stretch for which the witnesses tell, and what speaks against it."""
        if objection := next(self._objections(pairs), ""):
            return Overlap(pairs, self._lengths(pairs), {}, objection)
        witnesses = sorted(self.one.sensors - {LASER}) or sorted(self.one.sensors)
        nats = np.mean([self.telling(sensor, pairs) for sensor in witnesses], axis=0)
        part = pairs[most_beyond(nats, self.settings.told)]
        if (shorter := min(self._lengths(part))) < self._least:
            found = self._told(pairs)
            return replace(found, objection=f"only {shorter:.1f} m of it tell anything: {_in_words(found.told)}")
        found = self._told(part)
        if min(found.told[sensor] for sensor in witnesses) < (bar := self.settings.told):
            return replace(found, objection=f"it tells too little, valid is {bar:g}: {_in_words(found.told)}")
        return self._weighed(found, float(np.mean([found.told[sensor] for sensor in witnesses])))

    def laid(self, pairs: NDArray[np.intp], nats: float) -> Overlap:
        """A run that a frame lays beside the other sequence, its pairs telling ``nats`` in the mean; or objections.

        Every sensor has to tell for it: a frame that is wrong lays whole corridors beside each other.
        """
        found = self._told(pairs)
        objection = next(self._objections(pairs), "")
        if not objection and min(found.told.values()) < self.settings.told:
            objection = f"it tells too little, valid is {self.settings.told:g}: {_in_words(found.told)}"
        return replace(found, objection=objection, doubt=BESIDE, evidence=nats * sum(found.lengths) / 2)

    def _weighed(self, found: Overlap, nats: float) -> Overlap:
        """An overlap and whether it needs others that hold it."""
        valid, lengths, surely = self.settings, found.lengths, self._surely(found.pairs)
        evidence, doubt = nats * sum(lengths) / 2, ""
        if min(lengths) < valid.least:
            doubt = f"only {min(lengths):.1f} m long; valid is {valid.least:g} m"
        elif surely < valid.surely:
            doubt = f"on each other with probability {surely:.4f} only; valid is {valid.surely:g}"
        elif self._striking(found):
            doubt = ""
        elif evidence < valid.alone:
            doubt = f"told of by {evidence:.1f} nats·m only; valid is {valid.alone:g}"
        elif nats < valid.clear:
            doubt = f"told of by {nats:.2f} nats a view only; valid is {valid.clear:g}"
        return replace(found, doubt=doubt, evidence=evidence)

    def _striking(self, found: Overlap) -> bool:
        """True where the views tell, against the places elsewhere, what chance does not for so long."""
        if self.settings.striking == np.inf:
            return False  # nor is a table of all pairs made for it
        nats = float(self.nats[tuple(found.pairs.T)].mean())
        return nats >= self.settings.striking and nats * sum(found.lengths) / 2 >= self.settings.alone

    def _told(self, pairs: NDArray[np.intp]) -> Overlap:
        told = {sensor: float(self.telling(sensor, pairs).mean()) for sensor in sorted(self.one.sensors)}
        return Overlap(pairs, self._lengths(pairs), told)

    def _lengths(self, pairs: NDArray[np.intp]) -> tuple[float, float]:
        if not len(pairs):
            return 0.0, 0.0
        return float(np.ptp(self.one.along[pairs[:, 0]])), float(np.ptp(self.other.along[pairs[:, 1]]))

    @property
    def _least(self) -> float:
        return self.settings.held * self.settings.least

    def _surely(self, pairs: NDArray[np.intp]) -> float:
        return float(np.minimum(self.there.on[pairs[:, 0]], self.back.on[pairs[:, 1]]).mean())

    def _objections(self, pairs: NDArray[np.intp]) -> Iterator[str]:
        valid, lengths = self.settings, self._lengths(pairs)
        if min(lengths) < self._least:
            yield f"only {min(lengths):.1f} m long; valid is {self._least:g} m"
        if max(lengths) - SPACING > valid.stretched * min(lengths):
            yield f"{lengths[0]:.1f} m beside {lengths[1]:.1f} m: not the same way"
        met = len(pairs) / (1 + max(np.ptp(pairs, axis=0)))
        if met < valid.met:
            yield f"only {met:.0%} of the views lead to each other; valid is {valid.met:.0%}"
        if (surely := self._surely(pairs)) < (held := min(valid.surely, valid.surely_held)):
            yield f"on each other with probability {surely:.4f} only; valid is {held:g}"


def _in_words(told: Mapping[str, float]) -> str:
    return ", ".join(f"{sensor} {nats:.2f}" for sensor, nats in told.items()) + " nats a view"
