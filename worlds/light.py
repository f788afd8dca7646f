"""Light settings: hour of the day, cloud, lamps and date, read from text or by a preset's name."""

import datetime
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType
from typing import Any

from refseq_bench.worlds.errors import LightError
from refseq_bench.worlds.options import once

FIRST_DAY, LAST_DAY = datetime.date(1900, 1, 1), datetime.date(2100, 12, 31)
"""Days for which the sun's position is worked out: its series hold in these two centuries."""
SHARE = "a share from 0 to 1"
DAY = f"a day such as 2008-06-15, in the years {FIRST_DAY.year} to {LAST_DAY.year}"


class Lamps(StrEnum):
    """Switching of the lamps: ``AUTO`` switches them on when it gets dark outside."""

    AUTO = "auto"
    ON = "on"
    OFF = "off"


@dataclass(frozen=True, slots=True)
class LightSetting:
    """Light as it is asked for: local clock ``hour`` (0..24), share of the sky under ``cloud`` (0..1), lamps, date.

    No ``date`` means the plan's. ``name`` is what the light is called in files and tables. Raises ``LightError`` for
    another value.
    """

    name: str
    hour: float
    cloud: float = 0.0
    lamps: Lamps = Lamps.AUTO
    date: datetime.date | None = None

    def __post_init__(self) -> None:
        if not 0.0 <= self.hour <= 24.0:
            raise _invalid(self.name, "hour", f"{self.hour:g}", "from 0 to 24")
        if not 0.0 <= self.cloud <= 1.0:
            raise _invalid(self.name, "cloud", f"{self.cloud:g}", SHARE)
        if not isinstance(self.lamps, Lamps):
            raise _invalid(self.name, "lamps", self.lamps, "Lamps.AUTO, ON or OFF")
        if self.date is not None and not FIRST_DAY <= self.date <= LAST_DAY:
            raise _invalid(self.name, "date", self.date, DAY)

    def as_text(self) -> str:
        """The light as ``light_named`` reads it, whatever it is called, to the minute."""
        text = clock_text(self.hour)
        text += f",cloud={self.cloud:g}" if self.cloud else ""
        text += f",lamps={self.lamps.value}" if self.lamps is not Lamps.AUTO else ""
        return text + (f",date={self.date.isoformat()}" if self.date else "")


def clock_text(hour: float) -> str:
    """Hour of the day as HH:MM, to the minute."""
    whole, minute = divmod(round(60 * hour), 60)
    return f"{whole:02d}:{minute:02d}"


def _invalid(light: str, key: str, value: object, valid: str) -> LightError:
    return LightError(f"light '{light}': {key} '{value}' is not valid; it should be {valid}")


PRESETS = MappingProxyType(
    {
        "morning": "09:00",
        "noon": "13:00",
        "16:00": "16:00",
        "18:00": "18:00",
        "overcast": "13:00,cloud=1",
        "late-evening": "21:30",
    }
)
"""Lights with a name of their own, and what they stand for."""
FORM = "HH:MM with any of cloud=0..1, lamps=auto|on|off, date=YYYY-MM-DD after it, commas between"


def light_names() -> tuple[str, ...]:
    """Return the names of the presets."""
    return tuple(PRESETS)


def light_named(text: str) -> LightSetting:
    """Read a light: a preset's name, or ``17:45,cloud=0.5,lamps=on,date=2008-06-15``, all but the hour optional.

    A preset may be followed by options, too. Raises ``LightError`` with the value and what is valid.
    """
    start, _, rest = text.partition(",")
    clock, _, preset = PRESETS.get(start, start).partition(",")
    given, said = ([_option(text, part) for part in parts.split(",") if part] for parts in (preset, rest))
    options = dict(given) | once(said, f"light '{text}'", LightError)
    return LightSetting(text, _hour(text, clock), **options)


def _hour(text: str, clock: str) -> float:
    found = re.fullmatch(r"(\d{1,2}):(\d{2})", clock)
    hour = int(found[1]) + int(found[2]) / 60 if found and int(found[2]) < 60 else 25.0
    if hour > 24.0:
        raise LightError(f"unknown light '{text}'; known are {', '.join(PRESETS)}, or {FORM}")
    return hour


def _option(text: str, part: str) -> tuple[str, Any]:
    key, _, value = part.partition("=")
    if key not in _OPTIONS:
        raise LightError(f"light '{text}': unknown option '{part}'; valid is {FORM}")
    read, valid = _OPTIONS[key]
    try:
        return key, read(value)
    except ValueError:
        raise _invalid(text, key, value, valid) from None


_OPTIONS: Mapping[str, tuple[Callable[[str], Any], str]] = MappingProxyType(
    {
        "cloud": (float, SHARE),
        "lamps": (Lamps, "auto, on or off"),
        "date": (datetime.date.fromisoformat, DAY),
    }
)
