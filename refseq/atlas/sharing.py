"""Places that several paths run through: taking them out of all sequences but one, and finding them again."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from refseq.atlas.consistency import CandidateJoin
from refseq.atlas.overlap import stretches
from refseq.map.map import Map
from refseq.map.paths.path import MapPath
from refseq.map.reduction import reduced
from refseq.map.sequence import ReferenceSequence

APART = 3.0
"""Shared places with more than so much between them [m] are two stretches: as in the search for overlaps by default."""


def views_of(map_: Map, name: str) -> NDArray[np.intp]:
    """The view of its own path that each place of the sequence ``name`` was learnt from."""
    path = next(path for path in map_.paths if path.name == name)
    return np.flatnonzero(path.sequences == map_.names.index(name))


def held_joins(map_: Map) -> list[CandidateJoin]:
    """The joins that a map has: where a path runs through places that were learnt along another, or comes back."""
    numbers = {path.name: number for number, path in enumerate(map_.paths)}
    found = []
    for number, path in enumerate(map_.paths):
        for sequence, name in enumerate(map_.names):
            theirs = np.flatnonzero(path.sequences == sequence)
            if name == path.name or not len(theirs):
                continue
            holder = map_.paths[numbers[name]]
            pairs = np.column_stack([views_of(map_, name)[path.places[theirs]], theirs])
            runs = stretches(pairs, holder.along, path.along, APART)
            found += [CandidateJoin(numbers[name], number, run, held=True) for run in runs if len(run) > 1]
    for number, path in enumerate(map_.paths):
        found += [CandidateJoin(number, number, run, held=True) for run in loops_of(path)]
    return found


def loops_of(path: MapPath) -> list[NDArray[np.intp]]:
    """The stretches on which a path comes back to itself, as pairs (n, 2) of its views.

    Those of several rounds take turns: a pair belongs to the stretch that it goes on from.
    """
    runs: list[list[tuple[int, int]]] = []
    for one, other in path.loops.tolist():
        step = ((run, path.along[[one, other]] - path.along[list(run[-1])]) for run in runs)
        run = next((run for run, way in step if way.min() >= 0 and way.max() <= APART), None)
        if run is None:
            runs.append([(one, other)])
        else:
            run.append((one, other))
    return [np.array(run, np.intp) for run in runs]


class Joint(NamedTuple):
    """Views of a path ``keeper`` and views that another path gives to it: ``pairs`` (n, 2), rising in both."""

    keeper: int
    pairs: NDArray[np.intp]


def joint_through(path: MapPath, keeper: tuple[MapPath, Joint], other: tuple[MapPath, Joint]) -> Joint | None:
    """The stretch that two paths share as a third one, ``path``, gives views of it to either of them.

    None for less than ``APART`` on any of the three: joins that follow each other may overlap by a view or two.
    """
    (first, mine), (second, its) = keeper, other
    begin, end = max(mine.pairs[0, 1], its.pairs[0, 1]), min(mine.pairs[-1, 1], its.pairs[-1, 1])
    views = np.arange(begin, end + 1)
    if len(views) < 2:
        return None
    sides = [
        nearest(one.along, np.interp(path.along[views], path.along[joint.pairs[:, 1]], one.along[joint.pairs[:, 0]]))
        for one, joint in ((first, mine), (second, its))
    ]
    lengths = [np.ptp(one.along[side]) for one, side in zip((path, first, second), (views, *sides), strict=True)]
    if min(lengths) < APART:
        return None
    theirs, at = np.unique(sides[1], return_index=True)
    return Joint(mine.keeper, np.column_stack([sides[0][at], theirs]))


class SharedPlaces:
    """A map while places are taken out of one sequence after another."""

    def __init__(self, map_: Map) -> None:
        self._names = map_.names
        self._sequences = list(map_.sequences)
        self._kept = [np.arange(len(sequence)) for sequence in map_.sequences]
        self._paths = list(map_.paths)
        self._grown = map_.grown

    def take(self, giving: int, joints: Sequence[Joint]) -> None:
        """Let views of a path be where others have theirs: each joint is a path, and pairs of its views and of these.

        Only places that the path holds itself are given away, each once, to where the other path's view is now.
        """
        path = self._paths[giving]
        if not joints or path.name not in self._names:
            return
        own = self._names.index(path.name)
        sequences = np.full(len(self._sequences[own]), -1)
        places = sequences.copy()
        for keeper, pairs in joints:
            views = np.arange(pairs[0, 1], pairs[-1, 1] + 1)
            its = self._paths[keeper]
            at = np.interp(path.along[views], path.along[pairs[:, 1]], its.along[pairs[:, 0]])
            between = np.arange(pairs[:, 0].min(), pairs[:, 0].max() + 1)
            there = between[nearest(its.along[between], at)]
            mine = path.sequences[views] == own
            place = path.places[views[mine]]
            free = sequences[place] < 0
            sequences[place[free]] = its.sequences[there[mine][free]]
            places[place[free]] = its.places[there[mine][free]]
        self._paths = [_moved(one, own, sequences, places) for one in self._paths]
        self._paths[giving] = _with_keys_of(self._paths[giving], own)
        self._kept[own] = np.flatnonzero(sequences < 0)

    def map(
        self,
        tracks: Sequence[NDArray[np.float64]],
        poses: Sequence[NDArray[np.float64]],
        loops: Sequence[NDArray[np.intp]],
    ) -> Map:
        """The map as it is now, with odometry, poses and loops of its paths; empty sequences are left out."""
        left = [number for number, kept in enumerate(self._kept) if len(kept)]
        number = np.full(len(self._sequences), -1)
        number[left] = np.arange(len(left))
        places = [np.full(len(sequence), -1) for sequence in self._sequences]
        for old, kept in zip(places, self._kept, strict=True):
            old[kept] = np.arange(len(kept))
        joined = any(len(kept) < len(old) for kept, old in zip(self._kept, places, strict=True))
        joined = joined or any(map(len, loops))
        paths = tuple(_renumbered(path, number, places) for path in self._paths)
        if joined:
            known = zip(paths, tracks, poses, loops, strict=True)
            paths = tuple(replace(path, odometry=track, poses=at, loops=pairs) for path, track, at, pairs in known)
        return Map(
            names=tuple(self._names[n] for n in left),
            sequences=tuple(self._reduced(n) for n in left),
            paths=paths,
            grown=self._grown,
        )

    def _reduced(self, number: int) -> ReferenceSequence:
        sequence, kept = self._sequences[number], self._kept[number]
        return sequence if len(kept) == len(sequence) else reduced(sequence, kept)


def nearest(along: NDArray[np.float64], at: NDArray[np.float64]) -> NDArray[np.intp]:
    """The places nearest to some distances, the first of equals."""
    return np.asarray(np.abs(along[None, :] - at[:, None]).argmin(axis=1))


def _moved(path: MapPath, own: int, sequences: NDArray[np.intp], places: NDArray[np.intp]) -> MapPath:
    """A path after some places of a sequence became others'."""
    there = np.flatnonzero(path.sequences == own)
    gone = there[sequences[path.places[there]] >= 0]
    new_sequences, new_places = path.sequences.copy(), path.places.copy()
    new_sequences[gone], new_places[gone] = sequences[path.places[gone]], places[path.places[gone]]
    return replace(path, sequences=new_sequences, places=new_places)


def _with_keys_of(path: MapPath, own: int) -> MapPath:
    """A path with keys of its views at places of a sequence alone: a place is asked for those of its holder's view."""
    return replace(path, keys={camera: keys.only(path.sequences == own) for camera, keys in path.keys.items()})


def _renumbered(path: MapPath, number: NDArray[np.intp], places: Sequence[NDArray[np.intp]]) -> MapPath:
    """A path by the numbers that sequences and places have in the end."""
    new = np.array([places[s][p] for s, p in zip(path.sequences, path.places, strict=True)], np.intp)
    return replace(path, sequences=number[path.sequences], places=new)
