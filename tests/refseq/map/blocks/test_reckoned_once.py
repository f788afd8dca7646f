"""A map that was made ready has nothing left to reckon at its first view, whatever its profile."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from refseq.belief import Stage
from refseq.inference.chain import emissions
from refseq.inference.matching import log_ratio
from refseq.map.blocks import key_block, scan_block
from refseq.map.blocks.reckoned_once import reckon_once
from refseq.map.learning import learn
from refseq.map.localiser import Localiser
from refseq.map.profile import BEST, THESIS, Profile
from refseq.view import LASER, View
from tests.support import corridor_drive

HOMES = [(log_ratio, "_elsewhere"), (scan_block, "pairs_elsewhere"), (key_block, "pairs_elsewhere")]
"""Where reference views are compared with places elsewhere, and places with each other."""


def drive(count: int) -> list[View]:
    """Views of a corridor that are full of corners."""
    squares = np.random.default_rng(5).integers(0, 256, (count, 12, 16), np.uint8)
    pictures = [np.ascontiguousarray(np.kron(one, np.ones((10, 10), np.uint8))) for one in squares]
    views = corridor_drive(np.random.default_rng(3), count)
    return [replace(view, images={"camera-1": picture}) for view, picture in zip(views, pictures, strict=True)]


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Where something was reckoned, time by time."""
    told: list[str] = []

    def telling(name: str, found: Callable[..., object]) -> Callable[..., object]:
        def reckon(*given: object, **named: object) -> object:
            told.append(name)
            return found(*given, **named)

        return reckon

    for home, name in HOMES:
        monkeypatch.setattr(home, name, telling(home.__name__, getattr(home, name)))
    from_posteriors = telling("emissions", emissions.Emissions.from_posteriors)
    monkeypatch.setattr(emissions.Emissions, "from_posteriors", staticmethod(from_posteriors))
    return told


@pytest.mark.parametrize("sensors", [None, ["camera-1"], [LASER]], ids=["all", "camera", "laser"])
@pytest.mark.parametrize("stage", [Stage.UNIFORM, Stage.CHAIN])
@pytest.mark.parametrize("profile", [BEST, THESIS], ids=["best", "thesis"])
def test_the_first_view_waits_for_nothing_and_nothing_else_was_reckoned(
    profile: Profile, stage: Stage, sensors: list[str] | None, asked: list[str]
) -> None:
    ready, fresh = (learn(drive(12), profile=profile) for _ in range(2))
    [view] = drive(1)
    reckon_once(ready, stage=stage, sensors=sensors)
    reckoned = set(asked)
    asked.clear()
    belief = Localiser(ready, stage=stage, sensors=sensors).update(view)
    assert asked == []
    assert belief.places.tobytes() == Localiser(fresh, stage=stage, sensors=sensors).update(view).places.tobytes()
    assert set(asked) == reckoned
    assert bool(reckoned) == (profile is BEST or stage is Stage.CHAIN)
