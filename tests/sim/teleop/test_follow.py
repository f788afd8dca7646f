"""The view that follows the robot, with a viewer and keys that stand in for MuJoCo Studio's."""

import math
from types import SimpleNamespace

import mujoco
import pytest
from mujoco.studio import messages

from refseq_bench.sim.teleop import follow
from refseq_bench.sim.teleop.follow import (
    CLEAR,
    NEAREST,
    FollowingView,
    HeldSnapshot,
    LookEvent,
    PressedEvent,
    RobotSnapshot,
    ViewerInput,
)
from refseq_bench.sim.teleop.keys import GO_ON, OTHER_LOOK
from refseq_bench.sim.teleop.mirror import ROOF_GROUP

WORLD = """
<mujoco>
  <worldbody>
    <geom name="wall" type="box" size="0.1 5 5" pos="{wall} 0 0"/>
    <geom name="floor" type="box" size="5 5 0.1" pos="0 0 -0.1"/>
    <geom name="roof" type="box" size="5 5 0.1" pos="0 0 {roof}" group="1"/>
    <body name="robot" pos="0 0 0" euler="0 0 {heading}"><geom size="0.1"/><camera name="ahead"/></body>
  </worldbody>
</mujoco>
"""


class Hands:
    """Keys and mouse: what is held, pressed at this moment, dragged [pixels] and wheeled."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.held: set[str] = set()
        self.pressed: set[str] = set()
        self.drag: tuple[float, float] | None = None
        self.wheel, self.elsewhere = 0.0, False
        monkeypatch.setattr(follow.imgui, "IsKeyDown", lambda key: key.name in self.held)
        monkeypatch.setattr(follow.imgui, "IsKeyPressed", lambda key, _: key.name in self.pressed)
        monkeypatch.setattr(follow.imgui, "IsMouseDragging", lambda _: self.drag is not None)
        monkeypatch.setattr(follow.imgui, "GetIO", self.io)

    def io(self) -> SimpleNamespace:
        x, y = self.drag or (0.0, 0.0)
        return SimpleNamespace(
            WantCaptureMouse=self.elsewhere, MouseDelta=SimpleNamespace(x=x, y=y), MouseWheel=self.wheel
        )


class Viewer:
    """The ray that the view asks for, over a wall ``wall`` metres along x and a robot that heads so [°].

    A roof hangs ``roof`` metres high.
    """

    def __init__(self, wall: float = -20.0, heading: float = 0.0, roof: float = 20.0) -> None:
        self.model = mujoco.MjModel.from_xml_string(WORLD.format(wall=wall, heading=heading, roof=roof))
        self.data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, self.data)
        self.camera, self.vis_options = mujoco.MjvCamera(), mujoco.MjvOption()
        self.sent: list[object] = []

    def send_to_sim(self, message: object) -> None:
        self.sent.append(message)


@pytest.fixture
def hands(monkeypatch: pytest.MonkeyPatch) -> Hands:
    return Hands(monkeypatch)


def following(viewer: Viewer, robot: str = "robot") -> FollowingView:
    view = FollowingView()
    view.viewer = viewer
    view.on_robot(RobotSnapshot(robot, ("ahead",)))
    return view


def update(view: FollowingView) -> None:
    view.on_update(messages.UpdateEvent())


def test_it_stands_behind_the_robot_and_looks_where_that_heads(hands: Hands) -> None:
    viewer = Viewer(heading=90.0)
    update(following(viewer))
    assert viewer.camera.azimuth == pytest.approx(90.0)
    assert viewer.camera.lookat == pytest.approx([0.0, 0.0, 0.8])
    assert viewer.camera.distance == pytest.approx(3.4)


def test_it_stays_on_the_robot_s_side_of_a_wall(hands: Hands) -> None:
    viewer = Viewer(wall=-2.1)
    update(following(viewer))
    along = 2.0 / math.cos(math.radians(viewer.camera.elevation))
    assert viewer.camera.distance == pytest.approx(along - CLEAR, abs=1e-6)
    close = Viewer(wall=-0.3)
    update(following(close))
    assert close.camera.distance == NEAREST


def test_it_stays_under_a_roof_and_does_not_mind_the_floor(hands: Hands) -> None:
    """It looks at the robot 0.8 m above the floor, from above."""
    viewer = Viewer(roof=1.5)
    update(following(viewer))
    along = (1.5 - 0.1 - 0.8) / math.sin(math.radians(-viewer.camera.elevation))
    assert viewer.camera.distance == pytest.approx(along - CLEAR, abs=1e-6)


def test_looks_take_turns_and_only_from_above_the_roof_is_off(hands: Hands) -> None:
    viewer = Viewer()
    view = following(viewer)
    update(view)
    assert viewer.vis_options.geomgroup[ROOF_GROUP] == 1
    view.on_look(LookEvent())
    update(view)
    assert viewer.vis_options.geomgroup[ROOF_GROUP] == 0
    assert (viewer.camera.elevation, viewer.camera.distance) == (-80.0, 11.0)
    hands.pressed = {OTHER_LOOK}
    update(view)
    assert viewer.camera.type == mujoco.mjtCamera.mjCAMERA_FIXED
    assert viewer.camera.fixedcamid == viewer.model.camera("ahead").id
    update(view)
    assert viewer.camera.type == mujoco.mjtCamera.mjCAMERA_FREE


def test_dragging_turns_within_bounds_and_the_wheel_goes_nearer(hands: Hands) -> None:
    viewer = Viewer()
    view = following(viewer)
    hands.drag, hands.wheel = (-100.0, 1000.0), 5.0
    update(view)
    assert viewer.camera.azimuth == pytest.approx(30.0)
    assert viewer.camera.elevation == pytest.approx(-84.0)
    assert viewer.camera.distance < 3.4
    before = viewer.camera.azimuth, viewer.camera.elevation
    hands.elsewhere = True  # over the page around the view
    update(view)
    assert (viewer.camera.azimuth, viewer.camera.elevation) == pytest.approx(before)


def test_keys_reach_the_bench(hands: Hands) -> None:
    viewer, bench = Viewer(), ViewerInput()
    hands.held, hands.pressed = {"W"}, {GO_ON}
    update(following(viewer))
    for message in viewer.sent:
        bench.on_held(message) if isinstance(message, HeldSnapshot) else bench.on_pressed(message)
    assert bench.held.keys == {"W"}
    assert bench.pressed == [GO_ON]
    assert sum(isinstance(message, PressedEvent) for message in viewer.sent) == 1


def test_before_the_world_is_there_it_follows_nobody(hands: Hands) -> None:
    viewer = Viewer()
    before = viewer.camera.distance
    update(following(viewer, robot="nobody"))
    assert viewer.camera.distance == before
