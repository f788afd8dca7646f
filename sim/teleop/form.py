"""The thesis' familiarisation form (5.3.1) over a view of the world, and its messages to and from the bench.

Both are plug-ins of MuJoCo Studio: the ``TeleopForm`` runs in the viewer's thread, the ``ViewerInput`` in the bench's.
"""

import math
import time
from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco.studio import messages, plugin, ux
from mujoco.studio.dear_imgui import dear_imgui as imgui

from refseq_bench.sim.teleop.commands import Button, SessionPhase, SessionStatus
from refseq_bench.sim.teleop.gamepad import LEGEND as PAD_LEGEND
from refseq_bench.sim.teleop.keys import FASTER, GO_ON, GOES_ON, HELD, LEGEND, OTHER_LOOK, PRESSED, SLOWER
from refseq_bench.sim.teleop.mirror import ROOF_GROUP
from refseq_bench.sim.teleop.pictures import Picture

BUTTONS = {button: key for key, button in PRESSED.items()}
COLOURS = {
    SessionPhase.READY: (0.90, 0.62, 0.00, 1.0),
    SessionPhase.SAMPLING: (0.00, 0.72, 0.52, 1.0),
    SessionPhase.PAUSED: (0.34, 0.71, 0.91, 1.0),
    SessionPhase.STOPPED: (0.80, 0.47, 0.65, 1.0),
    SessionPhase.ABORTED: (0.84, 0.37, 0.00, 1.0),
}
"""After Okabe and Ito."""
ALARM = (0.94, 0.45, 0.10, 1.0)
WIDTH = 348.0
"""Width of the form [px]."""
WALLS = np.array([1, 1, 0, 0, 0, 0], np.uint8)
"""Groups of geoms that block the view from behind: what is solid in the world, and its roof."""
CLEAR, NEAREST = 0.15, 0.8
"""Distances of the camera: to a wall behind it, and at least to the robot [m]."""
ASIDE = 0.5
"""The camera looks so far to the robot's left [m], where the form hides nothing."""
FLAGS = sum(
    int(flag)
    for flag in (
        imgui.WindowFlags.NoNav,  # keys lead the robot, not the form
        imgui.WindowFlags.NoTitleBar,  # with a cross that would close the form alone
        imgui.WindowFlags.AlwaysAutoResize,
        imgui.WindowFlags.NoSavedSettings,
    )
)


@dataclass(frozen=True)
class HeldSnapshot(messages.Snapshot):  # type: ignore[misc]
    """The keys that are held, and when that was, by this machine's clock [s]."""

    keys: frozenset[str]
    at: float


@dataclass(frozen=True)
class PressedEvent(messages.Event):  # type: ignore[misc]
    """A key, or a button of the form, that was pressed."""

    key: str


@dataclass(frozen=True)
class StatusSnapshot(messages.Snapshot):  # type: ignore[misc]
    """The status, the keys' speed [m/s], and pictures of the last view."""

    status: SessionStatus
    speed: float
    pictures: tuple[Picture, ...]


@dataclass(frozen=True, slots=True)
class Heading:
    """The form's fixed lines: the session's name, when views are taken, sensors, gamepad."""

    name: str
    sampling: str
    sensors: str
    pad: str | None


class ViewerInput(plugin.SimPlugin):  # type: ignore[misc]
    """Keeps the keys that the viewer reports."""

    def __init__(self) -> None:
        self.held = HeldSnapshot(frozenset(), -math.inf)
        self.pressed: list[str] = []

    @messages.handler  # type: ignore[untyped-decorator]
    def on_held(self, message: HeldSnapshot) -> None:
        """Keep the newest."""
        self.held = message

    @messages.handler  # type: ignore[untyped-decorator]
    def on_pressed(self, message: PressedEvent) -> None:
        """Keep each."""
        self.pressed.append(message.key)


class TeleopForm(plugin.ViewerPlugin):  # type: ignore[misc]
    """Follows the robot, reports keys, and shows the form. ``robot`` names its base, ``cameras`` are its own."""

    def __init__(self, heading: Heading, robot: str, cameras: tuple[str, ...]) -> None:
        self._heading, self._robot = heading, robot
        self._looks = ("behind", "above", *cameras)
        self._look = 0
        self._shown = StatusSnapshot(SessionStatus(), 0.0, ())
        self._textures: list[tuple[Picture, int]] = []
        self._turned, self._raised, self._away = 0.0, 0.0, 1.0

    @messages.handler  # type: ignore[untyped-decorator]
    def on_status(self, message: StatusSnapshot) -> None:
        """Keep the newest."""
        self._shown = message

    @messages.handler  # type: ignore[untyped-decorator]
    def on_update(self, _: messages.UpdateEvent) -> None:
        """Report the keys, follow the robot, and upload new pictures."""
        self._report_keys()
        if imgui.IsKeyPressed(_key(OTHER_LOOK), False):
            self._look = (self._look + 1) % len(self._looks)
        if mujoco.mj_name2id(self.viewer.model, mujoco.mjtObj.mjOBJ_BODY, self._robot) >= 0:  # not yet at first
            self._follow()
        if tuple(picture for picture, _ in self._textures) != self._shown.pictures:
            self._upload()

    def _report_keys(self) -> None:
        held = frozenset(name for name in HELD if imgui.IsKeyDown(_key(name)))
        self.viewer.send_to_sim(HeldSnapshot(held, time.monotonic()))
        for name in (GO_ON, FASTER, SLOWER, *PRESSED):
            if imgui.IsKeyPressed(_key(name), False):
                self._press(name)

    def _press(self, key: str) -> None:
        self.viewer.send_to_sim(PressedEvent(key))

    def _follow(self) -> None:
        """ViewerSettings at the robot: from behind it, from above, or through one of its cameras."""
        camera, model, look = self.viewer.camera, self.viewer.model, self._looks[self._look]
        self.viewer.vis_options.geomgroup[ROOF_GROUP] = look != "above"
        if look not in ("behind", "above"):
            camera.type, camera.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, model.camera(look).id
            return
        self._orbit()
        body = self.viewer.data.body(self._robot)
        heading = math.atan2(body.xmat[3], body.xmat[0])
        camera.type = mujoco.mjtCamera.mjCAMERA_FREE
        aside = ASIDE if look == "behind" else 0.0
        left = heading + math.pi / 2
        camera.lookat[:] = (body.xpos[0] + aside * math.cos(left), body.xpos[1] + aside * math.sin(left), 0.8)
        camera.azimuth = math.degrees(heading) + self._turned
        camera.elevation = -80.0 if look == "above" else -14.0 + self._raised
        camera.distance = self._away * (11.0 if look == "above" else 3.4)
        if look == "behind":
            camera.distance = min(camera.distance, self._free_distance(camera))

    def _free_distance(self, camera: mujoco.MjvCamera) -> float:
        """Free distance behind the robot before a wall or ceiling [m]."""
        azimuth, elevation = math.radians(camera.azimuth), math.radians(camera.elevation)
        level = -math.cos(elevation)
        way = np.array([level * math.cos(azimuth), level * math.sin(azimuth), -math.sin(elevation)])
        begin, geom = np.array(camera.lookat, float), np.zeros(1, np.int32)
        distance = mujoco.mj_ray(self.viewer.model, self.viewer.data, begin, way, WALLS, 1, -1, geom)
        return max(distance - CLEAR, NEAREST) if distance >= 0 else math.inf

    def _orbit(self) -> None:
        """Orbit by dragging, zoom by the wheel."""
        io = imgui.GetIO()
        if io.WantCaptureMouse:
            return
        if imgui.IsMouseDragging(int(imgui.MouseButton.Left)):
            self._turned -= 0.3 * io.MouseDelta.x
            self._raised = min(max(self._raised - 0.3 * io.MouseDelta.y, -70.0), 10.0)
        self._away = min(max(self._away * math.exp(-0.1 * io.MouseWheel), 0.3), 4.0)

    def _upload(self) -> None:
        before = {picture.name: texture for picture, texture in self._textures}
        self._textures = []
        for picture in self._shown.pictures:
            height, width = picture.pixels.shape[:2]
            texture = self.viewer.upload_image(before.get(picture.name, 0), picture.pixels.tobytes(), width, height, 3)
            self._textures.append((picture, texture))

    @messages.handler  # type: ignore[untyped-decorator]
    def on_build_gui(self, _: messages.BuildGuiEvent) -> None:
        """Build the form."""
        ux.setup_theme(ux.GuiTheme.DARK)
        imgui.SetNextWindowPos(imgui.Vec2(12, 12), int(imgui.Cond.FirstUseEver))
        imgui.SetNextWindowSize(imgui.Vec2(WIDTH, 0))
        if imgui.Begin("Familiarisation", flags=FLAGS)[0]:
            self._build_state()
            self._build_buttons()
            self._build_figures()
            self._build_pictures()
            self._build_keys()
        imgui.End()

    def _build_state(self) -> None:
        status = self._shown.status
        imgui.TextColored(imgui.Vec4(*COLOURS[status.phase]), f"{status.phase.upper()}   {self._heading.name}")
        for stop in status.stops:
            _wrapped(f"stopped: {stop.cause.value}: {stop.detail}", ALARM)
        if status.note:
            _wrapped(status.note, ALARM)
        imgui.Separator()

    def _build_buttons(self) -> None:
        phase = self._shown.status.phase
        going = GOES_ON.get(phase)
        pressed = [
            *([(str(going).capitalize(), GO_ON)] if going else []),
            *[(str(button).capitalize(), BUTTONS[button]) for button in (Button.SAMPLE, Button.STOP, Button.ABORT)],
        ]
        for number, (label, key) in enumerate(pressed):
            if number:
                imgui.SameLine()
            if imgui.Button(label):
                self._press(key)

    def _build_figures(self) -> None:
        shown = self._shown
        status, moved = shown.status, shown.status.moved
        rows = (
            ("Views", f"{status.count}"),
            ("Last view", _last(status)),
            ("Since then", f"{moved.distance:.2f} m, {math.degrees(moved.turn):.0f}°, {moved.time:.1f} s"),
            ("Rate", f"{status.rate:.1f} a minute" if status.count > 1 else "–"),
            ("Sampling", self._heading.sampling),
            ("Sensors", self._heading.sensors),
            ("Time, way", f"{status.time:.1f} s, {status.travelled:.1f} m"),
            ("Speed", f"{status.twist.linear:.2f} m/s of {shown.speed:.2f}, {status.twist.angular:.2f} rad/s"),
        )
        _table("figures", rows)

    def _build_pictures(self) -> None:
        for number, (picture, texture) in enumerate(self._textures):
            height, width = picture.pixels.shape[:2]
            share = (WIDTH - 24) / (2 if len(self._textures) > 1 else 1)
            if number % 2:
                imgui.SameLine()
            imgui.Image(texture, imgui.Vec2(share - 4, (share - 4) * height / width))

    def _build_keys(self) -> None:
        if imgui.CollapsingHeader("Keys", int(imgui.TreeNodeFlags.DefaultOpen)):
            _table("keys", (*LEGEND, *((("Gamepad", PAD_LEGEND),) if self._heading.pad else ())))


def _last(status: SessionStatus) -> str:
    return "none" if status.view is None else f"at {status.view.time:.1f} s"


def _table(name: str, rows: tuple[tuple[str, str], ...]) -> None:
    if not imgui.BeginTable(name, 2):
        return
    imgui.TableSetupColumn("what", int(imgui.TableColumnFlags.WidthFixed), 84.0)
    imgui.TableSetupColumn("value", int(imgui.TableColumnFlags.WidthStretch))
    for what, value in rows:
        imgui.TableNextRow()
        imgui.TableNextColumn()
        imgui.TextDisabled(what)
        imgui.TableNextColumn()
        imgui.TextWrapped(value)
    imgui.EndTable()


def _wrapped(text: str, colour: tuple[float, float, float, float]) -> None:
    imgui.PushStyleColor(int(imgui.Col.Text), imgui.Vec4(*colour))
    imgui.TextWrapped(text)
    imgui.PopStyleColor()


def _key(name: str) -> imgui.Key:
    return getattr(imgui.Key, name)
