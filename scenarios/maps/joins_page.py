"""Page of joins to confirm: pictures and scans side by side, the plan, and what speaks against each, worst first."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from refseq.atlas.decision import Decision
from refseq.atlas.found import FoundOverlap
from refseq.atlas.merge import Merged
from refseq.atlas.scans import ScannedPath, ScanWindow, windows
from refseq.files import replace_text
from refseq.map.map import Map
from refseq.pose_graph import motions_between, moved
from refseq_bench.scenarios.drives.inputs import writing
from refseq_bench.scenarios.maps.joins_plan import DrawnPlan, drawn_plan
from refseq_bench.scenarios.maps.joins_scans import REACH, DrawnScans, drawn_scans
from refseq_bench.scenarios.maps.view_pictures import ViewPictures, view_pictures
from refseq_bench.scenarios.report.page import rendered
from refseq_bench.text_file import toml_lines

SCRIPT = "joins.js"
CONTRADICTED = "odometry and the other joins contradict it"
CLOSE = 2
"""Spots so many pairs from each other are shown once."""


@dataclass(frozen=True)
class CameraPair:
    """One camera's pictures of both views of a pair as data URIs, empty where there is none."""

    camera: str
    mine: str
    its: str


@dataclass(frozen=True)
class Spot:
    """A pair of ``views`` of a join that is looked at: its ``mark`` in the plan, and why it is looked at."""

    mark: str
    title: str
    views: tuple[int, int]
    scans: DrawnScans | None
    cameras: tuple[CameraPair, ...]


@dataclass(frozen=True)
class JoinCard:
    """A join on the page; ``toml`` is its table without the decision."""

    one: str
    other: str
    first: tuple[int, int]
    second: tuple[int, int]
    lengths: tuple[float, float]
    joined: bool
    why: str
    doubt: str
    toml: str
    plan: DrawnPlan
    spots: tuple[Spot, ...]

    @property
    def has_pictures(self) -> bool:
        """True where a picture is shown."""
        return any(spot.cameras for spot in self.spots)


def write_joins_page(
    path: Path, merged: Merged, title: str, members: Sequence[Map] = (), recordings: Sequence[Path] = ()
) -> None:
    """Write the page of a merging's joins to ``path``, replacing it in one step.

    Pictures are those of the ``recordings`` that the ``members``, the maps that were merged, were learnt from.
    """
    order = worst_first(merged)
    looks = [_Look(merged.map, merged.decisions[n], merged.found[n], merged.strained) for n in order]
    pictures = view_pictures(members, recordings, _wanted(looks)) if recordings else {}
    cards = [look.card(pictures) for look in looks]
    left_out = len(merged.decisions) - len(order)
    content = {"joins": cards, "left_out": left_out, "asked": bool(recordings), "reach_drawn": f"{REACH:g}"}
    page = rendered("joins.html.j2", SCRIPT, title=title, **content)
    with writing(path):
        replace_text(path, page)


def worst_first(merged: Merged) -> list[int]:
    """Numbers of the decisions to be shown, worst first.

    Joins of a person that others contradict, doubtful joins, what was refused by others, then joins that are sure.
    Of joins those with the least evidence come first, of refused ones those with most. What was objected to by itself
    is not shown.
    """

    def rank(n: int) -> tuple[int, float]:
        overlap = merged.found[n].overlap
        if merged.decisions[n] in merged.strained:
            return -1, overlap.evidence
        if not merged.decisions[n].joined:
            return 1, -overlap.evidence
        return (0 if overlap.doubt else 2), overlap.evidence

    shown = [n for n, one in enumerate(merged.found) if merged.decisions[n].joined or not one.overlap.objection]
    return sorted(shown, key=rank)


def _wanted(looks: Sequence["_Look"]) -> Mapping[str, set[int]]:
    """Views whose pictures are shown, by path."""
    wanted: dict[str, set[int]] = {}
    for look in looks:
        for _, pair in look.spots:
            for name, view in zip(look.names, look.pairs[pair].tolist(), strict=True):
                wanted.setdefault(name, set()).add(view)
    return wanted


class _Look:
    """A join, with the path first that its decision names first, and the pairs of views at which it is looked."""

    def __init__(self, map_: Map, decision: Decision, found: FoundOverlap, contradicted: Sequence[Decision]) -> None:
        self._map, self._decision, self._overlap = map_, decision, found.overlap
        self._contradicted = decision in contradicted
        turned = map_.paths[found.one].name != decision.one
        self.paths = (found.other, found.one) if turned else (found.one, found.other)
        self.pairs: NDArray[np.intp] = found.views[:, ::-1] if turned else found.views
        self.names = decision.one, decision.other
        mine, its = (_scanned(map_, path, found.scale if path == found.other else 1.0) for path in self.paths)
        self._scanned = None if mine is None or its is None else (mine, its)

    @cached_property
    def _windows(self) -> list[ScanWindow]:
        return windows(*self._scanned, self.pairs) if self._scanned else []

    def _window(self, pair: int) -> ScanWindow:
        """The window that a pair lies in."""
        ends = np.cumsum([len(window.pairs) for window in self._windows])
        return self._windows[int(np.searchsorted(ends, pair, side="right"))]

    @cached_property
    def spots(self) -> list[tuple[str, int]]:
        """Pairs to be looked at, by their numbers in order: both ends, the middle, and where scans fit worst."""
        last = len(self.pairs) - 1
        titles = {0: "begin", last // 2: "middle", last: "end"}
        if self._windows:
            starts = np.cumsum([0, *(len(window.pairs) for window in self._windows)])
            worst = int(np.argmin([window.share for window in self._windows]))
            pair = int(starts[worst]) + len(self._windows[worst].pairs) // 2
            near = min(titles, key=lambda n: abs(n - pair))
            titles[near if abs(near - pair) <= CLOSE else pair] = "where scans fit worst"
        return [(titles[pair], pair) for pair in sorted(titles)]

    def card(self, pictures: ViewPictures) -> JoinCard:
        """The join as the page shows it."""
        decision, doubt = self._decision, CONTRADICTED if self._contradicted else self._overlap.doubt
        spots = tuple(
            self._spot(mark, title, pair, pictures) for mark, (title, pair) in zip("ABCD", self.spots, strict=False)
        )
        marked = {spot.mark: spot.views[0] for spot in spots}
        return JoinCard(
            decision.one,
            decision.other,
            decision.first,
            decision.second,
            decision.lengths,
            decision.joined,
            decision.why,
            "" if decision.why.endswith(doubt) else doubt,
            _table(decision),
            drawn_plan(self._map, self.paths, self.pairs, marked),
            spots,
        )

    def _spot(self, mark: str, title: str, pair: int, pictures: ViewPictures) -> Spot:
        mine, its = self.pairs[pair].tolist()
        ours, theirs = pictures.get((self.names[0], mine), {}), pictures.get((self.names[1], its), {})
        cameras = tuple(CameraPair(name, ours.get(name, ""), theirs.get(name, "")) for name in sorted({*ours, *theirs}))
        scans = None
        if self._scanned is not None:
            window = self._window(pair)
            scans = drawn_scans(*self._scanned, (mine, its), _motion(self._scanned, window, mine, its), window.share)
        return Spot(mark, title, (mine, its), scans, cameras)


def _scanned(map_: Map, path: int, scale: float) -> ScannedPath | None:
    """A path of a map by an odometer of another scale; None where it has no scans."""
    found = ScannedPath.of(map_.track(map_.paths[path]), map_.paths[path].scans)
    return found and found.scaled(scale)


def _motion(scanned: tuple[ScannedPath, ScannedPath], window: ScanWindow, mine: int, its: int) -> NDArray[np.float64]:
    """Pose of one path's view in that of the other, (3,), as their window is laid, by odometry within it."""
    (one, other), (i, j) = scanned, window.middle
    at_middle = moved(motions_between(one.track[mine], one.track[i]), window.motion)
    return moved(at_middle, motions_between(other.track[j], other.track[its]))


def _table(decision: Decision) -> str:
    return toml_lines(
        {"one": decision.one, "other": decision.other, "first": decision.first, "second": decision.second}
    )
