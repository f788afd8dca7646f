"""A light meter for a world: how much light falls on a small flat card, and where it comes from.

Indoors it gathers what the card sees: the sun where its beam falls, windows and lamps as luminous rectangles, all else
by ``refseq_bench.worlds.lighting.radiosity``. In the open there are the sun, half a sphere of sky, half a sphere of
ground, and street lamps. Only walls cast shadows: indoors from all light, in the open from the sun alone; street lamps
shine through them there, where baked pictures shade their light.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from refseq_bench.worlds.arrays import Floats
from refseq_bench.worlds.errors import WorldsError
from refseq_bench.worlds.light import LightSetting
from refseq_bench.worlds.lighting.colour import camera_weight
from refseq_bench.worlds.lighting.daylight import sun_direction
from refseq_bench.worlds.lighting.form_factors import Cards, form_factors
from refseq_bench.worlds.lighting.open_air import post_illuminance
from refseq_bench.worlds.lighting.photometry import Photometry, outlook, photometry
from refseq_bench.worlds.lighting.sunlight import shaded, sunlit
from refseq_bench.worlds.plans.schema import FloorPlan


@dataclass(frozen=True, slots=True)
class Reading:
    """Illuminance of a card by where the light comes from [lx].

    ``sun`` is direct; ``sky`` comes from the sky, indoors with the ground outside, through windows; ``indirect`` from
    surfaces that other light falls on.
    """

    sun: float
    sky: float
    lamps: float
    indirect: float

    @property
    def total(self) -> float:
        """All together [lx]."""
        return self.sun + self.sky + self.lamps + self.indirect


class Meter:
    """A light meter that can be put anywhere in a plan under a light; the light between the walls is solved once."""

    def __init__(self, plan: FloorPlan, setting: LightSetting) -> None:
        kind = _OpenAir if plan.ceiling is None else _Indoors
        self._light: _Light = kind(plan, photometry(plan, setting))

    def read(self, point: ArrayLike, normal: ArrayLike = (0.0, 0.0, 1.0)) -> Reading:
        """Measure at ``point`` (3,) [m] on a card that faces along ``normal`` (3,).

        Raises ``WorldsError`` for a normal without a direction.
        """
        card, light = _card(point, normal), self._light
        parts = (light.sun(card)[0], light.sky(card)[0], light.lamps(card)[0, 0], light.indirect(card)[0, 0])
        return Reading(*map(float, parts))

    def for_camera(self, cards: Cards) -> Floats:
        """All but the direct sun on many cards, weighted with what a camera gathers, (m,) [lx]."""
        return self._light.sky(cards) + self._light.lamps(cards)[:, 1] + self._light.indirect(cards)[:, 1]


def _card(point: ArrayLike, normal: ArrayLike) -> Cards:
    normals = np.asarray(normal, dtype=float).reshape(1, 3)
    length = float(np.linalg.norm(normals))
    if length == 0.0:
        raise WorldsError("normal (0, 0, 0) is not valid; it should be the direction that the card faces")
    return Cards(np.asarray(point, dtype=float).reshape(1, 3), normals / length)


class _Light(Protocol):
    """Illuminance of cards [lx]: of lamps and walls (m, 2), in lumens and as a camera gathers them."""

    def sun(self, cards: Cards) -> Floats: ...
    def sky(self, cards: Cards) -> Floats: ...
    def lamps(self, cards: Cards) -> Floats: ...
    def indirect(self, cards: Cards) -> Floats: ...


class _Indoors:
    def __init__(self, plan: FloorPlan, numbers: Photometry) -> None:
        from refseq_bench.worlds.lighting.radiosity import light_up  # slow to import: worlds are built without it

        self._plan, self._outdoors = plan, numbers.outdoors
        self._interior = light_up(plan, numbers)
        self.indirect = self._interior.indirect

    def sun(self, cards: Cards) -> Floats:
        beam = sun_direction(self._outdoors, self._plan.place.x_azimuth)
        share = sunlit(self._plan, cards.points, beam)
        return share * self._outdoors.direct * np.maximum(0.0, -cards.normals @ beam)

    def sky(self, cards: Cards) -> Floats:
        from refseq_bench.worlds.lighting.radiosity import window_factors

        lit = self._interior.sources
        above, below = window_factors(cards, lit.windows, self._plan)
        return np.pi * (above @ lit.above + below @ lit.below)

    def lamps(self, cards: Cards) -> Floats:
        lit = self._interior.sources
        return np.pi * (form_factors(cards, lit.lamps, self._plan) @ lit.lamp_luminances)


class _OpenAir:
    def __init__(self, plan: FloorPlan, numbers: Photometry) -> None:
        self._plan, self._outdoors = plan, numbers.outdoors
        self._above, self._below = np.pi * np.array(outlook(plan, numbers.outdoors))
        self._posts = numbers.lit_posts

    def sun(self, cards: Cards) -> Floats:
        beam = sun_direction(self._outdoors, self._plan.place.x_azimuth)
        clear = (~shaded(self._plan, cards.points, beam)).astype(float)
        return clear * self._outdoors.direct * np.maximum(0.0, -cards.normals @ beam)

    def sky(self, cards: Cards) -> Floats:
        return np.asarray(self._above * (1.0 + cards.normals[:, 2]) / 2)

    def indirect(self, cards: Cards) -> Floats:
        return np.asarray(np.repeat(self._below * (1.0 - cards.normals[:, 2:]) / 2, 2, axis=1))

    def lamps(self, cards: Cards) -> Floats:
        total = np.zeros((len(cards), 2))
        for post in self._posts:
            total += np.outer(post_illuminance(post, cards), [1.0, camera_weight(post.kelvin)])
        return total
