"""The RMP's frames: what goes out comes back, and nothing that is none gets in."""

import math
import struct
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq_bench.robots import RobotsError
from refseq_bench.robots.segway_rmp.protocol import (
    COUNTS_PER_DEGREE,
    COUNTS_PER_METRE,
    COUNTS_PER_REVOLUTION,
    COUNTS_PER_SPEED,
    COUNTS_PER_TORQUE,
    RESET_FOREAFT,
    TOP_SPEED,
    TOP_TURN,
    Config,
    GainSet,
    Mode,
    SegwayCommand,
    StatusBits,
    StatusFrame,
    counts,
)

SETTINGS = [
    (Config.NONE, 0),
    *((Config.GAIN_SET, gain_set) for gain_set in GainSet),
    *((Config.MODE, mode) for mode in Mode),
    (Config.RESET_INTEGRATORS, RESET_FOREAFT),
]
words, longs = st.integers(-(2**15), 2**15 - 1), st.integers(-(2**31), 2**31 - 1)
statuses = st.builds(
    StatusFrame,
    frames=st.integers(0, 2**16 - 1),
    **dict.fromkeys(["pitch", "pitch_rate", "roll", "yaw_rate", "left_speed", "right_speed"], words),
    **dict.fromkeys(["left", "right", "forward", "yaw"], longs),
    **dict.fromkeys(["left_torque", "right_torque", "velocity_command", "turn_command"], words),
    mode=st.sampled_from(Mode),
    gain_set=st.sampled_from(GainSet),
    words=st.sets(st.sampled_from(list(StatusBits))).map(lambda bits: StatusBits(sum(bits))),
)


def complaint(decode: Callable[[bytes], SegwayCommand | StatusFrame], frame: bytes) -> str:
    """What is wrong with a frame; nothing where it is one, and then it comes out again as it went in."""
    try:
        told = decode(frame)
    except RobotsError as error:
        return str(error)
    assert told.encode() == frame
    return ""


def test_scale_factors_are_those_of_the_machine() -> None:
    assert (COUNTS_PER_METRE, COUNTS_PER_SPEED, COUNTS_PER_DEGREE) == (33215, 332, 7.8)
    assert (COUNTS_PER_REVOLUTION, COUNTS_PER_TORQUE) == (112644, 1094)
    assert pytest.approx(3.54, abs=0.003) == TOP_SPEED / COUNTS_PER_SPEED


@given(
    velocity=st.integers(-TOP_SPEED, TOP_SPEED),
    turn=st.integers(-TOP_TURN, TOP_TURN),
    setting=st.sampled_from(SETTINGS),
)
def test_a_command_comes_back_from_its_frame(velocity: int, turn: int, setting: tuple[Config, int]) -> None:
    command = SegwayCommand(velocity, turn, *setting)
    assert SegwayCommand.decode(command.encode()) == command


def test_a_command_frame_is_four_words() -> None:
    assert SegwayCommand(-332, 78, Config.MODE, Mode.TRACTOR).encode() == bytes.fromhex("feb4 004e 0010 0001")


@given(status=statuses)
def test_a_status_comes_back_from_its_frame(status: StatusFrame) -> None:
    again = StatusFrame.decode(status.encode())
    assert again == status
    assert (type(again.mode), type(again.gain_set), type(again.words)) == (Mode, GainSet, StatusBits)


@given(frame=st.binary(max_size=70))
def test_bytes_are_a_command_that_gives_them_back_or_refused_in_one_line(frame: bytes) -> None:
    assert "\n" not in complaint(SegwayCommand.decode, frame)


@given(frame=st.binary(min_size=8, max_size=8))
def test_no_eight_bytes_are_more_than_the_machine_takes(frame: bytes) -> None:
    velocity, turn, config, parameter = struct.unpack(">hhHH", frame)
    fits = abs(velocity) <= TOP_SPEED and abs(turn) <= TOP_TURN and (config, parameter) in SETTINGS
    assert (complaint(SegwayCommand.decode, frame) == "") == fits


STATUS_SIZE = len(StatusFrame().encode())


@given(frame=st.one_of(st.binary(max_size=70), st.binary(min_size=STATUS_SIZE, max_size=STATUS_SIZE)))
def test_bytes_are_a_status_that_gives_them_back_or_refused_in_one_line(frame: bytes) -> None:
    assert "\n" not in complaint(StatusFrame.decode, frame)


@pytest.mark.parametrize(
    ("frame", "message"),
    [
        (b"", "command frame of 0 bytes: 8 are needed"),
        (struct.pack(">hhHH", 1177, 0, 0, 0), "command: velocity word 1177 must be in [-1176, 1176]"),
        (struct.pack(">hhHH", 0, -1025, 0, 0), "command: turn word -1025 must be in [-1024, 1024]"),
        (struct.pack(">hhHH", 0, 0, 7, 0), "command: configuration word 7: valid are 0, 13, 16, 50"),
        (struct.pack(">hhHH", 0, 0, 13, 3), "command: parameter 3 of GAIN_SET: valid are 0, 1, 2"),
        (struct.pack(">hhHH", 0, 0, 0, 5), "command: parameter 5 of NONE: valid are 0"),
    ],
)
def test_a_wrong_command_is_told(frame: bytes, message: str) -> None:
    with pytest.raises(RobotsError) as error:
        SegwayCommand.decode(frame)
    assert str(error.value) == message


@given(value=st.floats(-29.9, 29.9))
def test_counts_are_nearest(value: float) -> None:
    assert abs(counts(value, COUNTS_PER_TORQUE) / COUNTS_PER_TORQUE - value) <= 0.5 / COUNTS_PER_TORQUE + 1e-12


@given(value=st.floats(allow_nan=True))
def test_any_number_fits_its_word(value: float) -> None:
    assert -(2**15) < counts(value, COUNTS_PER_TORQUE) < 2**15
    if abs(value) > 30.0:
        assert counts(value, COUNTS_PER_TORQUE) == math.copysign(2**15 - 1, value)
