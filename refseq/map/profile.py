"""All parameters of the localiser in one place; a map carries the profile that it was learnt with."""

import json
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from enum import StrEnum
from functools import cache, lru_cache
from numbers import Integral, Real
from types import MappingProxyType
from typing import Any, Self, get_type_hints

from refseq.errors import MapError
from refseq.features.dense import DenseSettings
from refseq.features.doors import DoorSettings
from refseq.features.hu import HuSettings
from refseq.features.neural.words import Digest, NeuralSettings
from refseq.features.sectors import SectorSettings
from refseq.features.sift import SiftSettings
from refseq.features.walls import WallSettings
from refseq.inference.chain.chain import ChainSettings
from refseq.inference.chain.motion import MotionSettings
from refseq.inference.matching.log_ratio import LogRatioSettings
from refseq.inference.matching.mixture import MixtureForm, MixtureSettings
from refseq.map.format.parameters import RANGES, Range
from refseq.map.names import PROFILE_NAMES

NEURAL_FEATURE = "neural"
"""Name of the feature that asks a neural network for keys."""


class Matching(StrEnum):
    """Ways to compare a view with the places."""

    MIXTURE = "mixture"
    LOG_RATIO = "log_ratio"


class Decoder(StrEnum):
    """Ways to decode the chain."""

    VITERBI = "viterbi"
    FORWARD = "forward"


@dataclass(frozen=True, slots=True)
class MethodSettings:
    """Choice of matching and decoding: the thesis' are the mixture, and Viterbi over a sliding window."""

    matching: Matching = Matching.MIXTURE
    decoding: Decoder = Decoder.VITERBI


@dataclass(frozen=True, slots=True)
class Profile:
    """The defaults are the thesis' values where it gives any; each part says which are choices.

    ``features`` are what is learnt where nothing else is asked for, names of ``refseq.map.extractors.FEATURES``.
    """

    features: tuple[str, ...] = ("sift", "walls", "doors", "boundary", "hu")
    method: MethodSettings = field(default_factory=MethodSettings)
    sift: SiftSettings = field(default_factory=SiftSettings)
    neural: NeuralSettings = field(default_factory=NeuralSettings)
    dense: DenseSettings = field(default_factory=DenseSettings)
    walls: WallSettings = field(default_factory=WallSettings)
    doors: DoorSettings = field(default_factory=DoorSettings)
    hu: HuSettings = field(default_factory=HuSettings)
    sectors: SectorSettings = field(default_factory=SectorSettings)
    mixture: MixtureSettings = field(default_factory=MixtureSettings)
    log_ratio: LogRatioSettings = field(default_factory=LogRatioSettings)
    motion: MotionSettings = field(default_factory=MotionSettings)
    chain: ChainSettings = field(default_factory=ChainSettings)

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers, words and truth values, for a map's header."""
        features = list(self.features) if isinstance(self.features, tuple) else self.features
        return asdict(self) | {"features": features}

    @property
    def by_log_ratios(self) -> bool:
        """True where places are compared by calibrated log ratios, and not by the mixture."""
        return self.method.matching is Matching.LOG_RATIO

    def asks_network(self, features: Sequence[str] | None = None) -> bool:
        """True where ``features``, by default its own, ask a neural network."""
        return NEURAL_FEATURE in (features or self.features)

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> Self:
        """The inverse of ``to_dict``; ``ValueError`` for a part or parameter that is missing, unknown or not valid."""
        features = content.get("features")
        if not isinstance(features, list) or not all(isinstance(name, str) for name in features):
            raise ValueError(f"profile.features is {features!r:.60}; valid is a list of names")
        parts = {part.name: _part(part.name, part.default_factory, content) for part in fields(cls)[1:]}
        return cls(features=tuple(features), **parts)


THESIS = Profile()
"""The thesis' localiser, with its values."""

BEST = Profile(
    features=("sift", "dense", "walls", "doors", "boundary", "sectors"),
    method=MethodSettings(Matching.LOG_RATIO, Decoder.FORWARD),
    sift=SiftSettings(cap=400, contrast=0.01, alias_distance=240.0, halved=True, root=True),
    log_ratio=LogRatioSettings(scans=6, screened=200, geometry=6, usual=100, fixes=5, tail=2.0),
    motion=MotionSettings(slack=0.1, drift=0.1, tail=0.02, interpolated=True, odometer_scale=0.1),
    chain=ChainSettings(
        lost_per_metre=0.01,
        exit_at_ends=True,
        run_out=10.0,
        stay_lost=0.92,
        lost_at_start=0.1,
        kidnap_probability=0.3,
        carried=0.005,
        vague=0.2,
        relocalisation_range=5.0,
    ),
)
"""Ours: every value was chosen on the world ``annex`` and on a real recording, see docs/best.md."""

COUNTING = Profile(mixture=MixtureSettings(form=MixtureForm.COUNTING))
"""The thesis' localiser without EM: a place is as likely as it has visible features. What the mixture has to beat."""

NEURAL = replace(BEST, features=(NEURAL_FEATURE, *BEST.features[1:]))
"""``BEST`` with the keys of a neural network in place of SIFT's; the user brings the network."""

PROFILES: Mapping[str, Profile] = MappingProxyType(
    dict(zip(PROFILE_NAMES, (THESIS, COUNTING, BEST, NEURAL), strict=True))
)
"""The named profiles."""


def profile_of(profile: Profile | str) -> Profile:
    """A profile of one's own in plain numbers, or that of a name (``profile_named``).

    Raises ``MapError`` for anything else, and for a value of one's own that no map file may have.
    """
    if isinstance(profile, str):
        return profile_named(profile)
    if not isinstance(profile, Profile):
        raise MapError(f"profile {profile!r:.60} is unknown; valid are {', '.join(PROFILES)}, or a Profile")
    return _read(profile.to_dict())


def _read(content: Mapping[str, Any]) -> Profile:
    try:
        return Profile.from_dict(content)
    except ValueError as error:
        raise MapError(str(error)) from None


@lru_cache(maxsize=256)
def profile_named(name: str) -> Profile:
    """One of ``PROFILES``, with any setting changed behind a plus sign: ``thesis+chain.window=20+mixture.cost=0.9``.

    Raises ``MapError`` for another name, for a setting that there is not, and for a value that is not valid.
    """
    base, *changes = name.split("+")
    if base not in PROFILES:
        raise MapError(f"profile {base!r} is unknown; valid are {', '.join(PROFILES)}")
    if not changes:
        return PROFILES[base]
    content, settings = PROFILES[base].to_dict(), [change.partition("=")[0] for change in changes]
    for setting, change in zip(settings, changes, strict=True):
        _change(content, change)
        if settings.count(setting) > 1:
            raise MapError(f"setting {setting!r} is given twice; valid is once")
    return _read(content)


def _change(content: dict[str, Any], change: str) -> None:
    """Set one setting, ``PART.SETTING=VALUE``, in a profile's ``content``."""
    where, equals, text = change.partition("=")
    part, _, setting = where.partition(".")
    parts = {name: settings for name, settings in content.items() if isinstance(settings, dict)}
    if part not in parts or not equals:
        raise MapError(f"setting {change!r} is unknown; valid is PART.SETTING=VALUE with a part of {', '.join(parts)}")
    if setting not in parts[part]:
        valid = ", ".join(sorted(parts[part]))
        raise MapError(f"setting {where!r} is unknown; valid is PART.SETTING=VALUE, of {part} one of {valid}")
    try:
        parts[part][setting] = json.loads(text)  # a number, true or false
    except (ValueError, RecursionError):
        parts[part][setting] = text


LATER: Mapping[str, Mapping[str, object]] = MappingProxyType(
    {
        "mixture": {"seeds": "likeness", "as_printed": False, "all_features": False},
        "log_ratio": {
            "scans": 0,
            "scans_alone": 0,
            "screened": 0,
            "geometry": 0,
            "turns": 0.0,
            "usual": 0,
            "fixes": 0,
            "tail": 0.0,
        },
        "neural": asdict(NeuralSettings()),
        "motion": {"stands_once": False, "odometer_scale": 0.0},
        "chain": {"lost_view": "entropy", "observation": "posterior", "run_out": 0.0, "carried": 0.0, "vague": 0.0},
    }
)
"""Settings that maps of earlier versions lack, with the values that do as those versions did."""
FORMER: Mapping[str, Collection[str]] = MappingProxyType({"log_ratio": {"geometry_alone"}})
"""Settings that maps of earlier versions have and nothing asks any more."""
ADDED = ("neural",)
"""Parts that maps of earlier versions lack as a whole."""
DIGEST = re.compile("[0-9a-f]{64}|")
"""A SHA-256, or none."""


@cache
def _types_of(kind: Any) -> Mapping[str, Any]:
    """Types of a part's settings, which are written as text there and read slowly."""
    return MappingProxyType(get_type_hints(kind))


def _part(name: str, kind: Any, content: Mapping[str, Any]) -> Any:
    given = content.get(name, {} if name in ADDED else None)
    types = _types_of(kind)
    if not isinstance(given, dict):
        raise ValueError(f"profile.{name} is {given!r:.60}; valid is a table of {', '.join(sorted(types))}")
    known = {key: value for key, value in given.items() if key not in FORMER.get(name, ())}
    values = {**LATER.get(name, {}), **known}
    if other := sorted(set(values) ^ set(types)):
        told = "unknown" if other[0] in values else "missing"
        raise ValueError(f"profile.{name}.{other[0]:.60} is {told}; valid are {', '.join(sorted(types))}")
    ranges = RANGES.get(name, {})
    return kind(
        **{key: _value(f"profile.{name}.{key}", value, types[key], ranges.get(key)) for key, value in values.items()}
    )


def _value(where: str, value: object, kind: type, valid: Range | None) -> object:
    """A parameter as its dataclass has it: a choice, yes or no, or a number within its range, NumPy's made plain."""
    if issubclass(kind, StrEnum):
        if value not in list(kind):  # not in a set: a list in a damaged file has no hash
            raise ValueError(f"{where} is {value!r:.60}; valid are {', '.join(kind)}")
        return kind(str(value))
    if kind is Digest:
        if not isinstance(value, str) or not DIGEST.fullmatch(value):
            raise ValueError(f"{where} is {value!r:.80}; valid are the 64 hexadecimal digits of a SHA-256, or none")
        return Digest(value)
    if valid is None:
        if not isinstance(value, bool):
            raise ValueError(f"{where} is {value!r:.60}; valid is true or false")
        return value
    number = isinstance(value, Integral if kind is int else Real) and not isinstance(value, bool)
    if not number or not valid[0] <= value <= valid[1]:  # type: ignore[operator]
        told = "a whole number" if kind is int else "a number"
        raise ValueError(f"{where} is {value!r:.60}; valid is {told} from {valid[0]:g} to {valid[1]:g}")
    return int(value) if isinstance(value, Integral) else float(value)  # type: ignore[arg-type]
