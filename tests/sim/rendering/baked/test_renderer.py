"""The renderer that bakes, against laws of light and against what Filament draws."""

import mujoco
import numpy as np
import pytest

from refseq_bench.sim.rendering.baked.batch import Batch
from refseq_bench.sim.rendering.baked.renderer import into_camera, onto_picture, sides
from refseq_bench.sim.rendering.drivers import gl_backend, vulkan_device
from refseq_bench.sim.rendering.filament import prepare_spec
from refseq_bench.sim.rendering.frustum import frustum
from refseq_bench.sim.rendering.opening import open_renderer
from refseq_bench.sim.rendering.renderer import RendererKind
from tests.sim.rendering.test_renderers import ALBEDO, MATT, PAINT, SUN, card, centre

pytestmark = pytest.mark.skipif(gl_backend() is None, reason="no OpenGL on this machine")
SIZE = (160, 120)


def look(lights: str, more: str = "", emission: float = 0.0, finish: str = MATT) -> np.ndarray:
    model, data = card(lights, more, emission, finish)
    with open_renderer(RendererKind.BAKED, model) as renderer:
        return renderer.radiance(data, "down", *SIZE)


@pytest.mark.parametrize("angle", [0.0, 30.0, 60.0])
@pytest.mark.parametrize("shadow", ["true", "false"])
def test_a_matt_card_returns_albedo_times_illuminance_over_pi_by_the_cosine(angle: float, shadow: str) -> None:
    a = np.radians(angle)
    picture = look(SUN.format(dir=f"{np.sin(a)} 0 {-np.cos(a)}", shadow=shadow))
    np.testing.assert_allclose(picture, 1000 * np.cos(a) * ALBEDO / np.pi, rtol=1e-3)


def test_a_lamp_of_known_candela_follows_the_inverse_square() -> None:
    for height in (2.0, 4.0):  # light is known every 0.4 m, and varies linearly between
        lamp = f'<light type="point" pos="0 0 {height}" intensity="100" diffuse="1 1 1" range="50" castshadow="false"/>'
        assert centre(look(lamp)) == pytest.approx(100 / height**2 * ALBEDO / np.pi, rel=0.05)


@pytest.mark.parametrize(("finish", "share"), [(MATT, ALBEDO), (PAINT, 1.0)])
def test_emission_is_luminance(finish: str, share: float) -> None:
    np.testing.assert_allclose(look("", emission=500.0, finish=finish), 500 * share, rtol=1e-3)


def test_a_world_without_lamps_is_dark() -> None:
    assert look("").max() == 0.0


@pytest.mark.parametrize("joint", ["", "<freejoint/>"])
def test_a_box_throws_its_shadow_where_the_sun_puts_it_whether_it_moves_or_not(joint: str) -> None:
    box = f'<body pos="-0.5 0 0.8">{joint}<geom type="box" size="0.2 0.2 0.05" material="card"/></body>'
    picture = look(SUN.format(dir="1 0 -1", shadow="true"), box)
    lit = 1000 * np.cos(np.pi / 4) * ALBEDO / np.pi
    shadow = picture < lit / 2
    shadow[:, : SIZE[0] // 2] = False  # there the box shows its dark side
    rows, columns = np.nonzero(shadow)
    # The camera is 3 m up, 40° high: a pixel is 1.8 cm. The shadow of a box 0.8 m up falls 0.8 m beyond it.
    pixel = 2 * 3 * np.tan(np.radians(20)) / SIZE[1]
    middle = (columns.mean() + 0.5 - SIZE[0] / 2) * pixel, (rows.mean() + 0.5 - SIZE[1] / 2) * pixel
    assert middle == pytest.approx((0.3, 0.0), abs=1.5 * pixel)
    # From the box's upper edge behind to its lower one ahead: 0.4 m and its height.
    assert shadow.sum() * pixel**2 == pytest.approx(0.4 * 0.5, rel=0.1)


def test_a_moved_body_is_drawn_where_it_is_and_frames_repeat_in_any_order_of_sizes() -> None:
    box = '<body pos="-0.5 0 0.8"><freejoint/><geom type="box" size="0.2 0.2 0.05" material="card"/></body>'
    model, data = card(SUN.format(dir="0 0 -1", shadow="true"), box, emission=20.0)
    with open_renderer(RendererKind.BAKED, model) as renderer:
        first = renderer.radiance(data, "down", *SIZE)
        data.qpos[0] = 0.5
        mujoco.mj_forward(model, data)
        mirrored = renderer.radiance(data, "down", *SIZE)
        np.testing.assert_allclose(mirrored, first[:, ::-1], rtol=0.01)
        data.qpos[0] = -0.5
        mujoco.mj_forward(model, data)
        renderer.radiance(data, "down", 64, 48)
        np.testing.assert_array_equal(renderer.radiance(data, "down", *SIZE), first)


def test_what_lies_in_the_view_lies_within_its_sides() -> None:
    model, data = card("")
    seen = frustum(model, data, "down", 4 / 3)
    matrix = onto_picture(seen, 4 / 3) @ into_camera(seen)
    points = np.random.default_rng(1).uniform(-4, 4, (500, 3))
    mapped = np.column_stack([points, np.ones(500)]) @ matrix.T
    inside = (np.abs(mapped[:, :2]) <= mapped[:, 3:]).all(axis=1)
    planes = sides(matrix)
    np.testing.assert_array_equal((points @ planes[:, :3].T + planes[:, 3] >= 0.0).all(axis=1), inside)
    assert 20 < inside.sum() < 480


def test_what_is_left_out_would_not_have_been_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same pictures where all is drawn, from behind too: boxes all around, and long bowls of three sides.

    But for points on an edge, where front and back are equally near.
    """
    rng, spec = np.random.default_rng(5), mujoco.MjSpec()
    bowl = spec.add_mesh(name="bowl", inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL)
    bowl.uservert = (0.4 * np.array([[0, 0, 0], [1, 0, 0.5], [0, 1, 0.5], [-3, -3, 1.5]])).ravel()
    bowl.userface = [0, 2, 1, 0, 3, 2, 0, 1, 3]
    for number in range(60):
        way, grey = rng.normal(size=3), rng.uniform(0.2, 1.0)
        shape = {"type": mujoco.mjtGeom.mjGEOM_BOX, "size": rng.uniform(0.05, 0.4, 3)}
        if number % 2:
            shape = {"type": mujoco.mjtGeom.mjGEOM_MESH, "meshname": "bowl"}
        place = rng.uniform(1.2, 4.0) * way / np.linalg.norm(way)
        spec.worldbody.add_geom(pos=place, quat=rng.normal(size=4), rgba=[grey, grey, grey, 1.0], **shape)
    for number in range(8):
        spec.worldbody.add_camera(name=f"eye-{number}", quat=rng.normal(size=4), fovy=50)
    spec.worldbody.add_light(type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL, dir=[0.3, 0.2, -1.0], intensity=1000.0)
    spec.worldbody.add_light(type=mujoco.mjtLightType.mjLIGHT_POINT, intensity=100.0, range=50.0)
    prepare_spec(spec)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    with open_renderer(RendererKind.BAKED, model) as renderer:
        drawn = [renderer.radiance(data, f"eye-{number}", *SIZE) for number in range(8)]
        monkeypatch.setattr(Batch, "in_sight", lambda batch, planes, eye: batch.all)
        monkeypatch.setattr(Batch, "_cull", lambda batch, closed: None)
        for number, picture in enumerate(drawn):
            assert np.sum(renderer.radiance(data, f"eye-{number}", *SIZE) != picture) <= 20
    assert min(len(np.unique(picture)) for picture in drawn) > 10


@pytest.mark.quick_cases("repeat0--y", "repeat0-+y", "repeat1-+x", "repeat1--z")
@pytest.mark.skipif(vulkan_device() is None, reason="no Vulkan device on this machine")
@pytest.mark.parametrize("eye", ["+x", "-x", "+y", "-y", "+z", "-z"])
@pytest.mark.parametrize("repeat", [(1.0, 1.0), (2.0, 3.0)])
def test_pictures_lie_on_boxes_and_meshes_as_filament_lays_them(eye: str, repeat: tuple[float, float]) -> None:
    model, data = pictured(eye, repeat)
    drawn = []
    for kind in (RendererKind.BAKED, RendererKind.FILAMENT):
        with open_renderer(kind, model) as renderer:
            drawn.append(renderer.radiance(data, "eye", *SIZE))
    ours, theirs = drawn
    # Edges are drawn by several points a pixel here, by one there.
    alike = np.abs(ours - theirs) < 0.06
    assert alike.mean() > 0.97
    assert theirs.std() > 0.1


def pictured(eye: str, repeat: tuple[float, float]) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """A box that glows with a picture unlike in all directions, seen from one side."""
    spec = mujoco.MjSpec()
    x, y = np.meshgrid(np.linspace(0, 1, 64), np.linspace(0, 1, 64))
    texture = spec.add_texture(name="t", type=mujoco.mjtTexture.mjTEXTURE_2D, width=64, height=64, nchannel=3)
    texture.colorspace = mujoco.mjtColorSpace.mjCOLORSPACE_SRGB
    texture.data = np.repeat((40 + 90 * x + 120 * (y > 0.5)).astype(np.uint8), 3).tobytes()
    roles = [""] * int(mujoco.mjtTextureRole.mjNTEXROLE)
    for role in (mujoco.mjtTextureRole.mjTEXROLE_RGB, mujoco.mjtTextureRole.mjTEXROLE_EMISSIVE):
        roles[int(role)] = "t"
    finish = {"roughness": 1.0, "metallic": 0.0, "specular": 0.0, "emission": 1.0}
    spec.add_material(name="m", textures=roles, texrepeat=repeat, **finish)
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.5, 1.0, 0.4], material="m")
    axis, sign = "xyz".index(eye[1]), 1.0 if eye[0] == "+" else -1.0
    back = sign * np.eye(3)[axis]
    up = np.array([0.0, 0.0, 1.0]) if axis < 2 else np.array([0.0, 1.0, 0.0])
    spec.worldbody.add_camera(name="eye", pos=3 * back, xyaxes=[*np.cross(up, back), *up], fovy=40)
    prepare_spec(spec)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data
