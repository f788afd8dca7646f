"""Likeness of a place over the day: SIFT keys of a reference picture that are found again at other hours."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from refseq.features.sift import SiftSettings, SiftWords
from refseq.features.word_extractor import PictureKeys
from refseq_bench.scenarios.drives.drive import Drive
from refseq_bench.scenarios.tables import TextTable
from refseq_bench.scenarios.world_survey.facts import lux_text
from refseq_bench.scenarios.world_survey.snapshots import Snapshot, snapshots
from refseq_bench.worlds.light import LightSetting, clock_text
from refseq_bench.worlds.meter import Meter
from refseq_bench.worlds.plans.load import load_plan

SAME_PLACE = 3.0
"""A key is found again where it was, within this distance [pixels]: the robot stands still, only the light changes."""
METER_HEIGHT = 1.0
"""Height of the light meter above the floor [m]."""
OTHER_NOISE = 1000
"""Added to the drive's seed for the reference pictures, so that no two pictures share their noise."""


@dataclass(frozen=True, slots=True)
class Day:
    """Pictures of ``drive`` in its own light, and in ``lights``, at ``places`` along its route [m]."""

    drive: Drive
    lights: tuple[LightSetting, ...]
    places: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Recall:
    """A picture at an ``hour`` against the reference of its place and camera: ``share`` of ``keys`` found again.

    ``lux`` is the illuminance on level ground 1 m above the floor.
    """

    hour: float
    along: float
    camera: str
    keys: int
    share: float
    lux: float


def through_the_day(day: Day, settings: SiftSettings | None = None) -> list[Recall]:
    """Take all the pictures and compare them."""
    settings = settings or SiftSettings()
    before = replace(day.drive, seed=day.drive.seed + OTHER_NOISE)
    known = {(shot.along, camera): keys for shot in snapshots(before, [before.light], day.places)
             for camera, keys in _keys(shot, settings)}  # fmt: skip
    hours = {setting.name: setting for setting in day.lights}
    plan = load_plan(day.drive.world)
    meters = {name: Meter(plan, setting) for name, setting in hours.items()}
    return [
        Recall(
            hours[shot.light].hour,
            shot.along,
            camera,
            len(known[shot.along, camera].points),
            found_again(known[shot.along, camera], keys, settings.alias_distance),
            meters[shot.light].read((shot.pose.x, shot.pose.y, METER_HEIGHT)).total,
        )
        for shot in snapshots(day.drive, list(hours), day.places)
        for camera, keys in _keys(shot, settings)
    ]


def _keys(shot: Snapshot, settings: SiftSettings) -> Iterator[tuple[str, PictureKeys]]:
    for camera, image in shot.images.items():
        yield camera, SiftWords(camera, settings).keys(image)


def found_again(reference: PictureKeys, other: PictureKeys, alias_distance: float) -> float:
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


# --- to look at ---


def day_table(found: Sequence[Recall]) -> TextTable:
    """Shares [%] by hour, a column for each place and camera; the light [lx] in a column for each place."""
    places, cameras = (list(dict.fromkeys(getattr(r, key) for r in found)) for key in ("along", "camera"))
    cells = {(r.hour, r.along, r.camera): r for r in found}
    headings = []
    for place in places:
        keys = [cells[found[0].hour, place, camera].keys for camera in cameras]
        headings += [f">{place:g} m\n{camera}\n% of {of}" for camera, of in zip(cameras, keys, strict=True)] + [">lx"]
    table = TextTable("hour", *headings)
    table.padding = 0  # or three places of two cameras would not fit a terminal of 80 characters
    for hour in dict.fromkeys(r.hour for r in found):
        row = []
        for place in places:
            row += [f"{100 * cells[hour, place, camera].share:.0f}" for camera in cameras]
            row.append(lux_text(cells[hour, place, cameras[0]].lux))
        table.add_row(clock_text(hour), *row)
    return table
