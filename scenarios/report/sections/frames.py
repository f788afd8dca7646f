"""The frames of a report: the same places in both drives, and what was seen at the worst failures."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

from refseq.view import View
from scenarios.report.page import picture, scan_outline
from scenarios.scoring.comparison import Comparison
from scenarios.scoring.outcome import Outcome
from scenarios.scoring.path_geometry import ReferencePath, Tolerance
from scenarios.scoring.worst_failures import Failure

PLACES_SHOWN = 4
"""Matching places whose frames are shown for each section."""


class Side(StrEnum):
    """Of which drive a view is."""

    REFERENCE = "reference"
    QUERY = "query"


@dataclass(frozen=True, slots=True)
class Wanted:
    """A view whose frames are to be shown: of which run, of which drive, its number."""

    run: int
    side: Side
    view: int


Encoded = Mapping[Wanted, Mapping[str, str]]
"""For each view that was wanted its frames by camera, as data URIs."""


class Pictures(Protocol):
    """Where frames come from: comparisons may hold them, or they lie on a disk."""

    def __call__(self, wanted: Sequence[Wanted]) -> Encoded:
        """The frames of some views, by camera."""


def encoded(views: Sequence[View], wanted: Iterable[Wanted]) -> dict[Wanted, dict[str, str]]:
    """The frames of those views of one drive that are wanted."""
    return {one: {name: picture(image) for name, image in sorted(views[one.view].images.items())} for one in wanted}


class InMemory:
    """Frames that comparisons hold themselves."""

    def __init__(self, runs: Sequence[Comparison]) -> None:
        self._runs = runs

    def __call__(self, wanted: Sequence[Wanted]) -> Encoded:
        """The frames of some views, by camera."""
        found: dict[Wanted, dict[str, str]] = {}
        for one in wanted:
            run = self._runs[one.run]
            found |= encoded(run.reference_views if one.side is Side.REFERENCE else run.query_views, [one])
        return found


@dataclass(frozen=True)
class Match:
    """The same place in both drives of the first run: query view, reference place, and words about them."""

    view: int
    place: int
    caption: str

    @property
    def wanted(self) -> tuple[Wanted, Wanted]:
        """The views to show."""
        return Wanted(0, Side.REFERENCE, self.place), Wanted(0, Side.QUERY, self.view)


@dataclass(frozen=True)
class Frames:
    """Pictures of one place, reference above query for each camera, as data URIs."""

    caption: str
    pairs: tuple[tuple[str, str | None, str | None], ...]


@dataclass(frozen=True)
class Sight:
    """What one sensor saw at a failure: frames as data URIs, or scans as points; None where there is none.

    In the order: the query view, the place that was answered, the right place.
    """

    sensor: str
    pictures: tuple[str | None, ...] = ()
    scans: tuple[str | None, ...] = ()


@dataclass(frozen=True)
class FailureShown:
    """A failure in words and pictures."""

    caption: str
    columns: tuple[str, str, str]
    sights: tuple[Sight, ...]


def matches(comparison: Comparison, path: ReferencePath | None, wide: Tolerance, marked: str) -> list[Match]:
    """A few places spread over the query drive that both drives passed.

    Where no truth is known those that the ``marked`` method answered.
    """
    found = list(_matches(comparison, path, wide, marked))
    if not found:
        return []
    spread = ((2 * i + 1) * len(found) // (2 * PLACES_SHOWN) for i in range(PLACES_SHOWN))
    return [found[i] for i in dict.fromkeys(spread)]


def _matches(comparison: Comparison, path: ReferencePath | None, wide: Tolerance, marked: str) -> Iterable[Match]:
    for t, view in enumerate(comparison.query_views):
        if path is not None and view.truth is not None:
            k = path.nearest(view.truth)
            if k is not None and path.within(view.truth, wide)[k]:
                there = comparison.named(k)
                yield Match(t, k, f"query view {t}, reference place {there}, {path.apart(k, view.truth):.2f} m apart")
        elif path is None and marked in comparison.beliefs:
            k = comparison.beliefs[marked][t].best
            there = comparison.named(k)
            yield Match(t, k, f"query view {t}, reference place {there} (the answer: no truth is known)")


def frames(match: Match, shown: Encoded) -> Frames:
    """The pictures of a place."""
    reference, query = (shown.get(one, {}) for one in match.wanted)
    cameras = sorted({*reference, *query})
    return Frames(match.caption, tuple((camera, reference.get(camera), query.get(camera)) for camera in cameras))


def failure_wanted(failure: Failure) -> tuple[Wanted, Wanted, Wanted]:
    """The views to show at a failure: the query view, the place answered, the right place."""
    return (
        Wanted(failure.run, Side.QUERY, failure.view),
        Wanted(failure.run, Side.REFERENCE, failure.answer),
        Wanted(failure.run, Side.REFERENCE, failure.right),
    )


def failure_shown(failure: Failure, runs: Sequence[Comparison], shown: Encoded) -> FailureShown:
    """What was seen at a failure."""
    run = runs[failure.run]
    pictures = [shown.get(one, {}) for one in failure_wanted(failure)]
    cameras = sorted({camera for of_view in pictures for camera in of_view})
    sights = [Sight(camera, pictures=tuple(of_view.get(camera) for of_view in pictures)) for camera in cameras]
    views = (run.query_views[failure.view], run.reference_views[failure.answer], run.reference_views[failure.right])
    if any(view.scan is not None for view in views):
        scans = tuple(None if view.scan is None else scan_outline(view.scan) for view in views)
        sights.append(Sight("laser", scans=scans))
    return FailureShown(_caption(failure, run), _columns(failure, run), tuple(sights))


def _caption(failure: Failure, run: Comparison) -> str:
    seed = run.query_metadata.get("seed")
    where = f"query view {failure.view}" + (f" of seed {seed}" if seed is not None else "")
    row = f" The worst of {failure.views} such views in a row." if failure.views > 1 else ""
    what = {
        Outcome.WRONG: f"{where}: wrong by {failure.apart:.1f} m, P(lost) {failure.lost:.2f}.",
        Outcome.FALSE_FIX: f"{where}: false fix, {failure.apart:.1f} m away, P(lost) {failure.lost:.2f}.",
        Outcome.MISSED: f"{where}: missed, says lost with {failure.lost:.2f}.",
    }[failure.outcome]
    return what + row


def _columns(failure: Failure, run: Comparison) -> tuple[str, str, str]:
    answer = "would have answered" if failure.outcome is Outcome.MISSED else "answered"
    right = "nearest place" if failure.outcome is Outcome.FALSE_FIX else "right place"
    places = run.named(failure.answer), run.named(failure.right)
    return f"query view {failure.view}", f"{answer}: place {places[0]}", f"{right}: {places[1]}"
