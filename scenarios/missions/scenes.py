"""Scenes from recordings: cut one where the robot was so far along its way, and look for one in a whole drive."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from refseq.dead_reckoning import way_along
from refseq.logs import open_log
from refseq.scenes import Box, Scene, SceneApproach, SceneFinder, cut_scene
from refseq_bench.scenarios.drives.inputs import plan_drive
from refseq_bench.scenarios.errors import ScenarioError


def cut_from(log: Path, at: float, camera: str, box: str | None) -> Scene:
    """Cut a scene from the view that was taken nearest to ``at`` [m by odometry]; ``box`` is X,Y,WIDTH,HEIGHT.

    Raises ``ScenarioError``, ``LogError``, and ``SceneError`` also for a scene that could not be found again.
    """
    wanted = None if box is None else box_from(box)
    plan = plan_drive(open_log(log))
    along = way_along(plan.views)
    if not 0 <= at <= along[-1]:
        raise ScenarioError(f"{log}: --along {at:g} m is not on the drive; valid is 0 to {along[-1]:.1f} m")
    number = int(np.abs(along - at).argmin())
    view = next(plan.between(slice(number, number + 1)).read())
    scene = cut_scene(view, camera, wanted, drive=log.name, along=float(along[number]))
    SceneFinder(scene)
    return scene


def box_from(text: str) -> Box:
    """A box as it is typed. Raises ``ScenarioError``."""
    try:
        x, y, width, height = map(int, text.split(","))
    except ValueError:
        raise ScenarioError(f"box {text!r:.60} is not valid; it should be X,Y,WIDTH,HEIGHT in pixels") from None
    return Box(x, y, width, height)


@dataclass(frozen=True, slots=True)
class SceneView:
    """A view in which the scene was seen: how far along the drive it was taken [m], and how many keys agree.

    ``left`` [m] is how far it was from there to where the scene was cut, None while one cannot tell yet.
    """

    along: float
    inliers: int
    left: float | None


@dataclass(frozen=True, slots=True)
class SceneSearch:
    """The views of a drive in which the scene was seen, of so many ``views``; at ``place`` [m] the robot is there."""

    views: int
    seen: tuple[SceneView, ...]
    place: float | None


def search(scene: Scene, log: Path) -> SceneSearch:
    """Look for a scene along a drive as a mission does, up to where the robot would be at it, or to the end."""
    plan = plan_drive(open_log(log))
    finder, approach = SceneFinder(scene), SceneApproach(scene)
    seen: list[SceneView] = []
    place: float | None = None
    along = way_along(plan.views).tolist()
    for reading, view in zip(along, plan.read(), strict=True):
        if place is not None and reading >= place:
            break
        sighting = finder.find(view)
        left = approach.update(sighting, reading)
        if sighting is not None:
            seen.append(SceneView(reading, sighting.inliers, left))
        if left is not None:
            place = reading + max(left, 0.0)
    return SceneSearch(len(along), tuple(seen), place)
