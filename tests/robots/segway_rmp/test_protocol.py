"""The RMP's frames: a command holds nothing that the machine would refuse, and any number fits its word."""

import math

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
    counts,
)

SETTINGS = [
    (Config.NONE, 0),
    *((Config.GAIN_SET, gain_set) for gain_set in GainSet),
    *((Config.MODE, mode) for mode in Mode),
    (Config.RESET_INTEGRATORS, RESET_FOREAFT),
]
words = (
    st.integers(-(2**15), 2**15 - 1)
    | st.integers(-TOP_TURN, TOP_TURN)
    | st.sampled_from([side * (most + more) for side in (-1, 1) for most in (TOP_SPEED, TOP_TURN) for more in (0, 1)])
)


def complaint(velocity: int, turn: int, config: Config, parameter: int) -> str:
    """What is wrong with the words of a command; nothing where the machine takes them."""
    try:
        SegwayCommand(velocity, turn, config, parameter)
    except RobotsError as error:
        return str(error)
    return ""


def test_scale_factors_are_those_of_the_machine() -> None:
    assert (COUNTS_PER_METRE, COUNTS_PER_SPEED, COUNTS_PER_DEGREE) == (33215, 332, 7.8)
    assert (COUNTS_PER_REVOLUTION, COUNTS_PER_TORQUE) == (112644, 1094)
    assert pytest.approx(3.54, abs=0.003) == TOP_SPEED / COUNTS_PER_SPEED


@given(velocity=words, turn=words, setting=st.sampled_from(SETTINGS))
def test_a_command_is_within_what_the_machine_takes(velocity: int, turn: int, setting: tuple[Config, int]) -> None:
    fits = abs(velocity) <= TOP_SPEED and abs(turn) <= TOP_TURN
    assert (complaint(velocity, turn, *setting) == "") == fits


@given(config=st.sampled_from(Config), parameter=st.integers(-1, 20) | words)
def test_a_setting_is_one_that_the_machine_has(config: Config, parameter: int) -> None:
    wrong = complaint(0, 0, config, parameter)
    assert (wrong == "") == ((config, parameter) in SETTINGS)
    assert "\n" not in wrong


@pytest.mark.parametrize(
    ("told", "message"),
    [
        ((1177, 0, Config.NONE, 0), "command: velocity word 1177 must be in [-1176, 1176]"),
        ((0, -1025, Config.NONE, 0), "command: turn word -1025 must be in [-1024, 1024]"),
        ((0, 0, Config.GAIN_SET, 3), "command: parameter 3 of GAIN_SET: valid are 0, 1, 2"),
        ((0, 0, Config.NONE, 5), "command: parameter 5 of NONE: valid are 0"),
    ],
)
def test_a_wrong_command_is_told(told: tuple[int, int, Config, int], message: str) -> None:
    assert complaint(*told) == message


@given(value=st.floats(-29.9, 29.9))
def test_counts_are_nearest(value: float) -> None:
    assert abs(counts(value, COUNTS_PER_TORQUE) / COUNTS_PER_TORQUE - value) <= 0.5 / COUNTS_PER_TORQUE + 1e-12


@given(value=st.floats(allow_nan=True))
def test_any_number_fits_its_word(value: float) -> None:
    assert -(2**15) < counts(value, COUNTS_PER_TORQUE) < 2**15
    if abs(value) > 30.0:
        assert counts(value, COUNTS_PER_TORQUE) == math.copysign(2**15 - 1, value)
