"""Frames of a section: the same places in both drives, and the worst failures."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

from refseq.planar import wrap
from refseq.view import View
from refseq_bench.scenarios.report.images import picture, scan_outline
from refseq_bench.scenarios.scoring.comparison import Comparison
from refseq_bench.scenarios.scoring.outcome import Outcome
from refseq_bench.scenarios.scoring.path_geometry import WIDE, ReferencePath, Tolerance
from refseq_bench.scenarios.scoring.tables.worst_failures import Failure

PLACES_SHOWN = 4
"""Matching places whose frames are shown for each section."""


class DriveRole(StrEnum):
    """The drive that a view is of."""

    REFERENCE = "reference"
    QUERY = "query"


@dataclass(frozen=True, slots=True)
class FrameRequest:
    """A view whose frames are to be shown, by its run, its drive and its number."""

    run: int
    role: DriveRole
    view: int


EncodedFrames = Mapping[FrameRequest, Mapping[str, str]]
"""Frames of each requested view by camera, as data URIs."""


class FrameSource(Protocol):
    """Source of frames: comparisons that hold them, or files."""

    def __call__(self, requests: Sequence[FrameRequest]) -> EncodedFrames:
        """The frames of some views, by camera."""


def encoded(views: Sequence[View], requests: Iterable[FrameRequest]) -> dict[FrameRequest, dict[str, str]]:
    """Encode the requested frames of one drive."""
    return {one: {name: picture(image) for name, image in sorted(views[one.view].images.items())} for one in requests}


class InMemory:
    """Frames that comparisons hold themselves."""

    def __init__(self, runs: Sequence[Comparison]) -> None:
        self._runs = runs

    def __call__(self, requests: Sequence[FrameRequest]) -> EncodedFrames:
        """The frames of some views, by camera."""
        found: dict[FrameRequest, dict[str, str]] = {}
        for one in requests:
            run = self._runs[one.run]
            found |= encoded(run.reference_views if one.role is DriveRole.REFERENCE else run.query_views, [one])
        return found


@dataclass(frozen=True)
class SamePlace:
    """The same place in both drives of a run: query view, reference place, and a caption."""

    run: int
    view: int
    place: int
    caption: str

    @property
    def requests(self) -> tuple[FrameRequest, FrameRequest]:
        """The views to show."""
        return (
            FrameRequest(self.run, DriveRole.REFERENCE, self.place),
            FrameRequest(self.run, DriveRole.QUERY, self.view),
        )


@dataclass(frozen=True)
class PlaceFrames:
    """Frames of one place, reference above query for each camera, as data URIs."""

    caption: str
    pairs: tuple[tuple[str, str | None, str | None], ...]


@dataclass(frozen=True)
class SensorFrames:
    """Frames as data URIs, or scans as points, of one sensor at a failure; None where there is none.

    In the order: the query view, the place that was answered, the right place.
    """

    sensor: str
    pictures: tuple[str | None, ...] = ()
    scans: tuple[str | None, ...] = ()


@dataclass(frozen=True)
class FailureFrames:
    """A failure in words and pictures."""

    caption: str
    columns: tuple[str, str, str]
    sensors: tuple[SensorFrames, ...]


def frames_of(
    runs: Sequence[Comparison],
    drawn: int,
    failures: Sequence[Failure],
    path: ReferencePath | None,
    wide: Tolerance,
    marked: str,
    source: FrameSource | None,
) -> tuple[tuple[FailureFrames, ...], tuple[PlaceFrames, ...]]:
    """The frames of failures, and of places that both drives of the ``drawn`` run passed, fetched at once."""
    same = same_places(runs, drawn, path, wide, marked)
    shown = (source or InMemory(runs))(
        [request for place in same for request in place.requests]
        + [request for failure in failures for request in failure_requests(failure)]
    )
    failed = tuple(failure_frames(failure, runs, shown) for failure in failures)
    return failed, tuple(one for one in (place_frames(place, shown) for place in same) if one.pairs)


def same_places(
    runs: Sequence[Comparison], drawn: int, path: ReferencePath | None, wide: Tolerance, marked: str
) -> list[SamePlace]:
    """A few places spread over the query drive that both drives of the ``drawn`` run passed.

    Where no truth is known those that the ``marked`` method answered.
    """
    found = [SamePlace(drawn, *one) for one in _same_places(runs[drawn], path, wide, marked)]
    if not found:
        return []
    spread = ((2 * i + 1) * len(found) // (2 * PLACES_SHOWN) for i in range(PLACES_SHOWN))
    return [found[i] for i in dict.fromkeys(spread)]


def _same_places(
    comparison: Comparison, path: ReferencePath | None, wide: Tolerance, marked: str
) -> Iterable[tuple[int, int, str]]:
    for t, view in enumerate(comparison.query_views):
        if path is not None and view.truth is not None:
            k = path.nearest(view.truth)
            if k is not None and path.within(view.truth, wide)[k]:
                there = comparison.named(k)
                yield t, k, f"query view {t}, reference place {there}, {path.apart(k, view.truth):.2f} m apart"
        elif path is None and marked in comparison.beliefs:
            k = comparison.beliefs[marked][t].best
            there = comparison.named(k)
            yield t, k, f"query view {t}, reference place {there} (the answer: no truth is known)"


def place_frames(match: SamePlace, shown: EncodedFrames) -> PlaceFrames:
    """The pictures of a place."""
    reference, query = (shown.get(one, {}) for one in match.requests)
    cameras = sorted({*reference, *query})
    return PlaceFrames(match.caption, tuple((camera, reference.get(camera), query.get(camera)) for camera in cameras))


def failure_requests(failure: Failure) -> tuple[FrameRequest, FrameRequest, FrameRequest]:
    """The views to show at a failure: the query view, the place answered, the right place."""
    return (
        FrameRequest(failure.run, DriveRole.QUERY, failure.view),
        FrameRequest(failure.run, DriveRole.REFERENCE, failure.answer),
        FrameRequest(failure.run, DriveRole.REFERENCE, failure.right),
    )


def failure_frames(failure: Failure, runs: Sequence[Comparison], shown: EncodedFrames) -> FailureFrames:
    """The sensors' frames at a failure."""
    run = runs[failure.run]
    pictures = [shown.get(one, {}) for one in failure_requests(failure)]
    cameras = sorted({camera for of_view in pictures for camera in of_view})
    sensors = [SensorFrames(camera, pictures=tuple(of_view.get(camera) for of_view in pictures)) for camera in cameras]
    views = (run.query_views[failure.view], run.reference_views[failure.answer], run.reference_views[failure.right])
    if any(view.scan is not None for view in views):
        scans = tuple(None if view.scan is None else scan_outline(view.scan) for view in views)
        sensors.append(SensorFrames("laser", scans=scans))
    return FailureFrames(_caption(failure, run), _columns(failure, run), tuple(sensors))


def _caption(failure: Failure, run: Comparison) -> str:
    seed = run.query_metadata.get("seed")
    where = f"query view {failure.view}" + (f" of seed {seed}" if seed is not None else "")
    row = f" The worst of {failure.views} such views in a row." if failure.views > 1 else ""
    away = f"{_away(failure, run)}, P(lost) {failure.lost:.2f}"
    what = {
        Outcome.WRONG: f"{where}: wrong, {away}.",
        Outcome.FALSE_FIX: f"{where}: false fix, {away}.",
        Outcome.MISSED: f"{where}: missed, says lost with {failure.lost:.2f}.",
    }[failure.outcome]
    return what + row


def _away(failure: Failure, run: Comparison) -> str:
    """Distance of the answer's place from the truth, and its turn where that is more than answers may be off by."""
    there, truth = run.reference_views[failure.answer].truth, run.query_views[failure.view].truth
    if there is None or truth is None:
        return "at a place without a true pose"
    turned = abs(wrap(there.heading - truth.heading))
    aside = f", facing {math.degrees(turned):.0f}° another way" if turned > WIDE.heading else ""
    return f"{failure.apart:.1f} m away in a straight line{aside}"


def _columns(failure: Failure, run: Comparison) -> tuple[str, str, str]:
    answer = "would have answered" if failure.outcome is Outcome.MISSED else "answered"
    right = "nearest place" if failure.outcome is Outcome.FALSE_FIX else "right place"
    places = run.named(failure.answer), run.named(failure.right)
    return f"query view {failure.view}", f"{answer}: place {places[0]}", f"{right}: {places[1]}"
