"""Page of joins to confirm: scans laid on each other, where in the plan, and what speaks against each, worst first."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from refseq.atlas.decision import Decision
from refseq.atlas.merge import FoundOverlap, Merged
from refseq.atlas.scans import ScannedPath, ScanWindow, windows
from refseq.atlas.sharing import track_of
from refseq.files import replace_text
from refseq.map.map import Map
from refseq.pose_graph import motions_between, moved
from refseq_bench.scenarios.drives.inputs import writing
from refseq_bench.scenarios.report.page import rendered

REACH = 15.0
"""Range of drawn scans [m]."""
SHOWN = 3
"""Windows of a join whose scans are shown, those that lie worst on each other first."""
SCRIPT = "joins.js"


@dataclass(frozen=True)
class DrawnWay:
    """A line of the plan: its ``look``, a class of the page's style, ``points`` as SVG has them, and ``width``."""

    look: str
    points: str
    width: int


@dataclass(frozen=True)
class DrawnPlan:
    """Lines of a plan, the ``box`` that they lie in, and what the plan is."""

    ways: tuple[DrawnWay, ...]
    box: str
    caption: str


@dataclass(frozen=True)
class DrawnScans:
    """Scans of a pair of ``views`` as SVG paths, and the ``share`` of beams that meet the same walls."""

    views: tuple[int, int]
    share: str
    mine: str
    its: str
    box: str


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
    scans: tuple[DrawnScans, ...]


def write_joins_page(path: Path, merged: Merged, title: str) -> None:
    """Write the page of a merging's joins to ``path``, replacing it in one step."""
    order = worst_first(merged)
    cards = [_card(merged.map, merged.decisions[n], merged.found[n]) for n in order]
    left_out = len(merged.decisions) - len(order)
    page = rendered("joins.html.j2", SCRIPT, title=title, joins=cards, left_out=left_out, reach_drawn=f"{REACH:g}")
    with writing(path):
        replace_text(path, page)


def worst_first(merged: Merged) -> list[int]:
    """Numbers of the decisions to be shown: doubtful joins, what was refused by others, then joins that are sure.

    Of joins those with the least evidence come first, of refused ones those with most. What was objected to by itself
    is not shown.
    """

    def rank(n: int) -> tuple[int, float]:
        overlap = merged.found[n].overlap
        if not merged.decisions[n].joined:
            return 1, -overlap.evidence
        return (0 if overlap.doubt else 2), overlap.evidence

    shown = [n for n, one in enumerate(merged.found) if merged.decisions[n].joined or not one.overlap.objection]
    return sorted(shown, key=rank)


def _card(map_: Map, decision: Decision, found: FoundOverlap) -> JoinCard:
    # A decision names the path first that was merged first, a stretch the one that keeps the places.
    turned = map_.paths[found.one].name != decision.one
    one, other = (found.other, found.one) if turned else (found.one, found.other)
    pairs = found.views[:, ::-1] if turned else found.views
    tracks = [track_of(map_, map_.paths[path]) for path in (one, other)]
    known = [ScannedPath.of(track, map_.paths[path].scans) for track, path in zip(tracks, (one, other), strict=True)]
    mine, its = known
    scans = [] if mine is None or its is None else _worst_scans(mine, its, pairs)
    return JoinCard(
        decision.one,
        decision.other,
        decision.first,
        decision.second,
        decision.lengths,
        decision.joined,
        decision.why,
        "" if decision.why.endswith(found.overlap.doubt) else found.overlap.doubt,
        _table(decision),
        _plan(map_, (one, other), pairs),
        tuple(scans),
    )


def _table(decision: Decision) -> str:
    rows = {"one": decision.one, "other": decision.other, "first": decision.first, "second": decision.second}
    return "".join(f"{key} = {json.dumps(value, ensure_ascii=False)}\n" for key, value in rows.items())


def _worst_scans(one: ScannedPath, other: ScannedPath, pairs: NDArray[np.intp]) -> list[DrawnScans]:
    laid = sorted(windows(one, other, pairs), key=lambda window: window.share)
    return [_scans(one, other, window) for window in laid[:SHOWN]]


def _scans(one: ScannedPath, other: ScannedPath, window: ScanWindow) -> DrawnScans:
    mine, its = window.middle
    points = other.walls(its).points
    there = moved(window.motion, np.column_stack([points, np.zeros(len(points))]))[:, :2]
    near = [each[np.hypot(*each.T) <= REACH] for each in (one.walls(mine).points, there)]
    behind = max(1.0, *(-each[:, 0].min(initial=0.0) for each in near))
    box = f"{-10 * REACH:g} {-10 * REACH:g} {20 * REACH:g} {10 * (REACH + behind):.0f}"
    return DrawnScans(window.middle, f"{window.share:.1%}", _dots(near[0]), _dots(near[1]), box)


def _dots(points: NDArray[np.float64]) -> str:
    """Points about the robot, which looks up, as an SVG path of dots [dm]."""
    return "".join(f"M{-10 * y:.1f} {-10 * x:.1f}h0" for x, y in points.tolist())


def _plan(map_: Map, paths: tuple[int, int], pairs: NDArray[np.intp]) -> DrawnPlan:
    """Both paths with the stretches of a join: in the frame of all joins, or as this join alone lays them."""
    poses = [map_.paths[path].poses for path in paths]
    if all(len(each) for each in poses):
        caption = "Where all joins that were made put the paths."
        ways = [_way("way", path.poses, 1) for path in map_.paths if len(path.poses)]
    else:
        caption = "Where this join alone would put the paths, by their odometry."
        poses = [track_of(map_, map_.paths[path]) for path in paths]
        if not all(len(each) for each in poses):
            return DrawnPlan((), "0 0 1 1", "No odometry, no plan.")
        i, j = pairs[len(pairs) // 2]
        poses[1] = moved(poses[0][i], motions_between(poses[1][j], poses[1]))
        ways = [_way("way", each, 1) for each in poses]
    drawn = np.concatenate([*poses, *(p.poses for p in map_.paths if len(p.poses) and len(ways) > len(paths))])
    for look, each, views in zip(("way-its", "way-mine"), poses[::-1], pairs.T[::-1], strict=True):
        ways.append(_way(look, each[views.min() : views.max() + 1], 6 if look == "way-its" else 2))
    return DrawnPlan(tuple(ways), _box(drawn), caption)


def _way(look: str, poses: NDArray[np.float64], width: int) -> DrawnWay:
    return DrawnWay(look, " ".join(f"{x:.2f},{-y:.2f}" for x, y in poses[:, :2].tolist()), width)


def _box(poses: NDArray[np.float64]) -> str:
    (left, top), (width, height) = poses[:, :2].min(axis=0), np.ptp(poses[:, :2], axis=0)
    return f"{left - 2:.1f} {-top - height - 2:.1f} {width + 4:.1f} {height + 4:.1f}"
