"""Warnings about offsets, other clocks and pairing, on findings that are laid out by hand."""

import math
from collections.abc import Mapping, Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from refseq.logs.source import EMPTY
from refseq.view import Scan, View
from refseq_bench.scenarios.drives.odometry_doubts import odometry_jumps, without_jumps
from refseq_bench.scenarios.log_tools.clocks.late import SensorClock
from refseq_bench.scenarios.log_tools.clocks.offsets import ClockOffset
from refseq_bench.scenarios.log_tools.warnings import warnings_of


def topic(name: str, *, count: int = 100, rate: float = 10.0, samples: Any = ()) -> Any:
    timing = SimpleNamespace(count=count, rate=rate, zeros=0, backwards=0, duplicates=0, longest_gap=None, gaps=())
    return SimpleNamespace(name=name, timing=timing, channel=SimpleNamespace(role="a sensor's"), samples=samples)


def told(
    offset: ClockOffset | None = None,
    *,
    logged: float = math.nan,
    given: float | None = None,
    left: int = 0,
    scans: Any = None,
    damage: str = "",
    views: Sequence[View] = (),
    skipped: Mapping[str, int] | None = None,
    **findings: Any,
) -> list[str]:
    """Warnings about a log of a camera, which leads, a laser and odometry."""
    topics = (topic("/odom"), topic("/camera"), scans or topic("/scan"))
    source = SimpleNamespace(complete=not damage, damage=damage, skipped=skipped or {}, metadata={})
    found: Any = SimpleNamespace(source=source, topics=topics, start=0.0, other_times=(), zero=lambda topic: 0.0)
    plain = {
        "sensors": {"/camera": "camera", "/scan": "laser"},
        "odometry": "/odom",
        "truth": "",
        "leading": "/camera",
        "tolerance": 0.05,
        "unpaired": {"laser": left},
        "without_odometry": 0,
        "notes": (),
        "losses": list,
    }
    stamps = {"/camera": SimpleNamespace(usual_size=(640, 480)), "/scan": SimpleNamespace(usual_size=None)}
    plan: Any = SimpleNamespace(findings=SimpleNamespace(**plain | findings), views=views, source=source, stamps=stamps)
    return list(warnings_of(found, plan, {"laser": SensorClock(given, logged, offset), "camera": SensorClock()}))


def test_of_a_log_without_fault_nothing_is_told() -> None:
    assert told() == []
    assert told(ClockOffset(0.04, 0.9, 1.2)) == []


@pytest.mark.parametrize(
    ("offset", "words"),
    [
        (ClockOffset(0.2, 0.9, 1.0), ["0.20 s late", "--late laser=0.20"]),
        (ClockOffset(-0.2, 0.9, 1.0), ["0.20 s early", "--late laser=-0.20"]),
        (ClockOffset(0.2, -0.8, 1.0), ["turn the other way than /odom", "correlation -0.80"]),
        (ClockOffset(0.0, 0.9, 0.5), ["sees 50 % of the turns that /odom tells"]),
        (ClockOffset(0.0, 0.9, 1.4), ["sees 140 % of the turns"]),
    ],
)
def test_an_offset_is_told_with_what_sets_it_right(offset: ClockOffset, words: list[str]) -> None:
    (line,) = told(offset)
    assert line.startswith("/scan: ")
    assert all(word in line for word in words), line


def test_late_and_of_a_false_gain_are_two_faults() -> None:
    assert len(told(ClockOffset(0.2, 0.9, 2.0))) == 2


def test_another_clock_is_told_by_how_much() -> None:
    told_by = "/scan: stamped by another clock than /odom: +1.50 s by the times of logging"
    assert told(logged=1.5) == [f"{told_by}; --late laser=1.50 sets them right"]
    assert told(logged=0.2) == []
    assert told(ClockOffset(1.62, 0.9, 1.0), logged=1.5) == [
        f"{told_by}, +1.62 s by the turns that both see; --late laser=1.62 sets them right"
    ]
    upside_down = told(ClockOffset(1.62, -0.9, -1.0), logged=1.5)
    assert upside_down[0] == f"{told_by}; --late laser=1.50 sets them right", "the other way: not by turns"
    assert len(upside_down) == 2


def test_a_clock_is_right_where_turns_say_so_however_late_it_is_logged() -> None:
    assert told(ClockOffset(0.01, 0.9, 1.0, error=0.01), logged=-0.6) == []


def test_of_a_delay_that_the_user_has_told_no_word_is_lost() -> None:
    assert told(logged=1.5, given=1.4) == []
    assert told(ClockOffset(1.52, 0.9, 1.0), logged=1.5, given=1.5) == []
    (line,) = told(ClockOffset(1.3, 0.9, 1.0), logged=1.5, given=1.5)
    assert line.endswith("--late laser=1.30 sets them right")


def test_samples_without_a_view_are_told_unless_the_sensor_is_faster_than_views_are() -> None:
    (line,) = told(left=11)
    assert line == "/scan: 11 of 100 messages are within 0.050 s of no view"
    assert told(left=10) == []
    assert told(left=70, scans=topic("/scan", rate=40.0)) == []


def test_what_is_told_of_a_log_comes_in_the_order_of_weight() -> None:
    lines = told(damage="cut in a chunk", without_odometry=1, notes=("a note",), left=50)
    assert lines[:3] == [
        "the log is incomplete: cut in a chunk; what lies before is read",
        "a note",
        "1 moment without odometry: no view",
    ]
    assert len(lines) == 4


def test_messages_without_a_value_are_told_and_other_kinds_are_not() -> None:
    skipped = {"rosgraph_msgs/msg/Log": 7, f"nav_msgs/msg/Odometry{EMPTY}": 1, f"foxglove.CompressedVideo{EMPTY}": 5}
    assert told(skipped=skipped) == [
        "1 message of nav_msgs/msg/Odometry without a value: no number, or a rotation of nothing but zeros",
        "5 messages of foxglove.CompressedVideo without a value: before a key frame",
    ]


def driven(*ways: float, step: float = 0.5) -> list[View]:
    return [View(step * number, distance=way) for number, way in enumerate(ways)]


@pytest.mark.parametrize(
    ("views", "line"),
    [
        (driven(0.0, *[400.0] * 5), "/odom: the robot goes 800 m/s: are its poses in metres?"),
        (
            driven(0.0, 0.4, 0.4, -1000.0, 0.4, 0.4),
            "/odom: poses jump by 1000.0 m within 0.50 s at 1.0 s: read what lies before or behind (--views)",
        ),
        (
            driven(0.0, *[0.4] * 8, 31.0, *[0.4] * 8, -12.0, 0.4, step=2.0),
            "/odom: poses jump by 31.0 m within 2.00 s at 16.0 s, and once more: read what lies before or behind "
            "(--views)",
        ),
    ],
)
def test_a_robot_that_no_one_has_is_told(views: list[View], line: str) -> None:
    assert told(views=views) == [line]


def test_a_jump_of_a_robot_that_mostly_stands_is_one_and_a_pause_of_the_log_is_none() -> None:
    assert told(views=driven(*[0.0] * 100, 40.0, *[0.0] * 5)) == [
        "/odom: poses jump by 40.0 m within 0.50 s at 49.5 s: read what lies before or behind (--views)"
    ]
    assert told(views=driven(*[0.4] * 20, 1.0, *[0.4] * 5, step=0.025)) == [
        "/odom: poses jump by 1.0 m within 0.02 s at 0.5 s: read what lies before or behind (--views)"
    ], "faster than any robot, however short"
    walking = [*driven(*[0.0] * 100, *[0.2] * 12), View(76.0, distance=4.0)]  # 4 m in 20 s
    assert told(views=walking) == []
    assert told(views=driven(*[0.3] * 30, *[3.2] * 6, step=2.0)) == [], "a robot that begins to hurry"


@pytest.mark.parametrize(("ways", "steps"), [((13.2, 0.8), 2), ((0.8, 13.2), 2), ((14.0,), 1), ((14.0, 0.05), 1)])
def test_a_view_within_a_jump_is_no_way(ways: tuple[float, ...], steps: int) -> None:
    """Its pose is interpolated between both sides."""
    views = driven(0.0, *[0.05] * 20, *ways, *[0.05] * 20, step=0.1)
    (jump,) = odometry_jumps(views)
    assert (jump.view, jump.steps, jump.way) == (20 + steps, steps, pytest.approx(14.0))
    assert sum(view.distance for view in without_jumps(views)) == pytest.approx(0.05 * (40 + len(ways) - steps))


def test_stamps_that_stand_still_tell_no_speed() -> None:
    assert told(views=driven(0.0, 0.4, 0.4, 0.4, step=0.0)) == []
    assert told(views=driven(0.0, 0.4, 0.4, 0.4)) == []


@pytest.mark.parametrize(("farthest", "count"), [(30.0, 0), (3000.0, 1)])
def test_a_laser_that_no_one_has_is_told(farthest: float, count: int) -> None:
    scan = Scan(np.linspace(1, farthest, 181).astype(np.float32), max_range=1e5)
    found = told(scans=topic("/scan", samples=[SimpleNamespace(content=scan)]))
    assert found == ["/scan: half of its ranges are beyond 1500 m: are they in metres?"] * count


def test_scans_that_change_their_layout_are_told() -> None:
    scans = [Scan(np.ones(count, np.float32), start=start) for count, start in ((361, -np.pi / 2), (181, -np.pi / 2))]
    samples = [SimpleNamespace(content=scan) for scan in scans]
    assert told(scans=topic("/scan", samples=samples)) == [
        "/scan: its scans have 361 beams from -90° and 181 beams from -90°: what one layout does not see is not matched"
    ]
    assert told(scans=topic("/scan", samples=samples[:1] * 3)) == []
