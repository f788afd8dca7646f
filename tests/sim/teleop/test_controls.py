"""Keys, gamepads and viewers as sources of commands, and their loss."""

import math
import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq.view import Scan
from refseq_bench import robots
from refseq_bench.robots import Twist
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.envs.worlds.rooms import two_rooms
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.realtime import RealTimePacer
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.sim.teleop.capture.desk import DEADMAN, SILENT, CaptureDesk
from refseq_bench.sim.teleop.commands import SPEED, TURN_RATE, Button, Commands, SessionPhase, SessionStatus
from refseq_bench.sim.teleop.follow import HeldSnapshot, LookEvent, ViewerInput
from refseq_bench.sim.teleop.gamepad import AXIS, EVENT, FIRST_STATE, FULL, PRESS, Gamepad, PadState
from refseq_bench.sim.teleop.keys import GO_ON, HELD, LEVELS, OTHER_LOOK, PRESSED, Keyboard
from refseq_bench.sim.teleop.mirror import ROOF_GROUP, WorldMirror
from refseq_bench.sim.teleop.pictures import REACH, SIZE, pictures_of, scan_picture
from refseq_bench.sim.teleop.session import run_session
from refseq_bench.sim.teleop.viewer import ViewerSettings, ViewerSource, capture_page
from refseq_bench.worlds.build import build_world
from refseq_bench.worlds.light import light_named
from tests.sim.drives.behaving_in import corridor

CAMERALESS = BenchSettings(RendererKind.NONE, cameras=())


# --- keys ---


@pytest.mark.parametrize(
    ("held", "ahead", "turn"),
    [("W", 1, 0), ("S", -1, 0), ("A", 0, 1), ("D", 0, -1), ("WA", 1, 1), ("WS", 0, 0), ("WSD", 0, -1), ("", 0, 0)],
)
def test_keys_that_are_held_lead_the_robot(held: str, ahead: int, turn: int) -> None:
    commands = Keyboard().commands(frozenset(held), [], SessionPhase.SAMPLING)
    assert commands == Commands(Twist(ahead * SPEED, turn * TURN_RATE))


def test_a_key_and_its_arrow_are_no_faster_than_one() -> None:
    assert Keyboard().commands({"W", "UpArrow"}, [], SessionPhase.READY).twist == Twist(SPEED, 0.0)


@given(st.sets(st.sampled_from(list(HELD))), st.lists(st.sampled_from(["Equal", "Minus", *PRESSED, GO_ON, "Q"])))
def test_whatever_is_pressed_the_speed_is_one_of_those_to_choose(held: set[str], pressed: list[str]) -> None:
    keyboard = Keyboard()
    twist = keyboard.commands(held, pressed, SessionPhase.PAUSED).twist
    assert twist is not None
    assert abs(twist.linear) in {0.0, keyboard.speed}
    assert any(keyboard.speed == pytest.approx(SPEED * level) for level in LEVELS)


def test_one_key_starts_pauses_and_resumes() -> None:
    asked = [Keyboard().commands((), [GO_ON], phase).buttons for phase in SessionPhase]
    assert asked == [(Button.START,), (Button.PAUSE,), (Button.RESUME,), (), ()]


def test_buttons_come_in_the_order_of_the_keys() -> None:
    keys = ["V", "X", "Delete", "E", "R", "V"]
    assert Keyboard().commands((), keys, SessionPhase.SAMPLING).buttons == (
        *(Button.SAMPLE, Button.STOP, Button.ABORT, Button.EMERGENCY, Button.RELEASE, Button.SAMPLE),
    )


# --- gamepad ---


def event(kind: int, number: int, value: int) -> bytes:
    return EVENT.pack(0, value, kind, number)


@pytest.fixture
def device(tmp_path: Path) -> Iterator[tuple[Path, Callable[[bytes], None], Callable[[], None]]]:
    """A pipe in place of a joystick device: its path, what writes to it, and what unplugs it."""
    path = tmp_path / "js0"
    os.mkfifo(path)
    plugged = [os.open(path, os.O_RDWR | os.O_NONBLOCK)]

    def unplug() -> None:
        os.close(plugged.pop())

    yield path, lambda data: os.write(plugged[0], data) and None, unplug
    if plugged:
        unplug()


def test_the_stick_leads_only_while_a_shoulder_button_is_held() -> None:
    pad = PadState()
    pad.take(event(AXIS, 1, -FULL) + event(AXIS, 0, FULL // 2))
    assert pad.twist is None
    pad.take(event(PRESS, 4, 1))
    assert pad.twist is not None
    assert pad.twist.linear == pytest.approx(SPEED)
    assert pad.twist.angular == pytest.approx(-TURN_RATE / 2, abs=0.01)
    pad.take(event(PRESS, 4, 0))
    assert pad.twist is None


def test_a_stick_near_its_middle_is_at_rest() -> None:
    pad = PadState()
    pad.take(event(PRESS, 5, 1) + event(AXIS, 1, -3000) + event(AXIS, 0, 3000))
    assert pad.twist == Twist()


def test_what_was_held_when_it_was_opened_was_not_pressed() -> None:
    pad = PadState()
    pad.take(event(PRESS | FIRST_STATE, 0, 1) + event(AXIS | FIRST_STATE, 1, FULL) + event(PRESS | FIRST_STATE, 4, 1))
    assert pad.buttons(SessionPhase.SAMPLING) == ()
    assert pad.twist == Twist(-SPEED, 0.0)


def test_buttons_of_the_pad() -> None:
    pad = PadState()
    pad.take(b"".join(event(PRESS, number, value) for number in (0, 7, 6, 2, 3, 9) for value in (1, 0)))
    wanted = (Button.SAMPLE, Button.PAUSE, Button.STOP, Button.EMERGENCY, Button.RELEASE)
    assert pad.buttons(SessionPhase.SAMPLING) == wanted
    assert pad.buttons(SessionPhase.SAMPLING) == ()


@given(st.binary(max_size=200).map(lambda data: data[: len(data) - len(data) % EVENT.size]))
def test_any_events_are_heard(data: bytes) -> None:
    pad = PadState()
    pad.take(data)
    assert pad.twist is None or (
        abs(pad.twist.linear) <= SPEED * 1.0001 and abs(pad.twist.angular) <= TURN_RATE * 1.0001
    )


def test_a_device_is_read_in_pieces_and_noticed_when_it_goes(
    device: tuple[Path, Callable[[bytes], None], Callable[[], None]],
) -> None:
    path, write, unplug = device
    with Gamepad(path) as gamepad:
        assert gamepad.read() is not None, "nothing was moved yet"
        whole = event(PRESS, 4, 1) + event(AXIS, 1, -FULL)
        write(whole[:11])
        pad = gamepad.read()
        assert pad is not None
        assert pad.twist == Twist(), "half an event is none"
        write(whole[11:])
        pad = gamepad.read()
        assert pad is not None
        assert pad.twist is not None
        assert pad.twist.linear == pytest.approx(SPEED)
        unplug()
        assert gamepad.read() is None
        assert gamepad.read() is None


def test_a_device_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(SimError, match=r"js9: cannot be opened: No such file or directory; valid is a joystick device"):
        Gamepad(tmp_path / "js9")


# --- pace ---


def test_time_is_held_back_and_never_hurried() -> None:
    now, slept = [100.0], list[float]()

    def sleep(seconds: float) -> None:
        slept.append(seconds)
        now[0] += seconds

    steady = RealTimePacer(2.0, lambda: now[0], sleep)
    steady.keep(0.0)
    for step in range(1, 6):
        steady.keep(0.04 * step)
    assert now[0] == pytest.approx(100.1)
    now[0] += 5.0  # a picture was drawn
    slept.clear()
    steady.keep(0.24)
    assert not slept
    steady.keep(0.28)
    steady.keep(0.32)
    assert slept == pytest.approx([0.02, 0.02])


@pytest.mark.parametrize("rate", [0.0, -1.0, math.inf, math.nan])
def test_a_pace_that_is_none_is_refused(rate: float) -> None:
    with pytest.raises(SimError, match=r"^rate .* is not valid"):
        RealTimePacer(rate)


# --- a viewer ---


class FakeViewer:
    """A viewer's handle: the viewer runs, unless it is told otherwise, and keeps what it is shown."""

    def __init__(self, keys: ViewerInput) -> None:
        self.keys, self.running, self.sent = keys, True, list[Any]()
        self.poses: list[float] = []
        self.hold: frozenset[str] | None = frozenset()

    def is_running(self) -> bool:
        return self.running

    def sync(self, model: Any, data: Any) -> Any:
        self.poses.append(float(data.qpos[0]))
        data.qpos[:] = 77.0  # whatever a viewer does to its world
        if self.hold is not None:
            self.keys.on_held(HeldSnapshot(self.hold, time.monotonic()))
        return model, data

    def send_to_viewer(self, message: Any) -> None:
        self.sent.append(message)


@pytest.fixture
def bench() -> Iterator[Bench]:
    with Bench(corridor(), robots.load("robuter"), seed=3, settings=CAMERALESS) as bench:
        yield bench


@pytest.fixture
def viewer() -> FakeViewer:
    return FakeViewer(ViewerInput())


def source_of(
    bench: Bench, viewer: FakeViewer, pad: Gamepad | None = None, desk: CaptureDesk | None = None
) -> ViewerSource:
    return ViewerSource(viewer, viewer.keys, WorldMirror(bench), RealTimePacer(1e6), pad, time.monotonic, desk)


def test_what_is_pressed_in_a_viewer_is_asked_for_once(bench: Bench, viewer: FakeViewer) -> None:
    viewer.hold = frozenset("W")
    viewer.keys.pressed = [GO_ON, "V"]
    source = source_of(bench, viewer)
    assert source.commands(SessionStatus()) == Commands(Twist(SPEED, 0.0), (Button.START, Button.SAMPLE))
    assert source.commands(SessionStatus(phase=SessionPhase.SAMPLING)) == Commands(Twist(SPEED, 0.0))


def test_a_viewer_that_tells_of_no_keys_is_one_without_a_hand(bench: Bench, viewer: FakeViewer) -> None:
    source = source_of(bench, viewer)
    viewer.hold = None
    viewer.keys.on_held(HeldSnapshot(frozenset("W"), time.monotonic() - 0.5 * DEADMAN))
    assert source.commands(SessionStatus()).twist == Twist(SPEED, 0.0)
    viewer.keys.on_held(HeldSnapshot(frozenset("W"), time.monotonic() - 1.5 * DEADMAN))
    assert source.commands(SessionStatus()).twist is None


def test_a_viewer_that_was_never_there_leads_nobody(bench: Bench, viewer: FakeViewer) -> None:
    viewer.hold = None
    assert source_of(bench, viewer).commands(SessionStatus()).twist is None


def test_the_page_around_the_viewer_leads_as_well(
    bench: Bench, viewer: FakeViewer, monkeypatch: pytest.MonkeyPatch
) -> None:
    desk = CaptureDesk()
    source = source_of(bench, viewer, desk=desk)
    viewer.hold = None
    desk.press({"held": ["A"], "pressed": [GO_ON, OTHER_LOOK]})
    assert source.commands(SessionStatus()) == Commands(Twist(0.0, TURN_RATE), (Button.START,))
    assert [type(one) for one in viewer.sent] == [LookEvent]
    began = time.monotonic()
    monkeypatch.setattr(time, "monotonic", lambda: began + 1.1 * DEADMAN)
    assert source.commands(SessionStatus()) == Commands(Twist()), "it is still there, and holds no key any more"
    monkeypatch.setattr(time, "monotonic", lambda: began + 1.1 * SILENT)
    assert source.commands(SessionStatus()).twist is None, "it is gone"
    desk.news()
    assert source.commands(SessionStatus()).twist == Twist(), "it asks for news, so that somebody looks on"


def test_a_viewer_that_is_closed_asks_for_stop(bench: Bench, viewer: FakeViewer) -> None:
    viewer.running = False
    assert source_of(bench, viewer).commands(SessionStatus()) == Commands(None, (Button.STOP,))


def test_a_viewer_cannot_move_the_robot_by_itself(bench: Bench, viewer: FakeViewer) -> None:
    """It has a world of its own: the drive is the same bit for bit as one without a viewer."""

    class Person:
        def __init__(self, inner: ViewerSource | None) -> None:
            self._inner = inner

        def commands(self, status: SessionStatus) -> Commands:
            if self._inner is not None:
                self._inner.commands(status)
            buttons = {0: (Button.START,), 30: (Button.SAMPLE,), 50: (Button.STOP,)}
            return Commands(Twist(0.3, 0.1), buttons.get(round(status.time / 0.04), ()))

    desk = CaptureDesk()
    seen = [one.view for one in run_session(bench, Person(source_of(bench, viewer, desk=desk)), None)]
    with Bench(corridor(), robots.load("robuter"), seed=3, settings=CAMERALESS) as alone:
        unseen = [one.view for one in run_session(alone, Person(None), None)]
    assert len(seen) == 2
    assert [view.truth for view in seen] == [view.truth for view in unseen]
    shown = desk.news()
    assert shown["status"]["phase"] == SessionPhase.STOPPED, "the end is shown whenever it comes"
    assert shown["pictures"] == ["laser"]
    assert 77.0 not in viewer.poses


def test_a_gamepad_leads_before_keys_and_its_loss_is_told(
    bench: Bench, viewer: FakeViewer, device: tuple[Path, Callable[[bytes], None], Callable[[], None]]
) -> None:
    path, write, unplug = device
    viewer.hold = frozenset("S")
    with Gamepad(path) as pad:
        desk = CaptureDesk()
        source = source_of(bench, viewer, pad, desk)
        assert source.commands(SessionStatus()).twist == Twist(-SPEED, 0.0)
        write(event(PRESS, 4, 1) + event(AXIS, 1, -FULL) + event(PRESS, 7, 1))
        commands = source.commands(SessionStatus())
        assert commands.twist is not None
        assert commands.twist.linear == pytest.approx(SPEED)
        assert commands.buttons == (Button.START,)
        unplug()
        source.commands(SessionStatus(phase=SessionPhase.STOPPED))
        assert desk.news()["status"]["warnings"] == [f"gamepad {path} is gone"]


def test_a_gamepad_that_is_asked_for_has_to_be_there(tmp_path: Path) -> None:
    look = ViewerSettings("x")
    with pytest.raises(SimError, match=r"^gamepad .*js7: cannot be opened"), capture_page(look, tmp_path / "js7"):
        pass


def test_the_copy_of_the_world_is_lit_and_has_its_roof_apart(bench: Bench) -> None:
    before = bench.model.light_intensity.copy(), bench.model.light_active.copy()
    mirror = WorldMirror(bench)
    image = bench.model.light_type == mujoco.mjtLightType.mjLIGHT_IMAGE
    assert image.any()
    assert ((mirror.model.light_active != 0) == image).all()
    assert (mirror.model.light_intensity[image] > 1000).all()
    assert (bench.model.light_intensity == before[0]).all()
    assert (bench.model.light_active == before[1]).all()
    roof = [geom for geom in range(bench.model.ngeom) if "ceiling" in bench.model.geom(geom).name]
    assert roof
    assert {int(group) for group in mirror.model.geom_group[roof]} == {1}
    assert 1 not in bench.model.geom_group
    where = float(mirror.data.qpos[0])
    for _ in range(30):
        bench.drive(Twist(0.4, 0.0))
    mirror.follow()
    assert mirror.data.qpos[0] > where + 0.1
    assert (mirror.data.qpos == bench.data.qpos).all()


def test_what_hangs_overhead_is_hidden_from_above_and_nothing_else() -> None:
    world = build_world(two_rooms(0), light_named("late-evening"), pictured=False)
    with Bench(world, robots.load("robuter"), settings=CAMERALESS) as bench:
        model = WorldMirror(bench).model
    names = {model.geom(geom).name for geom in np.flatnonzero(model.geom_group == ROOF_GROUP)}
    lamps = {"lamp:room:0", "lamp:beyond:0"}
    assert names == {"ceiling:0", "ceiling:0:slab", "door:door:room:ceiling", *lamps}


def test_a_scan_is_drawn_where_its_things_are() -> None:
    """Four metres ahead: half of the picture's height above the robot; to the left: to its left."""
    bearings = np.radians([0.0, 89.0])
    picture = scan_picture(Scan(np.array([4.0, 4.0]), float(bearings[0]), float(bearings[1] - bearings[0])))
    rows, columns = np.nonzero((picture == (86, 180, 233)).all(axis=2))
    assert sorted(zip(rows.tolist(), columns.tolist(), strict=True)) == [
        (SIZE // 2 - 1 - round(4 * SIZE / (2 * REACH)), SIZE // 2),
        (SIZE // 2 - 2, SIZE // 2 - round(4 * SIZE / (2 * REACH))),
    ]


def test_a_view_with_images_is_shown_by_them(bench: Bench) -> None:
    from dataclasses import replace

    view = replace(bench.sense(), images={"camera-1": np.full((480, 640), 9, np.uint8)})
    (picture,) = pictures_of(view)
    assert picture.name == "camera-1"
    assert picture.pixels.shape == (240, 320, 3)
    assert (picture.pixels == 9).all()
