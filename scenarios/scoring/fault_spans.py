"""Faults that a recording tells of, as stretches of its views."""

import json
import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise, takewhile
from typing import Any

from refseq.view import View
from refseq_bench.scenarios.scoring.recovery import apart, is_carried


@dataclass(frozen=True, slots=True)
class FaultSpan:
    """A fault as the views met it: the ``first`` and the ``last`` of them, what it was in words.

    ``carried``: the robot was carried away before the first view, and that was all.
    """

    label: str
    first: int
    last: int
    carried: bool = False


@dataclass(frozen=True, slots=True)
class RouteProgress:
    """Distance of each view along its route [m].

    ``kidnapped`` are the first views after each kidnap that was seen, and ``seen`` the numbers of these kidnaps.
    """

    along: tuple[float, ...]
    kidnapped: tuple[int, ...]
    seen: tuple[int, ...]


def fault_spans(views: Sequence[View], metadata: Mapping[str, object]) -> tuple[FaultSpan, ...]:
    """The faults of a drive, by the ``faults`` of its metadata; those that no view met are left out.

    Of a log from elsewhere, whose metadata may hold anything by that name, only what is told as a simulated drive tells
    it is a fault.

    Metres along the route are counted along the true path, and go on from where a kidnapped robot was set down. As the
    path is a little longer than the route where the robot wandered, a stretch may be a view off.
    """
    faults = sorted(_declared(metadata), key=lambda fault: float(fault["at"]))
    kidnaps = [fault for fault in faults if fault["kind"] == "kidnap"]
    carries = [(float(fault["at"]), float(fault["to"])) for fault in kidnaps]
    way = way_along(views, carries)
    reached = _reached(way, carries)
    carried = [
        FaultSpan(f"kidnap at {carries[kidnap][0]:g} m", view, view, carried=True)
        for kidnap, view in zip(way.seen, way.kidnapped, strict=True)
    ]
    others = [_stretch(fault, views, way.along, reached) for fault in faults if fault["kind"] != "kidnap"]
    found = [*carried, *(one for one in others if one is not None)]
    return tuple(sorted(found, key=lambda one: one.first))


def _declared(metadata: Mapping[str, object]) -> list[dict[str, Any]]:
    text = metadata.get("faults")
    try:
        told = json.loads(text) if isinstance(text, str) else None
    except (ValueError, RecursionError):
        return []
    return [one for one in told if _is_fault(one)] if isinstance(told, list) else []


def _is_fault(told: object) -> bool:
    if not isinstance(told, dict) or not isinstance(told.get("kind"), str):
        return False
    end = "to" if told["kind"] == "kidnap" else "until" if "until" in told else "seconds"
    return all(isinstance(at := told.get(key), int | float) and abs(at) <= sys.float_info.max for key in ("at", end))


def way_along(views: Sequence[View], kidnaps: Sequence[tuple[float, float]]) -> RouteProgress:
    """The way that views lie along the route; ``kidnaps`` are those of the drive in their order, from where to where.

    From the first view without a true pose on nothing is known. A kidnap of less than ``JUMP`` is not seen, and one
    that another carried the robot past did not happen: the one that is seen is that which lies nearest.
    """
    coming, carried, seen = range(len(kidnaps)), list[int](), list[int]()
    along = [0.0] if views else []
    for number, (before, view) in enumerate(pairwise(views), start=1):
        if before.truth is None or view.truth is None:
            along.append(math.nan)
            continue
        step = apart(before.truth, view.truth)
        if coming and is_carried(step, abs(view.distance)):
            kidnap = min(coming, key=lambda one: abs(kidnaps[one][0] - along[-1]))
            (start, end), coming = kidnaps[kidnap], coming[coming.index(kidnap) + 1 :]
            carried.append(number)
            seen.append(kidnap)
            along.append(end + max(0.0, abs(view.distance) - (start - along[-1])))
        else:
            along.append(along[-1] + step)
    return RouteProgress(tuple(along), tuple(carried), tuple(seen))


def _reached(way: RouteProgress, kidnaps: Sequence[tuple[float, float]]) -> list[float]:
    """The farthest along the route that the robot came between each view and the one before [m]."""
    reached = list(way.along)
    for kidnap, view in zip(way.seen, way.kidnapped, strict=True):
        reached[view] = max(reached[view], kidnaps[kidnap][0])
    return reached


def _stretch(
    fault: Mapping[str, Any], views: Sequence[View], along: Sequence[float], reached: Sequence[float]
) -> FaultSpan | None:
    """A fault that lasts a while, by its metres along the route, or by its seconds."""
    at, what = float(fault["at"]), _words(fault)
    begin = next((t for t, way in enumerate(reached) if way >= at), None)
    if begin is None:
        return None
    if "until" in fault:
        # It happens once: where the robot is carried out of its stretch, and passes it again, it is over.
        inside = list(takewhile(lambda t: at <= along[t] < float(fault["until"]), range(begin, len(views))))
    else:
        # It began between two views, so that its time is counted from the one before; one view it meets at least.
        over = views[max(begin - 1, 0)].time + float(fault["seconds"])
        inside = [begin, *(t for t in range(begin + 1, len(views)) if views[t].time <= over)]
    return FaultSpan(f"{what} from {at:g} m", inside[0], inside[-1]) if inside else None


def _words(fault: Mapping[str, Any]) -> str:
    """A fault's kind as people say it, with the camera that it is about."""
    kind = fault["kind"].replace("-", " ")
    return f"{fault['camera']} {kind.removeprefix('camera ')}" if "camera" in fault else kind
