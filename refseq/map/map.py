"""The map: the places that were learnt, and the paths that run through them.

One path is the common case. Several become one map beside each other, or merged (``refseq.atlas``): a stretch that two
of them share is then held by one sequence, and both paths run through it.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Self, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from refseq.belief import LOST_ABOVE, Belief
from refseq.errors import MapError
from refseq.features.word_extractor import PictureKeys
from refseq.inference.chain.network import Network
from refseq.inference.paths import usual_step
from refseq.map.format.archive import archive_of, open_archive, pack, write_archive
from refseq.map.format.file import described, read_parts
from refseq.map.growth.record import NOT_GROWN, GrowthRecord
from refseq.map.merge_record import NOT_MERGED, MergeRecord
from refseq.map.paths.annotations import Annotations
from refseq.map.paths.keys import PathKeys
from refseq.map.paths.path import Link, MapPath
from refseq.map.profile import Profile
from refseq.map.sequence import ReferenceSequence, check_comparable
from refseq.planar import Pose, in_world, wrap
from refseq.view import ASSUMED

Found = TypeVar("Found")


class MapFrame(StrEnum):
    """Frame that the places of a map have poses in."""

    TRUTH = "truth"
    JOINED = "joined"
    ODOMETRY = "odometry"
    NONE = "none"


@dataclass(frozen=True, repr=False, eq=False)
class Map:
    """Sequences by their ``names``, with the places that each still holds, and all ``paths`` that were learnt.

    A path whose places are all held by others has no sequence of its own any more. A place is numbered within its
    sequence, or through all sequences one behind the other (``first``), as beliefs number it. All sequences have the
    same features and settings. ``learn`` makes a map of one path, ``refseq.atlas.merge`` one of several; ``record``
    says which files that was made of, where it is known, and ``grown`` which later drives were added.
    """

    names: tuple[str, ...]
    sequences: tuple[ReferenceSequence, ...]
    paths: tuple[MapPath, ...]
    record: MergeRecord = NOT_MERGED
    grown: GrowthRecord = NOT_GROWN

    @classmethod
    def of(
        cls,
        sequence: ReferenceSequence,
        name: str = "",
        annotations: Annotations | None = None,
        scans: NDArray[np.uint16] | None = None,
        times: NDArray[np.float64] | None = None,
        keys: Mapping[str, PathKeys] | None = None,
    ) -> Self:
        """A map of one path, through all places of a sequence.

        ``scans`` (K, 360) are those of a laser there, ``times`` (K,) [s] the stamps of the views in their recording,
        ``keys`` those that each camera saw there.
        """
        along = sequence.along - sequence.along[0]
        path = MapPath(name, along, np.zeros(len(along), np.intp), np.arange(len(along)), annotations or Annotations())
        path = path if scans is None else replace(path, scans=scans)
        path = path if times is None else replace(path, times=times)
        path = path if keys is None else replace(path, keys=keys)
        return cls((name,), (sequence,), (path,))

    @classmethod
    def load(cls, file: Path | str) -> Self:
        """Read a map from its file (``.refseq``). Nothing in a file is ever executed.

        A path without a name is named after the file. Raises ``MapError`` for a file that is none, is damaged, or is of
        another format version.
        """
        path = Path(file)
        with open_archive(path) as archive:
            found = cls(*read_parts(archive))
        return found if found.names != ("",) else found.named(path.stem)

    def save(self, file: Path | str) -> None:
        """Write the map, replacing ``file`` in one step. Raises ``MapError`` when it cannot be written."""
        write_archive(Path(file), self.to_bytes())

    @classmethod
    def from_bytes(cls, content: bytes) -> Self:
        """The inverse of ``to_bytes``. Raises ``MapError`` as ``load`` does."""
        with archive_of(content) as archive:
            return cls(*read_parts(archive))

    def __reduce__(self) -> tuple[Callable[[bytes], "Map"], tuple[bytes]]:
        """A map goes to another process as the content of its file."""
        return Map.from_bytes, (self.to_bytes(),)

    def __eq__(self, other: object) -> bool:
        """Maps are equal whose files are."""
        return self.to_bytes() == other.to_bytes() if isinstance(other, Map) else NotImplemented

    __hash__ = None  # type: ignore[assignment]

    def __copy__(self) -> Self:
        """Nothing in a map ever changes, so that it is its own copy."""
        return self

    def __deepcopy__(self, memo: object) -> Self:
        """Nothing in a map ever changes, so that it is its own copy."""
        return self.__copy__()

    def to_bytes(self) -> bytes:
        """The content of the map's file: the same map gives the same bytes."""
        return pack(*described(self.names, self.sequences, self.paths, self.record, self.grown))

    def __len__(self) -> int:
        return sum(len(sequence) for sequence in self.sequences)

    def __repr__(self) -> str:
        """One line: its arrays would fill pages of a notebook."""
        paths = ", ".join(f"{path.name or 'unnamed'} {path.along[-1]:.1f} m" for path in self.paths)
        return f"<Map of {len(self)} places: {paths}; {', '.join(sorted(self.sensors))}>"

    @property
    def has_one_path(self) -> bool:
        """True for the map of a single drive."""
        return len(self.paths) == 1

    @property
    def sequence(self) -> ReferenceSequence:
        """The only sequence. Raises ``MapError`` for a map of several paths."""
        if not self.has_one_path:
            names = ", ".join(path.name for path in self.paths)
            raise MapError(f"the map holds {len(self.paths)} paths, {names}; valid is a map of one")
        return self.sequences[0]

    @property
    def profile(self) -> Profile:
        """All sequences' settings."""
        return self.sequences[0].profile

    @property
    def sensors(self) -> frozenset[str]:
        """Sensors that the map can be asked with."""
        return self.sequences[0].sensors

    @cached_property
    def metadata(self) -> Mapping[str, str]:
        """Metadata of the drives, by key; where they differ, the value of each, commas between."""
        values: dict[str, dict[str, None]] = {}
        for sequence in self.sequences:
            for key, value in sequence.metadata.items():
                values.setdefault(key, {})[str(value)] = None
        return {key: ", ".join(every) for key, every in values.items()}

    def named(self, name: str) -> Self:
        """The same map of one path by another name. Raises ``MapError`` for a map of several."""
        return replace(self, names=(name,), sequences=(self.sequence,), paths=(replace(self.paths[0], name=name),))

    def noted(self, notes: Mapping[str, str]) -> Self:
        """The same map, and more said in its metadata."""
        return replace(
            self, sequences=tuple(replace(one, metadata={**one.metadata, **notes}) for one in self.sequences)
        )

    @cached_property
    def first(self) -> NDArray[np.intp]:
        """Number of each sequence's first place, counted through, and the number of all places: (S + 1,)."""
        return np.cumsum([0, *map(len, self.sequences)])

    def sequence_of(self, place: int) -> int:
        """Number of the sequence that holds a place, counted through."""
        return int(np.searchsorted(self.first, place, side="right")) - 1

    def numbered(self, path: MapPath) -> NDArray[np.intp]:
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

    @property
    def usual_step(self) -> float:
        """Way from place to place [m], as the map's drives had it where they did not stand; 0 without any."""
        ends = tuple((self.first[1:] - 1).tolist())
        return usual_step(np.concatenate([sequence.along for sequence in self.sequences]), ends)

    def in_a_row(self, places: NDArray[np.intp], others: NDArray[np.intp] | int, reach: int) -> NDArray[np.bool_]:
        """True where two places, counted through, were learnt at most ``reach`` views apart along one path.

        Numbers do not tell: where a sequence gave places away, those before and behind follow each other.
        """
        one, other = (np.searchsorted(self.first, each, side="right") for each in (places, others))
        apart = np.abs(self.learnt[places] - self.learnt[others])
        return np.asarray((one == other) & (apart <= reach), np.bool_)

    def _own(self, path: MapPath) -> NDArray[np.bool_]:
        """Mask of the views of a path that hold their place themselves, (K,)."""
        own = np.array([name == path.name for name in self.names])
        return np.asarray(own[path.sequences])

    def track(self, path: MapPath) -> NDArray[np.float64]:
        """Poses of a path's views by its own odometry, (K, 3); (0, 3) where that is not known."""
        if len(path.odometry) or path.name not in self.names:
            return path.odometry
        own = self.sequences[self.names.index(path.name)]
        return own.odometry if len(own) == len(path) else path.odometry

    @property
    def held_by(self) -> NDArray[np.intp]:
        """For each view of all paths, one behind the other, the view whose place it is at now: mostly itself."""
        return np.concatenate([self.learnt[self.numbered(path)] for path in self.paths])

    @property
    def poses(self) -> tuple[Pose | None, ...]:
        """True poses of all places, where they are known: for scoring and drawing only."""
        return tuple(pose for sequence in self.sequences for pose in sequence.poses)

    @cached_property
    def frame(self) -> MapFrame:
        """The frame that ``places_in_frame`` are in: the truth's where any true pose is known.

        Else it is that of joined paths, and for a map of one path that of its odometry.
        """
        if any(self.poses):
            return MapFrame.TRUTH
        if any(len(path.poses) for path in self.paths):
            return MapFrame.JOINED
        measured = self.has_one_path and len(self.sequence.odometry)
        return MapFrame.ODOMETRY if measured and not self.odometry_is_assumed else MapFrame.NONE

    @property
    def odometry_is_assumed(self) -> bool:
        """True for the map of pictures whose way nobody measured: so many metres each, straight on."""
        return self.metadata.get("odometry", "").startswith(ASSUMED)

    @cached_property
    def places_in_frame(self) -> tuple[Pose | None, ...]:
        """Poses of all places in one frame, None where there is none known in it.

        Drives without truth have a frame in common where they are joined: joins and odometry say where they lie to each
        other. Paths that no join leads to have none in it: the odometry of each begins at its own first view.
        """
        if self.frame is MapFrame.JOINED:
            return self.joined_poses
        if self.frame is MapFrame.ODOMETRY:
            return tuple(Pose(x, y, wrap(heading)) for x, y, heading in self.sequence.odometry.tolist())
        return self.poses

    @cached_property
    def joined_poses(self) -> tuple[Pose | None, ...]:
        """Poses of all places by joins and odometry alone, None on paths that are not joined."""
        poses: list[Pose | None] = [None] * len(self)
        for path in self.paths:
            if len(path.poses):
                own = self._own(path)
                rows = zip(self.numbered(path)[own].tolist(), path.poses[own].tolist(), strict=True)
                for place, (x, y, heading) in rows:
                    poses[place] = Pose(x, y, wrap(heading))
        return tuple(poses)

    def pose(self, belief: Belief, lost_above: float = LOST_ABOVE) -> Pose | None:
        """Pose in the map's frame that a belief stands for: beside its most probable place, where it tells.

        None where the belief says lost, and where no pose of the place is known. Without ``Belief.pose`` it is the
        place's own, as coarse as the places are far apart.
        """
        place = self.places_in_frame[belief.best]
        if belief.lost > lost_above or place is None or belief.pose is None:
            return None if belief.lost > lost_above else place
        x, y = in_world((belief.pose.along, belief.pose.aside), place).tolist()
        return Pose(x, y, wrap(place.heading + belief.pose.heading))

    def once(self, found_in: Callable[["Map"], Found]) -> Found:
        """Answer of a function about the map, asked once: nothing in it ever changes, so all who localise share it."""
        if found_in not in self._answers:
            self._answers[found_in] = found_in(self)
        return cast(Found, self._answers[found_in])

    @cached_property
    def _answers(self) -> dict[Callable[["Map"], object], object]:
        return {}

    def scan(self, place: int) -> NDArray[np.uint16] | None:
        """Ranges seen at a place, (360,) [cm] (``refseq.scan_matching.panorama``); None where none are kept."""
        path, view = self._view_of(place)
        return path.scans[view] if len(path.scans) else None

    def keys(self, place: int) -> Mapping[str, PictureKeys]:
        """Keys seen at a place, by camera; none where the map does not hold them."""
        path, view = self._view_of(place)
        return {camera: its.at(view) for camera, its in path.keys.items()}

    def _view_of(self, place: int) -> tuple[MapPath, int]:
        """The path that a place was learnt on, and the number of its view there."""
        view = int(self.learnt[place])
        for path in self.paths:
            if view < len(path):
                return path, view
            view -= len(path)
        raise IndexError(place)

    @cached_property
    def loops(self) -> NDArray[np.intp]:
        """Pairs of places, counted through, that are one: where a path comes back to itself, (n, 2)."""
        pairs = [self.numbered(path)[path.loops] for path in self.paths]
        every = np.concatenate(pairs) if pairs else np.zeros((0, 2), np.intp)
        return np.asarray(every[every[:, 0] != every[:, 1]], np.intp)

    def with_twins(self, places: NDArray[np.intp]) -> NDArray[np.intp]:
        """Some places, counted through, and those that loops make one with any of them: they share a belief."""
        if not len(self.loops):
            return np.unique(places)
        return np.flatnonzero(np.isin(self._spots, self._spots[places]))

    @cached_property
    def _spots(self) -> NDArray[np.intp]:
        """Number of the spot that each place is at, (K,): the same for those that loops make one."""
        spots = np.empty(len(self), np.intp)
        spots[self.network.places] = self.network.spots
        return spots

    @property
    def links(self) -> tuple[Link, ...]:
        """Where paths cross over from one sequence to another."""
        return tuple(link for number, path in enumerate(self.paths) for link in _links(number, path))

    @cached_property
    def network(self) -> Network:
        """The chain over all paths."""
        places = np.concatenate([self.numbered(path) for path in self.paths])
        paths = tuple(path.along for path in self.paths)
        return Network(paths, places, self.profile.motion, self.profile.chain, loops=self.loops)

    def sequence_probabilities(self, belief: Belief) -> NDArray[np.float64]:
        """P(s), (S,), given that the robot is in any of the sequences: what their places have of a belief, sum 1."""
        shares: NDArray[np.float64] = np.add.reduceat(belief.places, self.first[:-1])
        return shares


def _links(number: int, path: MapPath) -> list[Link]:
    steps = pairwise(zip(path.sequences.tolist(), path.places.tolist(), strict=True))
    return [Link(number, start, end) for start, end in steps if start[0] != end[0]]


def check_names(names: Sequence[str]) -> None:
    """Raise ``MapError`` for a name that is there twice."""
    for number, name in enumerate(names):
        if name in names[:number]:
            raise MapError(f"path {name!r} is there twice; valid are names of their own")


def check_is_map(map_: object) -> None:
    """Raise ``MapError`` for what is no map, such as the name of its file."""
    if not isinstance(map_, Map):
        raise MapError(f"a map is a {type(map_).__name__}; valid is refseq.Map, as learn or Map.load(file) gives it")


def beside(maps: Sequence[Map]) -> Map:
    """One map of several as they are, none merged. Raises ``MapError`` for none, equal names or unlike maps."""
    if not maps:
        raise MapError("a map holds no path; valid is at least one")
    check_names([path.name for one in maps for path in one.paths])
    for one in maps:
        check_comparable(maps[0].sequences[0], one.sequences[0])
    first = np.cumsum([0, *(len(one.sequences) for one in maps)])
    return Map(
        tuple(name for one in maps for name in one.names),
        tuple(sequence for one in maps for sequence in one.sequences),
        tuple(
            replace(path, sequences=path.sequences + start)
            for one, start in zip(maps, first[:-1], strict=True)
            for path in one.paths
        ),
        grown=GrowthRecord.joined(one.grown for one in maps),
    )
