from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from refseq.missions import Status
from refseq_bench.scenarios.missions import bystander as bystanders
from refseq_bench.scenarios.missions.bystander import Bystander, MissionFrame
from refseq_bench.scenarios.missions.filmstrip import filmstrip_of


def seen(every: float, moments: list[tuple[float, str, Status]], monkeypatch: pytest.MonkeyPatch) -> list[MissionFrame]:
    """Frames of a bystander at (time, behaviour, status), with pictures that count its looks."""
    made: list[Any] = []

    class Camera:
        def __init__(self, bench: Any) -> None:
            self.looks = 0
            made.append(self)

        def look(self) -> np.ndarray:
            self.looks += 1
            return np.full((12, 16), self.looks, np.uint8)

    monkeypatch.setattr(bystanders, "ChaseCamera", Camera)
    bystander: Any = Bystander(every)
    for time, behaviour, status in moments:
        doing = SimpleNamespace(doing=behaviour if status.moving else "", status=status, along=time / 2)
        bystander(doing, SimpleNamespace(time=time))
    assert len(made) <= 1
    return list(bystander.frames)


RUNNING = next(one for one in Status if one.moving)
OVER = next(one for one in Status if not one.moving)


def test_it_looks_now_and_then_and_whenever_it_begins_with_something_else(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    moments = [(0.1 * k, "MN:0" if k < 24 else "MT:90", RUNNING) for k in range(36)] + [(3.6, "MT:90", OVER)]
    frames = seen(1.0, moments, monkeypatch)
    assert [round(one.time, 1) for one in frames] == [0.0, 1.0, 2.0, 2.4, 3.4, 3.6]
    assert [one.doing for one in frames] == [*["MN:0"] * 3, *["MT:90"] * 2, OVER.value]
    assert [int(one.image[0, 0]) for one in frames] == [1, 2, 3, 4, 5, 6]
    assert [one.along for one in frames] == [pytest.approx(one.time / 2) for one in frames]


def test_the_strip_tells_time_place_and_doing_under_each_frame(monkeypatch: pytest.MonkeyPatch) -> None:
    frames = seen(1.0, [(12.6, "MN:0", RUNNING), (13.6, "MT:90", RUNNING)], monkeypatch)
    strip = filmstrip_of(frames, "robuter in hallway")
    words = " ".join(one.get_text() for one in strip.findobj(lambda one: hasattr(one, "get_text")))
    assert "13 s, 6.3 m: MN:0" in words
    assert "14 s, 6.8 m: MT:90" in words
    assert "robuter in hallway" in words
