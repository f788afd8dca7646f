"""Things on the walls of generated plans, and the character that decides how many: its ranges are choices."""

import datetime
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.random import Generator

from refseq_bench.worlds.arrays import Floats, Span
from refseq_bench.worlds.plans.rules import collide
from refseq_bench.worlds.plans.schema import ON_WALL, FloorPlan, Wall

MODULE = 8.0
"""Length of wall that comes again where a dial asks for it [m]: some two doors and what is between them."""
PLATE = 0.3
"""A door keeps so much of the wall beside it free [m]: its number plate hangs there."""
TRIES = 8
"""A thing that finds no free place on its wall in so many draws is left out."""
LEFT, RIGHT = "left", "right"
Item = dict[str, Any]
"""An entry of the plan with its ``table``; names come last."""


@dataclass(frozen=True, slots=True)
class Character:
    """Character of a corridor. ``rates`` are things a metre of wall; lengths in [m].

    ``glazed`` names the side that has windows, ``floor`` is what the doors' numbers begin with.

    ``evenness`` is the shape of the gamma distribution of the gaps between doors: 1 is chance, 40 nearly regular.
    """

    width: float
    height: float
    glazed: str
    floor: int
    pitch: float
    pane: float
    door_gap: float
    evenness: float
    open_share: float
    rates: dict[str, float]
    lamp_step: float
    lumen: float


def draw_character(rng: Generator) -> Character:
    """Draw what a building is like."""

    def rate(most: float) -> float:
        """Squared, so that things are more often rare than frequent."""
        return float(most * rng.random() ** 2)

    step = round(float(rng.uniform(2.4, 6.0)), 1)
    return Character(
        width=round(float(rng.uniform(1.8, 3.0)), 1),
        height=round(float(rng.uniform(2.4, 3.2)), 1),
        glazed=str(rng.choice([LEFT, RIGHT, "neither"], p=[0.35, 0.35, 0.3])),
        floor=int(rng.integers(1, 5)),
        pitch=round(float(rng.uniform(3.2, 6.5)), 1),
        pane=round(float(rng.uniform(1.2, 2.2)), 1),
        door_gap=float(rng.uniform(3.0, 9.0)),
        evenness=float(rng.choice([1.0, 4.0, 40.0])),
        open_share=float(rng.choice([0.0, 0.1, 0.25])),
        rates={
            "poster": rate(0.35),
            "board": rate(0.08),
            "cabinet": rate(0.12),
            "bin": rate(0.08),
            "extinguisher": 0.01 + rate(0.05),
            "switch": rate(0.08),
            "sign": rate(0.06),
        },
        lamp_step=step,
        lumen=round(step * float(rng.uniform(180.0, 500.0)), -1),
    )


def draw_place(rng: Generator) -> Item:
    """Draw a day and a bearing, in Aveiro."""
    day = datetime.date(2008, 1, 1) + datetime.timedelta(days=int(rng.integers(366)))
    azimuth = float(rng.integers(360))
    return {"latitude": 40.63, "longitude": -8.66, "timezone": "Europe/Lisbon", "date": day, "x_azimuth": azimuth}


def draw_floor(rng: Generator) -> Item:
    """Draw the pattern of the floor."""
    pattern, tile = [("tiles", 0.3), ("tiles", 0.4), ("tiles", 0.6), ("carpet", 0.5), ("parquet", 0.4)][rng.integers(5)]
    return {"material": "floor", "tile": tile, "pattern": pattern}


ALBEDOS = {
    "plaster": (0.5, 0.85, 0.95),
    "floor": (0.15, 0.45, 0.55),
    "ceiling": (0.65, 0.9, 0.95),
    "door": (0.12, 0.5, 0.5),
    "metal": (0.25, 0.6, 0.45),
    "dark": (0.04, 0.1, 0.4),
    "light": (0.65, 0.85, 0.5),
}
"""Least and greatest albedo of each material, and its roughness: painted walls, floors and fittings (M)."""


def draw_materials(rng: Generator) -> dict[str, Item]:
    """Draw how light each material is."""
    return {
        name: {"albedo": round(float(rng.uniform(low, high)), 2), "roughness": roughness}
        for name, (low, high, roughness) in ALBEDOS.items()
    }


def glazed_walls(items: Sequence[Item]) -> set[str]:
    """Names of the walls on which windows are."""
    return {item["wall"] for item in items if item["table"] == "window"}


def lamp_rows(
    rng: Generator, like: Character, legs: Sequence[tuple[Floats, Floats]], by_day: Sequence[bool]
) -> list[Item]:
    """One row a leg, in its middle, along it; ``by_day`` tells which legs daylight reaches.

    Lamps that burn from dusk on only are for those: nobody leaves a corridor without windows dark by day.
    """
    drawn, kelvin = str(rng.choice(["dusk", "always"])), float(rng.choice([3000.0, 4000.0]))
    rows = []
    for i, (start, end) in enumerate(legs):
        switch = drawn if by_day[i] else "always"
        length = np.linalg.norm(end - start)
        along = (end - start) / length
        count = max(1, int((length - like.lamp_step / 2) / like.lamp_step))
        size = [1.2, 0.3] if along[0] else [0.3, 1.2]
        first, step = start + like.lamp_step / 2 * along, like.lamp_step * along
        row = {"first": np.round(first, 3).tolist(), "step": np.round(step, 3).tolist(), "count": count, "size": size}
        rows.append({"name": f"leg-{i + 1}", **row, "lumen": like.lumen, "kelvin": kelvin, "switch": switch})
    return rows


class Rail:
    """The ``span`` of a wall on which things find a place; what is ``taken`` of it is not free."""

    def __init__(self, span: Span) -> None:
        self.span = span
        self.taken: list[Span] = []

    def take(self, at: float, width: float, beside: float = 0.05) -> bool:
        """Take the place for something ``width`` wide around ``at`` if it is free, ``beside`` it too."""
        low, high = at - width / 2 - beside, at + width / 2 + beside
        if low < self.span[0] or high > self.span[1] or any(low < b and a < high for a, b in self.taken):
            return False
        self.taken.append((low, high))
        return True

    def find(self, rng: Generator, width: float) -> float | None:
        """Take any free place for something ``width`` wide; None where none was found."""
        draws = (round(float(at), 2) for at in rng.uniform(*self.span, TRIES))
        return next((at for at in draws if self.take(at, width)), None)


def items_on(
    rng: Generator, like: Character, wall: Wall, rail: Rail, *, glazed: bool, blank: Sequence[Span] = ()
) -> list[Item]:
    """Windows, doors and clutter along a wall's rail, no clutter on its ``blank`` spans."""
    items = _windows(rng, like, rail) if glazed else []
    items += _doors(rng, like, rail, glazed)
    rail.taken += blank
    for kind, rate in like.rates.items():
        for _ in range(int(rng.poisson(rate * wall.length))):
            thing = CLUTTER[kind](rng)
            if (at := rail.find(rng, thing["width"])) is not None:
                items.append({**thing, "at": at})
    return [{**item, "wall": wall.name} for item in items]


def end_door(rng: Generator, wall: Wall) -> list[Item]:
    """A wide door in the middle of a wall, or none."""
    if rng.random() < 0.4:
        return []
    label = str(rng.choice(["A", "B", "EXIT", ""]))
    return [{"table": "door", "wall": wall.name, "at": round(wall.length / 2, 2), "width": 1.2, "label": label}]


def _windows(rng: Generator, like: Character, rail: Rail) -> list[Item]:
    """Windows at a regular pitch, some left out; a radiator stands under some."""
    items: list[Item] = []
    glazing, first = str(rng.choice(["4mm", "6mm", "double"])), rail.span[0] + float(rng.uniform(0.0, 4.0))
    height = round(min(1.5, like.height - 1.1), 2)
    for at in np.round(np.arange(first, rail.span[1], like.pitch), 2).tolist():
        if rng.random() < 0.15 or not rail.take(at, like.pane, 0.1):
            continue
        items.append({"table": "window", "at": at, "width": like.pane, "height": height, "glazing": glazing})
        if rng.random() < 0.4:
            radiator = {"width": 1.0, "height": 0.55, "bottom": 0.15, "depth": 0.09, "material": "metal"}
            items.append({"table": "fixture", "at": at, "kind": "radiator", **radiator})
    return items


def _doors(rng: Generator, like: Character, rail: Rail, glazed: bool) -> list[Item]:
    """Doors with gamma-distributed gaps; few and closed where there are windows."""
    items: list[Item] = []
    number = int(rng.integers(1, 9))
    at = rail.span[0] + float(rng.uniform(0.8, 5.0))
    while at < rail.span[1]:
        place, number = round(at, 2), number + int(rng.choice([1, 2, 2, 2, 4]))
        keep, leaf = not glazed or rng.random() < 0.2, _leaf(rng, like, number)
        if keep and rail.take(place, leaf["width"], PLATE):
            items.append({**leaf, "at": place, "open": 0.0 if glazed else leaf["open"]})
        at += 1.6 + float(rng.gamma(like.evenness, (like.door_gap - 1.6) / like.evenness))
    return items


def _leaf(rng: Generator, like: Character, number: int) -> Item:
    label = str(rng.choice([f"{like.floor}.{number:02d}", "WC", "LAB", ""], p=[0.8, 0.06, 0.06, 0.08]))
    return {
        "table": "door",
        "width": float(rng.choice([0.8, 0.9, 0.9, 0.9, 1.2])),
        "open": float(rng.integers(20, 105)) if rng.random() < like.open_share else 0.0,
        "hinge": str(rng.choice(["start", "end"])),
        "label": label,
    }


def _poster(rng: Generator) -> Item:
    sizes = ((0.841, 1.189, 0.85), (0.594, 0.841, 1.0), (1.189, 0.841, 1.0))
    width, height, bottom = sizes[rng.choice(3, p=[0.5, 0.35, 0.15])]
    style = str(rng.choice(["text", "plots", "photo", "mixed", "diagram"]))
    return {"table": "poster", "width": width, "height": height, "bottom": bottom, "style": style}


def _board(rng: Generator) -> Item:
    width = float(rng.choice([1.2, 1.8, 2.4]))
    return {"table": "board", "width": width, "sheets": int(width * rng.integers(3, 8))}


def _cabinet(rng: Generator) -> Item:
    width, height = float(rng.choice([0.5, 0.8, 1.0, 1.2])), float(rng.choice([0.9, 1.3, 1.8]))
    return {"table": "cabinet", "width": width, "height": height, "depth": float(rng.choice([0.25, 0.35]))}


def _bin(rng: Generator) -> Item:
    return {"table": "bin", "width": float(rng.choice([0.22, 0.28, 0.34])), "height": float(rng.choice([0.4, 0.6]))}


def _fixture(kind: str, width: float, height: float, bottom: float, depth: float, material: str) -> Item:
    shape = {"width": width, "height": height, "bottom": bottom, "depth": depth}
    return {"table": "fixture", "kind": kind, **shape, "material": material}


CLUTTER: Mapping[str, Callable[[Generator], Item]] = {
    "poster": _poster,
    "board": _board,
    "cabinet": _cabinet,
    "bin": _bin,
    "extinguisher": lambda rng: _fixture("extinguisher", 0.16, 0.5, 0.9, 0.16, "dark"),
    "switch": lambda rng: _fixture("switch", 0.085, 0.085, 1.05, 0.012, "light"),
    "sign": lambda rng: _fixture("sign", 0.45, 0.18, 2.2, 0.02, "dark"),
}


def repeated(rng: Generator, items: list[Item], whole: Span) -> list[Item]:
    """Let a stretch of the wall come again further on, thing for thing, instead of what was there."""
    span = float(rng.uniform(7.0, 14.0))
    room = whole[1] - whole[0] - 2 * span
    if room < 0.0:
        return items
    begin, shift = whole[0] + float(rng.uniform(0.0, room)), round(span + 0.1, 1)
    source = [item for item in items if _within(item, begin, begin + span)]
    kept = [item for item in items if not _reaches(item, begin + shift, begin + shift + span)]
    copies = [{**item, "at": round(item["at"] + shift, 2)} for item in source]
    return kept + [copy for copy in copies if copy["at"] + half_width(copy) <= whole[1]]


def modular(rng: Generator, items: list[Item], whole: Span, share: float) -> list[Item]:
    """Let a ``share`` of a wall's modules, ``MODULE`` long, be as its first one is, thing for thing."""
    begin = whole[0]
    first = [item for item in items if _within(item, begin, begin + MODULE)]
    for k in range(1, int((whole[1] - begin) / MODULE + 1e-9)):
        low = begin + k * MODULE
        if rng.random() < share:
            kept = [item for item in items if not _reaches(item, low, low + MODULE)]
            items = kept + [{**item, "at": round(item["at"] + k * MODULE, 2)} for item in first]
    return items


def half_width(item: Item) -> float:
    """Half of what a thing takes of its wall [m]."""
    return float(item["width"] / 2 + (PLATE if item["table"] == "door" else 0.0))


def _within(item: Item, low: float, high: float) -> bool:
    return bool(low <= item["at"] - half_width(item) and item["at"] + half_width(item) <= high)


def _reaches(item: Item, low: float, high: float) -> bool:
    return bool(item["at"] + half_width(item) > low and item["at"] - half_width(item) < high)


def without_overlaps(plan: FloorPlan) -> FloorPlan:
    """Return the plan without each thing on a wall that covers one before it.

    A radiator may be wider than the window above it, and a window wider than the gap between two wings.
    """
    kept: dict[str, list[Any]] = {table: [] for table in ON_WALL}
    hung: list[Any] = []
    for table in ON_WALL:
        for item in getattr(plan, table):
            if not any(collide(item, other) for other in hung):
                kept[table].append(item)
                hung.append(item)
    return plan.model_copy(update={table: tuple(items) for table, items in kept.items()})


def named(items: list[Item]) -> dict[str, list[Item]]:
    """Sort the entries into their tables, along each wall, and name them by the table's letter and a number."""
    items = sorted(items, key=lambda item: (item["wall"], item["at"]))
    letters = {"window": "w", "door": "d", "poster": "p", "board": "b", "cabinet": "c", "bin": "n", "fixture": "f"}
    return {
        table: [
            {"name": f"{letter}{i + 1:02d}", **{k: v for k, v in item.items() if k != "table"}}
            for i, item in enumerate(item for item in items if item["table"] == table)
        ]
        for table, letter in letters.items()
    }
