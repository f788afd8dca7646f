"""Dials of generated worlds, read from a world's name: ``building:3,texture=0.1,repetition=0.8``."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import NamedTuple

from refseq_bench.worlds.errors import PlanError
from refseq_bench.worlds.options import once
from refseq_bench.worlds.plans.furnish import LEFT, Character


class DialRange(NamedTuple):
    """Least and greatest value of a dial."""

    least: float
    greatest: float


RANGES: Mapping[str, DialRange] = {
    "texture": DialRange(0.0, 1.0),
    "repetition": DialRange(0.0, 1.0),
    "glass": DialRange(0.0, 0.9),
    "width": DialRange(1.8, 4.0),
}


@dataclass(frozen=True, slots=True)
class Dials:
    """Difficulty of a generated world; what is None is as the seed draws it.

    ``texture``: posters a metre of wall, and at 0 nothing but doors, windows and radiators on any wall; ``repetition``:
    share of modules, 8 m of a wall and whole wings, that are identical; ``glass``: width of a window as a share of the
    pitch of the windows, on walls that have any; ``width`` of the corridors [m]. Of the walls' length less is window,
    since there is none near corners and doors and where one is left out. Raises ``PlanError`` for a value out of
    ``RANGES``.
    """

    texture: float | None = None
    repetition: float | None = None
    glass: float | None = None
    width: float | None = None

    def __post_init__(self) -> None:
        for name, (least, greatest) in RANGES.items():
            value = getattr(self, name)
            if value is not None and not least <= value <= greatest:
                raise PlanError(f"dials: {_out_of_range(name, value)}")

    @property
    def suffix(self) -> str:
        """Addition to a plan's name."""
        given = {one.name: getattr(self, one.name) for one in fields(self)}
        return "".join(f"-{name}{value:g}" for name, value in given.items() if value is not None)

    def turned(self, like: Character) -> Character:
        """A character with these dials turned; nothing else of it is changed."""
        if self.texture is not None:
            rates = {kind: rate if self.texture else 0.0 for kind, rate in like.rates.items()}
            like = replace(like, rates={**rates, "poster": self.texture})
        if self.glass is not None:
            side = like.glazed if like.glazed != "neither" else LEFT
            # The glazed side of a corridor may have other legs behind it: then there is no window at all. Scores were
            # measured in these worlds, so they stay as they are.
            pane = round(max(self.glass * like.pitch, 0.4), 2)
            like = replace(like, glazed=side if self.glass else "neither", pane=pane)
        return like if self.width is None else replace(like, width=self.width)


AS_DRAWN = Dials()


def parse_dials(text: str, world: str) -> Dials:
    """Read ``texture=0.1,width=2``; raises ``PlanError`` for a dial that ``world`` has not or that is out of range."""
    words = [word.partition("=") for word in text.split(",")]
    for name, _, _ in words:
        if name not in RANGES:
            raise PlanError(f"world '{world}': unknown dial '{name}'; valid are {', '.join(RANGES)}")
    given = once([(name, value) for name, _, value in words], f"world '{world}'", PlanError)
    return Dials(**{name: _number(name, value, world) for name, value in given.items()})


def _number(name: str, text: str, world: str) -> float:
    least, greatest = RANGES[name]
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not least <= value <= greatest:
        raise PlanError(f"world '{world}': {_out_of_range(name, text)}")
    return value


def _out_of_range(name: str, value: object) -> str:
    least, greatest = RANGES[name]
    return f"{name} = '{value}' is not valid; it should be from {least:g} to {greatest:g}"
