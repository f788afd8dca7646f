"""Set-up of a capture as a person fills it in: name, notes, sensors, and when views are taken (thesis 5.3.1)."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from refseq.logs.notes import checked_notes
from refseq_bench.sim.drives.trigger import Trigger
from refseq_bench.sim.errors import SimError

NAME = re.compile(r"\w[\w .-]{0,59}")
"""Names become names of files; letters are those of any language, as files have them."""
LIMITS: Mapping[str, tuple[float, float, str]] = {
    "distance": (0.01, 1000.0, "m"),
    "turn": (1.0, 360.0, "degrees"),
    "time": (0.04, 3600.0, "s"),
}
"""Valid thresholds of the trigger."""


@dataclass(frozen=True, slots=True)
class CaptureSetup:
    """Set-up of a drive; ``sampling`` None: views are taken by hand only."""

    name: str
    notes: str
    sensors: tuple[str, ...]
    sampling: Trigger | None

    @classmethod
    def read(cls, told: Mapping[str, Any], valid: Sequence[str]) -> "CaptureSetup":
        """Read what a page sent; ``valid`` are the robot's sensors. Raises ``SimError``, ``LogError``."""
        name, notes, sensors = told.get("name"), told.get("notes", ""), told.get("sensors")
        if not isinstance(name, str) or not NAME.fullmatch(name):
            raise SimError(f"name {name!r:.80} is not valid; valid are up to 60 letters, digits, blanks, and . _ -")
        if not isinstance(notes, str):
            raise SimError("notes are no text")
        if not isinstance(sensors, list) or not sensors or any(sensor not in valid for sensor in sensors):
            raise SimError(f"sensors {sensors!r:.80} are not valid; valid are one or more of {', '.join(valid)}")
        chosen = tuple(sensor for sensor in valid if sensor in sensors)
        return cls(name, checked_notes(notes), chosen, _trigger(told))

    def as_told(self) -> dict[str, Any]:
        """The same as the page sends it."""
        sampling = self.sampling
        return {
            "name": self.name,
            "notes": self.notes,
            "sensors": list(self.sensors),
            "distance": sampling.distance if sampling else None,
            "turn": round(math.degrees(sampling.turn), 3) if sampling and sampling.turn else None,
            "time": sampling.time if sampling else None,
        }


def _trigger(told: Mapping[str, Any]) -> Trigger | None:
    found = {name: _number(name, told.get(name)) for name in LIMITS}
    if all(value is None for value in found.values()):
        return None
    turn = found["turn"]
    return Trigger(found["distance"], None if turn is None else math.radians(turn), found["time"])


def _number(name: str, value: object) -> float | None:
    least, most, unit = LIMITS[name]
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not least <= value <= most:
        raise SimError(f"{name} = {value!r:.40} is not valid; valid is {least:g} to {most:g} {unit}, or nothing")
    return float(value)
