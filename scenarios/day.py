"""How alike a place looks over the day: which of a reference picture's SIFT keys are found again at other hours."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from refseq.features.sift import Keys, SiftSettings, SiftWords
from scenarios.stills import Still

SAME_PLACE = 3.0
"""A key is found again where it was, within this distance [pixels]: the robot stands still, only the light changes."""
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00")
"""Colours that colour-blind people can tell apart (Okabe and Ito)."""


@dataclass(frozen=True, slots=True)
class Recall:
    """One picture against the reference picture of its place and camera: ``share`` of its ``keys`` found again."""

    light: str
    along: float
    camera: str
    keys: int
    share: float


def recalls(stills: Sequence[Still], reference: Sequence[Still], settings: SiftSettings) -> list[Recall]:
    """Compare each still with the ``reference`` still of the same place."""
    finders: dict[str, SiftWords] = {}

    def keys(still: Still, camera: str) -> Keys:
        return finders.setdefault(camera, SiftWords(camera, settings)).keys(still.images[camera])

    known = {(still.along, camera): keys(still, camera) for still in reference for camera in still.images}
    return [
        Recall(still.light, still.along, camera, len(known[still.along, camera].points), share)
        for still in stills
        for camera in still.images
        for share in [found_again(known[still.along, camera], keys(still, camera), settings.alias_distance)]
    ]


def found_again(reference: Keys, other: Keys, alias_distance: float) -> float:
    """Share of the reference's keys whose nearest key by descriptor is the same word and lies at the same place.

    0 where the reference has no keys.
    """
    if len(reference.points) == 0 or len(other.points) == 0:
        return 0.0
    known, seen = reference.descriptors.astype(np.float32), other.descriptors.astype(np.float32)
    squared = (known**2).sum(1)[:, None] + (seen**2).sum(1) - 2 * known @ seen.T  # (n, m)
    nearest = squared.argmin(axis=1)
    alike = squared[np.arange(len(known)), nearest] <= alias_distance**2
    moved = np.linalg.norm(reference.points - other.points[nearest], axis=1)
    return float(np.mean(alike & (moved <= SAME_PLACE)))


def day_curve(
    title: str, found: Sequence[Recall], hours: Mapping[str, float], lux: Mapping[float, Sequence[float]]
) -> Figure:
    """Draw the shares over the hours, a panel for each camera, and the light at each place [lx] below them."""
    cameras, places = (list(dict.fromkeys(getattr(r, key) for r in found)) for key in ("camera", "along"))
    with mpl.rc_context({"font.size": 10, "axes.spines.top": False, "axes.spines.right": False}):
        figure = Figure(figsize=(9, 2.4 * len(cameras) + 2.2), layout="constrained", facecolor="white")
        panels = figure.subplots(len(cameras) + 1, 1, sharex=True)
        figure.suptitle(title)
        for axes, camera in zip(panels, cameras, strict=False):
            _shares(axes, [r for r in found if r.camera == camera], hours)
            axes.set_title(camera, loc="left", fontsize=10)
        for colour, place in zip(COLOURS, places, strict=False):
            panels[-1].plot(list(hours.values()), lux[place], color=colour, marker=".", label=f"{place:g} m")
        panels[-1].set(yscale="log", ylabel="light [lx]", xlabel="hour of the day [h]")
        panels[-1].grid(alpha=0.3)
        panels[0].legend(title="along the route", ncols=len(places), loc="upper right")
    return figure


def _shares(axes: Axes, found: Sequence[Recall], hours: Mapping[str, float]) -> None:
    for colour, place in zip(COLOURS, dict.fromkeys(r.along for r in found), strict=False):
        here = [r for r in found if r.along == place]
        axes.plot(
            [hours[r.light] for r in here],
            [100 * r.share for r in here],
            color=colour,
            marker=".",
            label=f"{place:g} m",
        )
    axes.set(ylim=(0, 100), ylabel="keys found again [%]")
    axes.grid(alpha=0.3)
