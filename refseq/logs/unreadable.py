"""Account of messages and lines that cannot be read: left out, and told by topic, with the reason for the first."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from refseq.errors import LogError

VALID = "; valid "
"""In a reason that tells it already."""


class UnreadableError(LogError):
    """A message or line of a topic cannot be read: its ``place`` in words, and the ``reason`` without the place."""

    def __init__(self, topic: str, place: str, reason: str) -> None:
        self.topic, self.place, self.reason = topic, place, reason
        super().__init__(f"topic {topic}: {place} is not readable: {reason}")


class UnreadableMessageError(UnreadableError):
    """A message of a topic, ``logged`` at a time [s], is not what its type says.

    A reason that tells nothing that is valid is followed by the type's name.
    """

    def __init__(self, topic: str, logged: float, reason: str, type_name: str) -> None:
        told = reason if VALID in reason else f"{reason}{VALID}is {type_name}"
        super().__init__(topic, f"the message logged at {logged:.6f} s", told)


@dataclass(frozen=True, slots=True)
class Unreadable:
    """Messages of one topic that cannot be read: how many ``of`` all, and the ``first`` one's error."""

    count: int
    of: int
    first: UnreadableError

    @property
    def is_all(self) -> bool:
        """Tell whether no message of the topic can be read."""
        return self.count == self.of

    @property
    def told(self) -> str:
        """All of it in a sentence."""
        others, place = self.count - 1, self.first.place
        if self.is_all:
            rest = f", nor are the other {others}" if others else ", the only one"
            return f"topic {self.first.topic}: {place} is not readable{rest}: {self.first.reason}"
        which = f"{place} and {others} more of {self.of} are" if others else f"{place} is"
        return f"topic {self.first.topic}: {which} not readable and left out: {self.first.reason}"


ALL_READABLE: Mapping[str, Unreadable] = MappingProxyType({})
"""The account of a log that has no messages, but files of their own."""


class UnreadableTally:
    """Count of the messages of each topic, and of those that cannot be read, as they were when last read."""

    def __init__(self) -> None:
        self._seen: Counter[str] = Counter()
        self._lost: Counter[str] = Counter()
        self._first: dict[str, UnreadableError] = {}

    def begin(self, topics: Iterable[str]) -> None:
        """Forget topics that are read anew."""
        for topic in topics:
            for kept in (self._seen, self._lost, self._first):
                kept.pop(topic, None)

    def see(self, topic: str) -> None:
        """Count a message, be it readable or not."""
        self._seen[topic] += 1

    def lose(self, error: UnreadableError) -> None:
        """Count a message that was seen and cannot be read."""
        self._lost[error.topic] += 1
        self._first.setdefault(error.topic, error)

    @property
    def found(self) -> Mapping[str, Unreadable]:
        """The account by topic; of topics that can be read there is none."""
        return {topic: Unreadable(count, self._seen[topic], self._first[topic]) for topic, count in self._lost.items()}


def sentences(found: Mapping[str, Unreadable]) -> Iterator[str]:
    """A sentence for each topic, by its name."""
    return (found[topic].told for topic in sorted(found))
