"""ROS bags as a source of logs: ROS 2 folders and files of either storage, and ROS 1."""

import json
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from itertools import chain
from pathlib import Path

from refseq.errors import LogError
from refseq.logs.closing import CuttableLog
from refseq.logs.ros.decoder import RosDecoder, Serialization
from refseq.logs.ros.files import BagFiles, open_bag
from refseq.logs.ros.storage import DamagedBagError, StoredMessage
from refseq.logs.source import EMPTY, Channel, Role, Sample
from refseq.logs.unreadable import Unreadable, UnreadableMessageError, UnreadableTally

VIEWS_KEY = "refseq_views"
"""Note in the metadata of a bag of ours: messages of one view have one log time. Its value: topic → camera's name."""


class RosBag(CuttableLog):
    """A bag that is read from its files as often as it is asked, and never as a whole.

    Damage is told as soon as reading meets it.
    """

    kind = "a ROS bag"

    def __init__(self, path: Path) -> None:
        """Open a folder or file. Raises ``LogError`` where it is no bag, or holds no message."""
        self.path = path
        self._bag: BagFiles = open_bag(path)
        self._cut = self._bag.damage
        self._decoders = {one: RosDecoder(one) for one in Serialization}
        self._empty: dict[str, tuple[str, int]] = {}  # by topic: what told nothing when it was last read
        self._tally = UnreadableTally()
        self._cameras = _cameras_in(self._bag.metadata.get(VIEWS_KEY, "{}"))
        # Of a topic's channels the one that is read is the last, so that it is the one of tables by topic.
        self.channels = tuple(sorted(self._channels(), key=lambda one: (one.topic, one.role is not Role.IGNORED)))
        if not any(channel.count for channel in self.channels):
            raise LogError(f"{path}: is a bag without messages; valid is one with messages of sensors")

    def _channels(self) -> Iterator[Channel]:
        """One for each topic and type; of two types on a topic that are read, the one with more messages is."""
        counts: Counter[tuple[str, str, str, str]] = Counter()
        for found in chain.from_iterable(file.topics for file in self._bag.files):
            counts[found.topic, found.type, found.serialization, found.digest] += found.count
        taken: set[str] = set()
        for (topic, kind, serialization, digest), count in counts.most_common():
            role = Role.IGNORED if topic in taken else self._role(topic, kind, serialization, digest)
            if role is not Role.IGNORED:
                taken.add(topic)
            yield Channel(topic, kind, serialization, count, role, self._cameras.get(topic, ""))

    def _role(self, topic: str, kind: str, serialization: str, digest: str) -> Role:
        if serialization not in tuple(Serialization):
            return Role.IGNORED
        return self._decoders[Serialization(serialization)].role(topic, kind, digest)

    @property
    def metadata(self) -> Mapping[str, str]:
        """Notes that the bag's writer left in its metadata."""
        return {key: value for key, value in self._bag.metadata.items() if key != VIEWS_KEY}

    @property
    def has_moments(self) -> bool:
        """True for a bag that the bench wrote: messages of one view have one log time."""
        return VIEWS_KEY in self._bag.metadata

    @property
    def skipped(self) -> Mapping[str, int]:
        """Messages of types that are not read, and those that told nothing, by type."""
        counts: Counter[str] = Counter()
        for channel in self.channels:
            if channel.role is Role.IGNORED:
                counts[channel.schema] += channel.count
        for kind, number in self._empty.values():
            counts[kind] += number
        return {kind: count for kind, count in counts.items() if count}

    @property
    def unreadable(self) -> Mapping[str, Unreadable]:
        """Messages that are not what their type says, by topic."""
        return self._tally.found

    def samples(self, topics: Collection[str] | None = None) -> Iterator[Sample]:
        """Samples of the topics asked for, in the order of the bag.

        Messages that do not fit their type are left out, and ``unreadable``. Raises ``LogError`` for a bag that is
        damaged before its first.
        """
        wanted = {
            channel.topic: channel
            for channel in self.channels
            if channel.role is not Role.IGNORED and (topics is None or channel.topic in topics)
        }
        self._tally.begin(wanted)
        for topic in wanted:
            self._empty.pop(topic, None)
        begun = False
        try:
            for stored in chain.from_iterable(file.messages(wanted) for file in self._bag.files):
                begun = True
                channel = wanted[stored.topic]
                if stored.type == channel.schema and (sample := self._sample(channel, stored)) is not None:
                    yield sample
        except DamagedBagError as error:
            if not begun:
                raise
            self._cut = error.reason

    def _sample(self, channel: Channel, stored: StoredMessage) -> Sample | None:
        self._tally.see(channel.topic)
        try:
            sample = self._decoders[Serialization(channel.encoding)].sample(*stored)
        except UnreadableMessageError as error:
            self._tally.lose(error)
            return None
        if sample is None:
            kind, number = self._empty.get(channel.topic, (f"{channel.schema}{EMPTY}", 0))
            self._empty[channel.topic] = kind, number + 1
            return None
        return replace(sample, moment=stored.logged) if self.has_moments else sample


def _cameras_in(note: str) -> dict[str, str]:
    """Cameras' names by topic; none where somebody has changed the note."""
    try:
        named = json.loads(note)
    except ValueError:
        return {}
    return {topic: name for topic, name in named.items() if isinstance(name, str)} if isinstance(named, dict) else {}
