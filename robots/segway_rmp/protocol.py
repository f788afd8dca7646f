"""The machine's frames, in counts: commands go down, a status comes up every tick. Words are big-endian.

Scale factors and words as libsegwayrmp and Orca have them; the layout of the status in one piece is a choice (the
machine spreads it over eight CAN messages).
"""

import math
import struct
from dataclasses import astuple, dataclass, fields
from enum import IntEnum, IntFlag

from refseq_bench.robots.errors import RobotsError

COUNTS_PER_METRE = 33215
COUNTS_PER_SPEED = 332
"""Counts per m/s."""
COUNTS_PER_DEGREE = 7.8
"""Also per degree a second."""
COUNTS_PER_REVOLUTION = 112644
COUNTS_PER_TORQUE = 1094
"""Counts per N·m."""
COUNTS_PER_RADIAN = COUNTS_PER_DEGREE * 180 / math.pi

TOP_SPEED = 1176
"""Largest velocity word: 3.54 m/s."""
TOP_TURN = 1024
"""Largest turn word: 131 °/s."""


class Mode(IntEnum):
    """Operational mode, by its word."""

    DISABLED = 0
    TRACTOR = 1
    BALANCE = 2


class GainSet(IntEnum):
    """Load that the machine is told to balance, by its word."""

    LIGHT = 0
    TALL = 1
    HEAVY = 2


class Config(IntEnum):
    """Settings that a command carries besides the motion, by their words."""

    NONE = 0
    GAIN_SET = 13
    MODE = 16
    RESET_INTEGRATORS = 50


RESET_FOREAFT = 0x08
"""The one integrator that a command may reset here: where the machine holds its place."""

_PARAMETERS: dict[Config, frozenset[int]] = {
    Config.NONE: frozenset({0}),
    Config.GAIN_SET: frozenset(GainSet),
    Config.MODE: frozenset(Mode),
    Config.RESET_INTEGRATORS: frozenset({RESET_FOREAFT}),
}


class StatusBits(IntFlag):
    """Bits of the status words; those of the second word are shifted up by 16."""

    SPEED_LIMIT_0 = 0x0020
    SYSTEM_INTEGRITY_FAULT = 0x0040
    MOTORS_ENABLED = 0x0080
    BALANCE_MODE = 0x0100
    MOTOR_FEEDBACK_FAULT = 0x2000
    PITCH_LIMIT = 0x0001 << 16
    POSITION_ERROR = 0x0004 << 16
    ROLL_LIMIT = 0x0040 << 16


QUIET = StatusBits(0)


@dataclass(frozen=True, slots=True)
class SegwayCommand:
    """Speed and turn rate in counts, and one setting. Raises ``RobotsError`` for what the machine would refuse."""

    velocity: int = 0
    turn: int = 0
    config: Config = Config.NONE
    parameter: int = 0

    def __post_init__(self) -> None:
        _check_within("velocity", self.velocity, TOP_SPEED)
        _check_within("turn", self.turn, TOP_TURN)
        valid = _PARAMETERS[self.config]
        if self.parameter not in valid:
            listed = ", ".join(map(str, sorted(valid)))
            raise RobotsError(f"command: parameter {self.parameter} of {self.config.name}: valid are {listed}")

    def encode(self) -> bytes:
        """Return the eight bytes of the frame."""
        return _COMMAND.pack(self.velocity, self.turn, self.config, self.parameter)

    @classmethod
    def decode(cls, frame: bytes) -> "SegwayCommand":
        """Read a frame; raises ``RobotsError`` for one that the machine would refuse."""
        if len(frame) != _COMMAND.size:
            raise RobotsError(f"command frame of {len(frame)} bytes: {_COMMAND.size} are needed")
        velocity, turn, config, parameter = _COMMAND.unpack(frame)
        if config not in set(Config):
            listed = ", ".join(map(str, sorted(Config)))
            raise RobotsError(f"command: configuration word {config}: valid are {listed}")
        return cls(velocity, turn, Config(config), parameter)


_COMMAND = struct.Struct(">hhHH")


def _check_within(name: str, value: int, most: int) -> None:
    if not -most <= value <= most:
        raise RobotsError(f"command: {name} word {value} must be in [{-most}, {most}]")


@dataclass(frozen=True, slots=True)
class StatusFrame:
    """Status frame of the machine, in counts.

    ``frames`` counts ticks and wraps at 65536. ``left``, ``right``, ``forward`` and ``yaw`` are ways since the start,
    against the floor: the body's pitch is taken out of the wheels' counters. Torques that are too large for their word
    are told as the largest that fits it (30 N·m).
    """

    frames: int = 0
    pitch: int = 0
    pitch_rate: int = 0
    roll: int = 0
    yaw_rate: int = 0
    left_speed: int = 0
    right_speed: int = 0
    left: int = 0
    right: int = 0
    forward: int = 0
    yaw: int = 0
    left_torque: int = 0
    right_torque: int = 0
    mode: Mode = Mode.DISABLED
    gain_set: GainSet = GainSet.LIGHT
    velocity_command: int = 0
    turn_command: int = 0
    words: StatusBits = QUIET

    def encode(self) -> bytes:
        """Return the bytes of the frame."""
        return _STATUS.pack(*astuple(self))

    @classmethod
    def decode(cls, frame: bytes) -> "StatusFrame":
        """Read a frame; raises ``RobotsError`` for one that is none."""
        if len(frame) != _STATUS.size:
            raise RobotsError(f"status frame of {len(frame)} bytes: {_STATUS.size} are needed")
        told = dict(zip((item.name for item in fields(cls)), _STATUS.unpack(frame), strict=True))
        for name, kind in (("mode", Mode), ("gain_set", GainSet)):
            if told[name] not in set(kind):
                listed = ", ".join(map(str, sorted(kind)))
                raise RobotsError(f"status: {name} word {told[name]}: valid are {listed}")
            told[name] = kind(told[name])
        if told["words"] & ~_KNOWN:
            raise RobotsError(f"status: words {told['words']:#x} have bits that nobody knows: valid are {_KNOWN:#x}")
        return cls(**{**told, "words": StatusBits(told["words"])})


_STATUS = struct.Struct(">HhhhhhhiiiihhHHhhI")
_KNOWN = sum(StatusBits)


def counts(value: float, scale: float, bits: int = 16) -> int:
    """Return ``value`` in counts of a signed word, its largest where it does not fit; nothing read is told as 0."""
    most = 2 ** (bits - 1) - 1
    if math.isnan(value):
        return 0
    return round(min(max(value * scale, -most), most))
