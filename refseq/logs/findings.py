"""Findings of reading a log: rates, gaps, clocks, offsets, and what was taken as what."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from refseq.logs.source import Channel
from refseq.logs.unreadable import Unreadable, sentences


@dataclass(frozen=True, slots=True)
class ChannelFindings:
    """Times of one channel, as the sensor's stamps have them.

    ``first`` and ``last`` [s]; ``rate`` [Hz] by the median step; ``longest_gap`` [s] begins at ``gap_at`` [s];
    ``backward`` counts stamps before the one that was written before, ``duplicates`` stamps that were there already,
    ``unstamped`` stamps of zero, for which the log time stands; ``offset`` is the median of log time − stamp [s].
    """

    channel: Channel
    first: float
    last: float
    rate: float
    longest_gap: float = 0.0
    gap_at: float = 0.0
    backward: int = 0
    duplicates: int = 0
    unstamped: int = 0
    offset: float = 0.0

    @property
    def duration(self) -> float:
        """From the first stamp to the last [s]."""
        return self.last - self.first


@dataclass(frozen=True, slots=True)
class Findings:
    """Account of a log that was read.

    ``sensors`` names the topics that views are made of, topic → sensor; ``leading`` is the topic at whose times there
    are views, ``tolerance`` [s] within which others are paired. ``odometry`` and ``truth`` say where they come from,
    empty where there is none; ``length`` [m] is the way by odometry. ``views`` counts the views before thinning,
    ``without_odometry`` the moments that were passed over because no odometry reaches them, ``without_truth`` the
    views that no true pose reaches, ``unpaired`` the samples of each sensor that no view took. ``notes`` are sentences
    for the user on what was decided and what is wrong. ``damaged`` are each sensor's pictures that cannot be decoded,
    by their files' names or times, of which ``deep`` are those that are whole, but of 16 bits; ``unreadable`` each
    topic's messages that are not what their type says: all are left out.
    """

    channels: Mapping[str, ChannelFindings] = field(default_factory=dict)
    sensors: Mapping[str, str] = field(default_factory=dict)
    leading: str = ""
    tolerance: float = 0.0
    odometry: str = ""
    truth: str = ""
    length: float = 0.0
    views: int = 0
    without_odometry: int = 0
    without_truth: int = 0
    unpaired: Mapping[str, int] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    damaged: Mapping[str, Sequence[str]] = field(default_factory=dict)
    deep: Mapping[str, Sequence[str]] = field(default_factory=dict)
    unreadable: Mapping[str, Unreadable] = field(default_factory=dict)

    def losses(self) -> Iterator[str]:
        """Sentences on messages that are not readable, by topic, and on pictures damaged or of 16 bits, by sensor."""
        yield from sentences(self.unreadable)
        for sensor, every in self.damaged.items():
            deep = self.deep.get(sensor, ())
            of = {"damaged": [one for one in every if one not in deep], "of 16 bits, as distances are,": deep}
            for what, told in of.items():
                if len(told) == 1:
                    yield f"{sensor}: the picture {told[0]} is {what} and left out"
                elif told:
                    yield f"{sensor}: {len(told)} pictures are {what} and left out, the first {told[0]}"
