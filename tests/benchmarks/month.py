"""A month in one atlas: drives of two robots in changing light and a changing world, each asked before it is added.

    python -m tests.benchmarks.month FOLDER

Drives that FOLDER lacks are recorded there; ``month.csv`` and ``month.png`` are written into it.
"""

import csv
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import cv2
import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray

from refseq import Map, MapError, Recording, add_drive, learn, read_recording
from refseq.atlas.merge import merge_maps
from refseq.belief import LOST_ABOVE
from refseq.map.growth.seen import seen_drive
from refseq_bench.scenarios.cli.app import exit_code

WORLD, TOLERANCE = "offices", 1.5


@dataclass(frozen=True)
class Day:
    """A drive on a day of June 2008: the world's ``change`` and the ``light`` that it meets."""

    day: int
    light: str
    robot: str
    change: str


DAYS = (
    Day(1, "16:00,cloud=0", "robuter", "people=0,doors=0,furniture=0,posters=0"),
    Day(1, "16:30,cloud=0", "segway_rmp", "people=0,doors=0,furniture=0,posters=0"),
    Day(3, "18:00,cloud=0.2", "robuter", "people=0.1,doors=0.1,furniture=0.1,posters=0"),
    Day(5, "10:00,cloud=0.6", "segway_rmp", "people=0.2,doors=0.1,furniture=0.1,posters=0.1"),
    Day(8, "21:30,cloud=0", "robuter", "people=0,doors=0.2,furniture=0.1,posters=0.1"),
    Day(10, "09:00,cloud=0.9", "robuter", "people=0.3,doors=0.2,furniture=0.2,posters=0.1"),
    Day(13, "19:30,cloud=0.3", "segway_rmp", "people=0.2,doors=0.2,furniture=0.2,posters=0.2"),
    Day(15, "12:30,cloud=0", "robuter", "people=0.4,doors=0.3,furniture=0.2,posters=0.2"),
    Day(18, "22:00,cloud=0.5", "segway_rmp", "people=0,doors=0.3,furniture=0.3,posters=0.3"),
    Day(20, "07:30,cloud=0", "robuter", "people=0.2,doors=0.3,furniture=0.3,posters=0.3"),
    Day(23, "20:30,cloud=0.7", "robuter", "people=0.2,doors=0.4,furniture=0.4,posters=0.4"),
    Day(25, "14:00,cloud=0.4", "segway_rmp", "people=0.5,doors=0.4,furniture=0.4,posters=0.5"),
    Day(28, "18:45,cloud=0.1", "robuter", "people=0.3,doors=0.5,furniture=0.5,posters=0.5"),
    Day(30, "21:00,cloud=0.8", "robuter", "people=0.1,doors=0.5,furniture=0.5,posters=0.6"),
)
"""The first two make the atlas, one path a robot."""


@dataclass(frozen=True)
class Figures:
    """Answers of one map to a drive: success within 1.5 m by single views and by the chain [%], and its cost."""

    day: int
    robot: str
    light: str
    map: str
    single: float
    chain: float
    kilobytes: float
    milliseconds: float
    kept: int = 0
    forgotten: int = 0


def recorded(folder: Path, number: int, day: Day) -> Recording:
    """The drive of a day, recorded where it is not there yet."""
    hour = day.light.partition(",")[0].replace(":", "")
    file = folder / f"{number + 1:02d}-{day.day:02d}-{hour}-{day.robot}.mcap"
    if not file.exists():
        light = f"{day.light},date=2008-06-{day.day:02d}"
        asked = ["--light", light, "--change", day.change, "--change-seed", str(number + 1), "--robot", day.robot]
        if code := exit_code(["record", WORLD, *asked, "--seed", str(101 + number), "-o", str(file)]):
            sys.exit(code)
    return read_recording(file)


def asked(map_: Map, drive: Recording, day: Day, name: str) -> Figures:
    """Answers of a map to a drive."""
    begin = time.process_time()
    seen = seen_drive(map_, drive.views)
    spent = (time.process_time() - begin) / len(drive.views)
    alone, online = (success(map_, drive, [getattr(view, by) for view in seen]) for by in ("alone", "online"))
    size = len(map_.to_bytes()) / 1000
    told = day.light.partition(",")[0]
    return Figures(day.day, day.robot, told, name, alone, online, size, 1000 * spent)


def success(map_: Map, drive: Recording, answers: Sequence[NDArray[np.float64]]) -> float:
    """Share of views found within the tolerance [%]; ``answers`` are probabilities of places, (K,) each."""
    right = 0
    for places, view in zip(answers, drive.views, strict=True):
        pose, truth = map_.poses[int(np.argmax(places))], view.truth
        near = pose and truth and np.hypot(pose.x - truth.x, pose.y - truth.y) <= TOLERANCE
        right += int(bool(near) and 1 - float(places.sum()) <= LOST_ABOVE)
    return 100 * right / len(drive.views)


def month(folder: Path) -> list[Figures]:
    """Every later drive, asked of the first atlas and of the one that has grown by all drives before it."""
    drives = [recorded(folder, number, day) for number, day in enumerate(DAYS)]
    parts = [
        learn(drive.views, profile="best", metadata=drive.metadata, name=day.robot)
        for drive, day in zip(drives[:2], DAYS[:2], strict=True)
    ]
    first = grown = merge_maps(parts).map
    print(f"atlas of {len(first.paths)} paths, {len(first)} places of {sum(map(len, parts))}")
    found = []
    for drive, day in zip(drives[2:], DAYS[2:], strict=True):
        found.append(asked(first, drive, day, "first"))
        before = asked(grown, drive, day, "grown")
        kept = forgotten = 0
        try:
            added = add_drive(grown, drive.views, name=str(day.day), metadata=drive.metadata)
            grown, kept, forgotten = added.map, len(added.kept), added.forgotten
        except MapError as refused:
            print(f"{day.day}: refused, {refused}")
        found.append(Figures(**{**asdict(before), "kept": kept, "forgotten": forgotten}))
        print(found[-2], found[-1], sep="\n", flush=True)
    return found


def drawn(found: Sequence[Figures], file: Path) -> None:
    """One picture: success, size and time a view over the month."""
    figure, axes = plt.subplots(4, 1, figsize=(8, 9), sharex=True, layout="constrained")
    rows = (("single", "single views [%]"), ("chain", "chain [%]"), ("kilobytes", "map [kB]"))
    for axis, (field, label) in zip(axes, (*rows, ("milliseconds", "a view [ms]")), strict=True):
        for name, colour in (("first", "tab:grey"), ("grown", "tab:blue")):
            its = [one for one in found if one.map == name]
            days, values = [one.day for one in its], [getattr(one, field) for one in its]
            axis.plot(days, values, "-", color=colour, label="as it was first" if name == "first" else "grown")
            for robot, mark in (("robuter", "o"), ("segway_rmp", "^")):
                mine = [n for n, one in enumerate(its) if one.robot == robot]
                axis.plot([days[n] for n in mine], [values[n] for n in mine], mark, color=colour)
        axis.set_ylabel(label)
        axis.grid(alpha=0.3)
        least = min(getattr(one, field) for one in found)
        axis.set_ylim(bottom=min(80, least - 5) if label.endswith("[%]") else 0)
    axes[0].legend(loc="lower left")
    axes[0].set_ylim(top=106)
    for one in found[::2]:
        axes[0].annotate(one.light, (one.day, 102.5), ha="center", fontsize=7)
    axes[-1].set_xlabel("day of June 2008; circles: robuter, triangles: segway_rmp")
    figure.savefig(file, dpi=110)


def main() -> None:
    """Measure, and write table and picture."""
    cv2.setNumThreads(1)
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    found = month(folder)
    with (folder / "month.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, list(asdict(found[0])))
        writer.writeheader()
        writer.writerows(asdict(one) for one in found)
    drawn(found, folder / "month.png")


if __name__ == "__main__":
    main()
