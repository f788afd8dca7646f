"""Messages between modules: what was sent is what is read, to the last bit, and damage is refused."""

import json
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from foxglove import messages

from refseq.belief import Belief, PoseBeside, Timings
from refseq.fault import DeclaredFault, FaultKind
from refseq.map.learning import learn
from refseq.modules.heads import MessageError, Parts, head_bytes
from refseq.modules.messages import (
    CAMERA,
    HEAD,
    Command,
    Ended,
    ScanGeometry,
    SentScan,
    Step,
    ViewHead,
    belief_in,
    head_of,
    part,
    scan_in,
    sent_scan,
    view_in,
    view_parts,
)
from refseq.serve.answers import answer_to
from refseq.view import LASER, Scan, View, facing
from tests.support import corridor_drive


@pytest.fixture(scope="module")
def view() -> View:
    """A view of two cameras and a laser of which some beams never came back."""
    drawn = corridor_drive(np.random.default_rng(2), 2, size=24)[1]
    assert drawn.scan is not None
    ranges = drawn.scan.ranges.copy()
    ranges[10:20] = np.inf
    return replace(drawn, time=1234.567891, distance=-0.1, turn=0.3, scan=Scan(ranges, -1.0, 0.01 / 3, 30.0))


def test_a_view_is_read_as_it_was_sent_but_for_its_truth(view: View) -> None:
    parts = view_parts("a drive", 7, view)
    head = head_of(ViewHead, parts)
    found = view_in(head, parts)
    assert (head.drive, head.number) == ("a drive", 7)
    assert (found.time, found.distance, found.turn, found.has_odometry) == (1234.567891, -0.1, 0.3, True)
    assert found.images.keys() == view.images.keys()
    assert all(np.array_equal(found.images[name], image) for name, image in view.images.items())
    assert found.scan is not None
    assert view.scan is not None
    assert np.array_equal(found.scan.ranges, view.scan.ranges)
    angles = (found.scan.start, found.scan.step, found.scan.max_range)
    assert ScanGeometry(*angles) == head.scan == ScanGeometry(-1.0, 0.01 / 3, 30.0)
    assert found.truth is None
    assert view.truth is not None


def test_a_view_without_laser_or_odometry_has_none(view: View) -> None:
    parts = view_parts("a drive", 0, replace(view, scan=None, has_odometry=False))
    assert part(parts, LASER) is None
    found = view_in(head_of(ViewHead, parts), parts)
    assert found.scan is None
    assert not found.has_odometry


def test_a_scan_needs_its_angles_and_its_ranges(view: View) -> None:
    parts = view_parts("a drive", 0, view)
    geometry = head_of(ViewHead, parts).scan
    assert scan_in(parts, geometry) is not None
    assert scan_in(parts, None) is None
    assert scan_in(parts[:1], geometry) is None


@pytest.mark.parametrize(
    ("count", "start", "step"),
    [
        (360, 0.0, math.radians(1)),
        (361, 0.0, math.radians(1)),
        (720, 0.3, math.radians(0.5)),
        (361, math.pi / 2, -math.pi / 360),
        (361, 1.5 * math.pi, math.pi / 360),
    ],
)
def test_each_range_keeps_its_direction_wherever_a_scan_begins_and_however_it_turns(
    count: int, start: float, step: float
) -> None:
    scan = Scan((1 + np.arange(count) / 100).astype(np.float32), start, step, 30.0)
    sent = sent_scan(scan, 1.0)
    found = scan_in(list(sent.parts), sent.geometry)
    assert found == facing(scan)
    told = {round(float(r), 2): b for r, b in zip(found.ranges, found.bearings, strict=True)}
    off = [told[round(float(r), 2)] - b for r, b in zip(scan.ranges[:360], scan.bearings[:360], strict=True)]
    assert np.exp(1j * np.array(off)) == pytest.approx(np.ones(len(off)))


@pytest.mark.parametrize("change", [{"start": 0.0}, {"step": -0.01 / 3}, {"start": math.nan}])
def test_a_scan_whose_head_tells_other_angles_is_refused(view: View, change: dict[str, float]) -> None:
    parts = view_parts("a drive", 0, view)
    geometry = replace(head_of(ViewHead, parts).scan, **change)
    with pytest.raises(MessageError, match=r"a scan starts at .* rad; valid is one start, and counter-clockwise"):
        scan_in(parts, geometry)


def test_a_scan_without_beams_is_none(view: View) -> None:
    assert sent_scan(None, 0.0) == sent_scan(Scan(np.zeros(0, np.float32)), 0.0) == SentScan()
    assert head_of(ViewHead, view_parts("a drive", 0, replace(view, scan=None))).scan is None


@pytest.mark.parametrize(
    ("name", "damage", "why"),
    [
        (f"{CAMERA}forward", lambda data: data[: len(data) // 2], "no foxglove.CompressedImage"),
        (f"{CAMERA}forward", lambda _: b"\xff", "no foxglove.CompressedImage"),
        (
            f"{CAMERA}forward",
            lambda _: messages.CompressedImage(frame_id="forward", data=b"no picture", format="png").encode(),
            "a picture cannot be read: ",
        ),
        (LASER, lambda data: data[:-3], "no foxglove.LaserScan"),
        (LASER, lambda _: b"\xff", "no foxglove.LaserScan"),
        (HEAD, lambda data: data[:-1], "a message is no ViewHead: all: "),
        (HEAD, lambda data: data.replace(b'"number": 0', b'"number": "0"'), "a message is no ViewHead: number: "),
        (HEAD, lambda data: data.replace(b'"drive"', b'"dr"'), "a message is no ViewHead: drive: "),
        (HEAD, lambda _: b"", "a message is no ViewHead: all: "),
    ],
)
def test_a_view_that_is_damaged_is_refused(view: View, name: str, damage: Any, why: str) -> None:
    parts: Parts = [(one, damage(data) if one == name else data) for one, data in view_parts("a drive", 0, view)]
    with pytest.raises(MessageError, match=why):
        view_in(head_of(ViewHead, parts), parts)


COUNT = 4
FAULT = DeclaredFault("front", FaultKind.FROZEN, 3, 6.25, 11.5)
BELIEF = Belief(
    np.array([0.1, 0.2, 0.3, 0.4]),
    0.1 / 3,
    3,
    (-1, 2, 3),
    1.25,
    Timings(0.03, 0.002, 0.004, 0.0005),
    (FAULT,),
    np.array([0.0, 0.01, 0.02, 0.1 / 3]),
    PoseBeside(0.3, -0.1, 1 / 30, np.diag([0.04, 0.01, 1e-4]) + 1e-5),
)


@pytest.fixture(scope="module")
def told() -> dict[str, Any]:
    """A belief in JSON, as the localiser sends it."""
    drive = [replace(view, images={}) for view in corridor_drive(np.random.default_rng(1), COUNT, size=24)]
    found: dict[str, Any] = json.loads(answer_to(learn(drive), 5, drive[0], BELIEF).json)
    return found


def test_a_belief_is_read_as_it_was_sent(told: dict[str, Any]) -> None:
    found = belief_in(json.dumps(told).encode())
    assert found.view == 5
    assert np.array_equal(found.belief.places, BELIEF.places)
    assert found.belief.lost_after is not None
    assert BELIEF.lost_after is not None
    assert np.array_equal(found.belief.lost_after, BELIEF.lost_after)
    assert found.belief.pose is not None
    assert BELIEF.pose is not None
    assert found.belief.pose.motion == BELIEF.pose.motion
    assert np.array_equal(found.belief.pose.covariance, BELIEF.pose.covariance)
    assert belief_in(json.dumps({**told, "beside": None}).encode()).belief.pose is None
    for name in ("lost", "best", "path", "entropy", "timings", "faults"):
        assert getattr(found.belief, name) == getattr(BELIEF, name), name


def test_a_method_without_lost_places_has_none(told: dict[str, Any]) -> None:
    assert belief_in(json.dumps({**told, "lost_after": None}).encode()).belief.lost_after is None


@pytest.mark.parametrize(
    "change",
    [
        {"view": "x"},
        {"view": None},
        {"view": math.inf},
        {"path": [0, -math.inf]},
        {"places": "0.1"},
        {"places": [[0.5, 0.5]], "best": 0},
        {"places": [0.5, float("nan")], "best": 0},
        {"places": [0.5, float("inf")], "best": 0},
        {"places": [], "best": 0},
        {"best": COUNT},
        {"best": -1},
        {"path": 3},
        {"path": ["here"]},
        {"lost": None},
        {"entropy": []},
        {"timings": {"nothing": 1.0}},
        {"timings": 3},
        {"faults": [{"kind": "frozen"}]},
        {"faults": [{"sensor": "front", "kind": "shy", "since": 3, "time": 6.0, "evidence": 1.0}]},
        {"faults": [3]},
        {"lost_after": {}},
        {"lost_after": [0.1]},
        {"beside": {"along": 0.1}},
        {"beside": {"along": 0.1, "aside": 0.0, "heading": 0.0, "covariance": [0.1] * 8}},
        {"beside": {"along": float("nan"), "aside": 0.0, "heading": 0.0, "covariance": [0.1] * 9}},
        {"lost": float("nan")},
        {"lost": 1.5},
        {"entropy": float("inf")},
    ],
)
def test_a_belief_that_is_damaged_is_refused(told: dict[str, Any], change: dict[str, Any]) -> None:
    with pytest.raises(MessageError, match=r"a message is no belief: |a belief (of|has) "):
        belief_in(json.dumps({**told, **change}).encode())


@pytest.mark.parametrize("gone", ["view", "places", "lost", "best", "path", "entropy", "timings", "faults"])
def test_a_belief_that_lacks_something_is_refused(told: dict[str, Any], gone: str) -> None:
    with pytest.raises(MessageError, match=f"a message is no belief: '{gone}'"):
        belief_in(json.dumps({name: value for name, value in told.items() if name != gone}).encode())


@pytest.mark.parametrize("data", [b"", b"{", b"[]", b"3", b"null", b"\xff\xfe", b"[" * 100_000])
def test_bytes_that_are_no_belief_are_refused_in_one_short_line(data: bytes) -> None:
    with pytest.raises(MessageError) as told:
        belief_in(data)
    assert str(told.value).startswith("a message is no belief: ")
    assert len(str(told.value)) < 300
    assert "\n" not in str(told.value)


@pytest.mark.parametrize(
    ("command", "steers"),
    [
        (Command("a drive", 3, 0.5, 0.1, number=1, behaviour="MN:12"), True),
        (Command("a drive", 3, number=1, ended=Ended(1, True, "there")), True),
        (Command("a drive", 3, halt=True), False),
        (Command("a drive", 3, scan=True), False),
        (Command("a drive", 3, over="completed"), False),
    ],
)
def test_a_command_is_carried_in_a_step_as_it_was_given(command: Command, steers: bool) -> None:
    step = Step("a drive", 4, 0.1 + 0.2, 1e9 / 3, 2.5, "robuter", command=command, truth=(1.0, 2.0, 1 / 3))
    found = head_of(Step, [("other", b""), (HEAD, head_bytes(step)), (HEAD, b"a second one")])
    assert found == step
    assert found.command.steers == steers
