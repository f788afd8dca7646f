import json
import math

import numpy as np
import pytest

from refseq.planar import Pose
from refseq.view import View
from refseq_bench.scenarios.scoring.fault_spans import FaultSpan, fault_spans, way_along


def drive(xs: list[float], distances: list[float] | None = None) -> list[View]:
    """Views along the x axis; odometry sees all of the way, or what is said."""
    seen = distances or [0.0, *np.diff(xs).tolist()]
    return [View(2.0 * t, distance=d, truth=Pose(x, 0.0, 0.0)) for t, (x, d) in enumerate(zip(xs, seen, strict=True))]


def told(*faults: dict[str, object]) -> dict[str, str]:
    return {"faults": json.dumps(faults)}


STRAIGHT = drive([float(x) for x in range(20)])


def test_a_covered_camera_is_a_stretch_of_views() -> None:
    fault = {"kind": "camera-black", "camera": "camera-1", "at": 4.5, "until": 8.0}
    assert fault_spans(STRAIGHT, told(fault)) == (FaultSpan("camera-1 black from 4.5 m", 5, 7),)


def test_slip_lasts_seconds() -> None:
    fault = {"kind": "wheel-slip", "at": 3.5, "seconds": 5.0, "wheels": "both", "friction": 0.02}
    # View 3 is at 6 s, so that views up to 11 s are met: those at 8 s and 10 s.
    assert fault_spans(STRAIGHT, told(fault)) == (FaultSpan("wheel slip from 3.5 m", 4, 5),)


@pytest.mark.parametrize("to", [14.0, 1.0])
def test_after_a_kidnap_the_way_goes_on_from_where_the_robot_was_set_down(to: float) -> None:
    # Views at 0 to 5 m, then carried at 5.4 m, and seen again 0.6 m after the place where it was set down.
    xs = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, to + 0.6, to + 1.6, to + 2.6, to + 3.6]
    views = drive(xs, [0.0, *[1.0] * 9])
    way = way_along(views, [(5.4, to)])
    assert way.kidnapped == (6,)
    assert np.allclose(way.along, xs)
    black = {"kind": "laser-dazzled", "at": to + 1.0, "until": to + 3.0, "bearing": 0.0, "width": 180.0}
    found = fault_spans(views, told(black, {"kind": "kidnap", "at": 5.4, "to": to}))
    assert FaultSpan("kidnap at 5.4 m", 6, 6, carried=True) in found
    assert any(one.label.startswith("laser dazzled") and one.last == 8 for one in found)


def test_what_no_view_met_is_left_out() -> None:
    late = {"kind": "camera-black", "camera": "camera-1", "at": 100.0, "until": 101.0}
    between = {"kind": "camera-black", "camera": "camera-1", "at": 4.1, "until": 4.9}
    assert fault_spans(STRAIGHT, told(late, between)) == ()
    assert fault_spans(STRAIGHT, {}) == ()
    assert fault_spans([], told(late)) == ()


@pytest.mark.parametrize(
    "text",
    [
        "none", "", "3", '{"count": 0}', '["camera dirty"]', '[{"kind": "dirty"}]',
        '[{"kind": 3, "at": 1, "until": 2}]',
        '[{"kind": "dirty", "at": "1", "until": 2}]', '[{"kind": "dirty", "at": NaN, "until": 2}]',
        '[{"kind": "dirty", "at": 1}]', '[{"kind": "kidnap", "at": 1, "until": 2}]',
        f'[{{"kind": "dirty", "at": 1, "until": 1{"0" * 400}}}]', "[" * 100_000,
    ],
)  # fmt: skip
def test_what_a_log_from_elsewhere_tells_by_that_name_is_no_fault(text: str) -> None:
    assert fault_spans(STRAIGHT, {"faults": text}) == ()


def test_faults_beside_what_is_none_are_told() -> None:
    black = {"kind": "camera-black", "camera": "camera-1", "at": 4.5, "until": 8.0}
    assert fault_spans(STRAIGHT, told({"kind": "dirty"}, black)) == fault_spans(STRAIGHT, told(black))


def test_without_truth_nothing_is_known() -> None:
    views = [*STRAIGHT[:3], View(6.0), *STRAIGHT[4:]]
    assert [math.isnan(way) for way in way_along(views, []).along] == [False] * 3 + [True] * 17
