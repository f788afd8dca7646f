"""All parameters of the localiser in one place; a map carries the profile that it was learnt with."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from enum import StrEnum
from typing import Any, Self, get_type_hints

from refseq.chain import ChainSettings
from refseq.features.doors import DoorSettings
from refseq.features.hu import HuSettings
from refseq.features.sectors import SectorSettings
from refseq.features.sift import SiftSettings
from refseq.features.walls import WallSettings
from refseq.mixture import MixtureSettings
from refseq.motion import MotionSettings


@dataclass(frozen=True, slots=True)
class Profile:
    """The defaults are the thesis' values where it gives any; each part says which are choices."""

    sift: SiftSettings = field(default_factory=SiftSettings)
    walls: WallSettings = field(default_factory=WallSettings)
    doors: DoorSettings = field(default_factory=DoorSettings)
    hu: HuSettings = field(default_factory=HuSettings)
    sectors: SectorSettings = field(default_factory=SectorSettings)
    mixture: MixtureSettings = field(default_factory=MixtureSettings)
    motion: MotionSettings = field(default_factory=MotionSettings)
    chain: ChainSettings = field(default_factory=ChainSettings)

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers, words and truth values, for a map's header."""
        return asdict(self)

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> Self:
        """The inverse of ``to_dict``; ``ValueError`` for a part or parameter that is missing, unknown or not valid."""
        return cls(**{part.name: _part(part.name, part.default_factory, content) for part in fields(cls)})


def _part(name: str, kind: Any, content: Mapping[str, Any]) -> Any:
    values = content.get(name)
    types = get_type_hints(kind)
    if not isinstance(values, dict) or set(values) != set(types):
        raise ValueError(f"profile.{name} is {values!r:.60}; valid is a table of {', '.join(sorted(types))}")
    return kind(**{key: _value(f"profile.{name}.{key}", value, types[key]) for key, value in values.items()})


def _value(where: str, value: object, kind: type) -> object:
    """A parameter as its dataclass has it: a choice, yes or no, or a number."""
    if issubclass(kind, StrEnum):
        if value not in set(kind):
            raise ValueError(f"{where} is {value!r:.60}; valid are {', '.join(kind)}")
        return kind(str(value))
    if isinstance(value, bool) != (kind is bool) or not isinstance(value, int | float):
        raise ValueError(f"{where} is {value!r:.60}; valid is {'true or false' if kind is bool else 'a number'}")
    return value
