import json
import math
from dataclasses import asdict

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from refseq.planar import Pose
from refseq.view import View
from refseq_bench.scenarios.scoring.fault_spans import FaultSpan, fault_spans, way_along
from refseq_bench.scenarios.scoring.recovery import JUMP
from refseq_bench.sim.bench.faults import CameraBlack, Kidnap
from tests.sim.bench.test_faults import Course, agenda_of


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
    light = {"kind": "laser-dazzled", "at": to + 1.0, "until": to + 3.0, "bearing": 0.0, "width": 180.0}
    found = fault_spans(views, told(light, {"kind": "kidnap", "at": 5.4, "to": to}))
    # The robot that is carried back met the lamp before, and each fault happens once.
    met = (7, 8) if to > 5.4 else (2, 3)
    assert FaultSpan("kidnap at 5.4 m", 6, 6, carried=True) in found
    assert FaultSpan(f"laser dazzled from {to + 1:g} m", *met) in found


@pytest.mark.parametrize("unseen", [{"at": 5.0, "to": 6.0}, {"at": 5.0, "to": 3.5}])
def test_a_kidnap_that_is_not_seen_gives_its_name_to_no_other(unseen: dict[str, float]) -> None:
    xs = [*map(float, range(6)), *np.arange(unseen["to"] + 1, 12).tolist(), 2.5, 3.5, 4.5]
    views = drive(xs, [0.0, *[1.0] * (len(xs) - 1)])
    later = {"kind": "kidnap", "at": 12.0, "to": 2.0}
    carried = len(views) - 3
    assert fault_spans(views, told({"kind": "kidnap", **unseen}, later)) == (
        FaultSpan("kidnap at 12 m", carried, carried, carried=True),
    )
    way = way_along(views, [(unseen["at"], unseen["to"]), (12.0, 2.0)])
    assert way.along[-1] == pytest.approx(4.5, abs=JUMP)  # what was not seen is not counted


def test_a_kidnap_that_another_carries_the_robot_past_gives_its_name_to_no_other() -> None:
    views = drive([0.0, 1.0, 2.0, 11.0, 12.0, 13.0, 4.0, 5.0], [0.0, *[1.0] * 7])
    kidnaps = [{"kind": "kidnap", "at": at, "to": to} for at, to in ((2.0, 10.0), (8.0, 1.0), (13.0, 3.0))]
    assert [span.label for span in fault_spans(views, told(*kidnaps))] == ["kidnap at 2 m", "kidnap at 13 m"]


on_views = st.integers(0, 24).map(lambda half: half / 2)
between_views = on_views.map(lambda way: way + 0.25)


@given(st.tuples(between_views, between_views).filter(lambda pair: pair[0] < pair[1]), on_views, on_views)
@example((3.25, 5.25), 4.0, 1.0)
@example((3.25, 5.25), 5.0, 1.0)
@example((3.75, 5.25), 4.0, 1.0)
@example((3.25, 5.25), 4.0, 8.0)
def test_views_of_a_stretch_are_those_that_the_schedule_made_dark(
    stretch: tuple[float, float], at: float, to: float
) -> None:
    """Drive a stand-in in half metres, a view each, through a covered camera and a kidnap."""
    assume(at > 0 and abs(to - at) > JUMP + 1)
    faults = [CameraBlack(*stretch, "camera-1"), Kidnap(at, to)]
    course, xs, dark = Course(length=20.0), [0.0], []
    agenda = agenda_of(course, faults)
    for view in range(60):
        agenda.look()
        xs[view] = course.progress
        dark += [view] if course.covered else []
        course.progress += 0.5
        xs.append(course.progress)
    views = drive(xs[:60], [0.0, *[0.5] * 59])
    spans = fault_spans(views, told(*map(asdict, faults)))
    found = [view for span in spans if not span.carried for view in range(span.first, span.last + 1)]
    assert found == dark


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
