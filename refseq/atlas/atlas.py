"""Several reference sequences as one map: the places that each still holds, and the paths that run through them."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from refseq.atlas.similarity import check_comparable
from refseq.errors import MapError
from refseq.inference.chain.network import Network
from refseq.map.annotations import Guide
from refseq.map.sequence import ReferenceSequence
from refseq.planar import Pose


@dataclass(frozen=True)
class Path:
    """A sequence as it was learnt, by its ``name``: where each of its K views now lies.

    ``along`` (K,) is each view's odometric distance from the first [m]; ``sequences`` and ``places`` (K,) say which
    sequence holds the place, and the number that it has there. For most views that is the sequence itself. ``guide``
    is what missions need of the path beside.
    """

    name: str
    along: NDArray[np.float64]
    sequences: NDArray[np.intp]
    places: NDArray[np.intp]
    guide: Guide = field(default_factory=Guide)

    def __len__(self) -> int:
        return len(self.along)


@dataclass(frozen=True)
class Link:
    """Where a path crosses over: it goes from a place of one sequence straight on to one of another."""

    path: int
    start: tuple[int, int]
    end: tuple[int, int]


@dataclass(frozen=True)
class Atlas:
    """Sequences by their ``names``, with the places that each still holds, and all paths that were learnt.

    A path whose places are all held by others has no sequence of its own any more. A place is numbered within its
    sequence, or through all sequences one behind the other (``first``).
    """

    names: tuple[str, ...]
    sequences: tuple[ReferenceSequence, ...]
    paths: tuple[Path, ...]

    def __len__(self) -> int:
        return sum(len(sequence) for sequence in self.sequences)

    @cached_property
    def first(self) -> NDArray[np.intp]:
        """Number of each sequence's first place, counted through, and the number of all places: (S + 1,)."""
        return np.cumsum([0, *map(len, self.sequences)])

    def numbered(self, path: Path) -> NDArray[np.intp]:
        """The places of a path, counted through all sequences, (K,)."""
        return self.first[path.sequences] + path.places

    @cached_property
    def learnt(self) -> NDArray[np.intp]:
        """The view that each place was learnt from, (K,), counted through all paths one behind the other."""
        views = np.empty(len(self), np.intp)
        start = 0
        for path in self.paths:
            own = self._own(path)
            views[self.numbered(path)[own]] = start + np.flatnonzero(own)
            start += len(path)
        return views

    def _own(self, path: Path) -> NDArray[np.bool_]:
        """Which views of a path hold their place themselves, (K,)."""
        own = np.array([name == path.name for name in self.names])
        return np.asarray(own[path.sequences])

    @property
    def held_by(self) -> NDArray[np.intp]:
        """For each view of all paths, one behind the other, the view whose place it is at now: mostly itself."""
        return np.concatenate([self.learnt[self.numbered(path)] for path in self.paths])

    @property
    def poses(self) -> tuple[Pose | None, ...]:
        """True poses of all places, where they are known: for scoring and drawing only."""
        return tuple(pose for sequence in self.sequences for pose in sequence.poses)

    @property
    def links(self) -> tuple[Link, ...]:
        """Where paths cross over from one sequence to another."""
        return tuple(link for number, path in enumerate(self.paths) for link in _links(number, path))

    @cached_property
    def network(self) -> Network:
        """The chain over all paths."""
        profile = self.sequences[0].profile
        places = np.concatenate([self.numbered(path) for path in self.paths])
        return Network(tuple(path.along for path in self.paths), places, profile.motion, profile.chain)


def _links(number: int, path: Path) -> list[Link]:
    steps = pairwise(zip(path.sequences.tolist(), path.places.tolist(), strict=True))
    return [Link(number, start, end) for start, end in steps if start[0] != end[0]]


def check_names(names: Sequence[str]) -> None:
    """Raise ``MapError`` for a name that is there twice."""
    for number, name in enumerate(names):
        if name in names[:number]:
            raise MapError(f"sequence {name!r} is there twice; valid are names of their own")


def beside(names: Sequence[str], sequences: Sequence[ReferenceSequence]) -> Atlas:
    """An atlas of sequences as they are, none merged. Raises ``MapError`` for none, equal names or unlike maps."""
    if not sequences:
        raise MapError("an atlas holds no sequence; valid is at least one")
    check_names(names)
    for sequence in sequences:
        check_comparable(sequences[0], sequence)
    paths = tuple(
        Path(
            name,
            sequence.along - sequence.along[0],
            np.full(len(sequence), number),
            np.arange(len(sequence)),
            sequence.guide.since(float(sequence.along[0])),
        )
        for number, (name, sequence) in enumerate(zip(names, sequences, strict=True))
    )
    return Atlas(tuple(names), tuple(sequences), paths)
