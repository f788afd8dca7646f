import itertools
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import mujoco
import numpy as np
import pytest

from refseq_bench.sim.errors import RendererError, SimError
from refseq_bench.sim.rendering.drivers import gl_backend, gl_device, vulkan_device, vulkan_driver
from refseq_bench.sim.rendering.filament import FilamentRenderer, prepare_spec, split_lights
from refseq_bench.sim.rendering.frustum import CLIP_NEAR, eye_of, farthest, frustum
from refseq_bench.sim.rendering.opening import open_renderer
from refseq_bench.sim.rendering.renderer import Renderer, RendererKind, others_than

ROOT = Path(__file__).parents[3]
GREY = 0.5
ALBEDO = ((GREY + 0.055) / 1.055) ** 2.4  # rgba is encoded as sRGB (IEC 61966-2-1)
MATT = 'specular="0" shininess="0"'
PAINT = 'roughness="1" metallic="0" specular="0"'
SUN = '<light type="directional" dir="{dir}" intensity="1000" diffuse="1 1 1" castshadow="{shadow}"/>'

needs_vulkan = pytest.mark.skipif(vulkan_device() is None, reason="no Vulkan device on this machine")
needs_gl = pytest.mark.skipif(gl_backend() is None, reason="no EGL or OSMesa on this machine")


def card(
    lights: str, more: str = "", emission: float = 0.0, finish: str = MATT
) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """A matt grey card seen from above, (model, data)."""
    spec = mujoco.MjSpec.from_string(f"""
        <mujoco>
          <asset>
            <material name="card" rgba="{GREY} {GREY} {GREY} 1" {finish} emission="{emission}"/>
          </asset>
          <worldbody>
            <geom type="box" size="20 20 0.1" pos="0 0 -0.1" material="card"/>
            {lights} {more}
            <camera name="down" pos="0 0 3" fovy="40"/>
          </worldbody>
        </mujoco>""")
    prepare_spec(spec)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def look(lights: str, more: str = "", emission: float = 0.0, finish: str = MATT) -> np.ndarray:
    model, data = card(lights, more, emission, finish)
    with open_renderer(RendererKind.FILAMENT, model) as renderer:
        return renderer.radiance(data, "down", 160, 120)


def centre(picture: np.ndarray) -> float:
    height, width = picture.shape
    return float(picture[height // 2 - 3 : height // 2 + 3, width // 2 - 3 : width // 2 + 3].mean())


@needs_vulkan
@pytest.mark.parametrize("angle", [0.0, 30.0, 60.0])
def test_a_matt_card_returns_albedo_times_illuminance_over_pi_by_the_cosine(angle: float) -> None:
    a = np.radians(angle)
    picture = look(SUN.format(dir=f"{np.sin(a)} 0 {-np.cos(a)}", shadow="false"))
    assert centre(picture) == pytest.approx(1000 * np.cos(a) * ALBEDO / np.pi, rel=0.005)


@needs_vulkan
def test_a_painted_card_adds_the_gloss_of_its_surface() -> None:
    # A dielectric mirrors 4 % at normal incidence; spread by a rough surface, about a quarter of that comes back up.
    excess = centre(look(SUN.format(dir="0 0 -1", shadow="false"), finish=PAINT)) - 1000 * ALBEDO / np.pi
    assert 0.005 < excess / (1000 / np.pi) < 0.02


@needs_vulkan
def test_a_lamp_of_known_candela_follows_the_inverse_square() -> None:
    for height in (1.0, 2.0):
        lamp = f'<light type="point" pos="0 0 {height}" intensity="100" diffuse="1 1 1" range="50" castshadow="false"/>'
        assert centre(look(lamp)) == pytest.approx(100 / height**2 * ALBEDO / np.pi, rel=0.01)


@needs_vulkan
def test_light_adds_up_and_doubles_with_the_lamps() -> None:
    sun = SUN.format(dir="0 0 -1", shadow="false")
    lamp = '<light type="point" pos="0 0 2" intensity="800" diffuse="1 1 1" range="50" castshadow="false"/>'
    assert centre(look(sun + lamp)) == pytest.approx(centre(look(sun)) + centre(look(lamp)), rel=0.01)


@needs_vulkan
def test_light_from_all_sides_gives_what_is_asked_for() -> None:
    spec = mujoco.MjSpec()
    spec.add_material(name="card", rgba=[GREY, GREY, GREY, 1.0], specular=0.0)
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[20, 20, 0.1], material="card")
    spec.worldbody.add_camera(name="down", pos=[0, 0, 3])
    even = spec.add_texture(name="even", type=mujoco.mjtTexture.mjTEXTURE_CUBE, width=16, height=96, nchannel=3)
    even.data = np.full((96, 16, 3), 255, np.uint8).tobytes()
    spec.worldbody.add_light(type=mujoco.mjtLightType.mjLIGHT_IMAGE, texture="even", intensity=1.0, diffuse=[0] * 3)
    sun = {"dir": [0, 0, -1], "intensity": 1000.0, "diffuse": [1] * 3, "castshadow": False}
    spec.worldbody.add_light(type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL, **sun)  # which stays as it is
    prepare_spec(spec)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    with open_renderer(RendererKind.FILAMENT, model) as renderer:
        for lux in (50.0, 400.0):
            renderer.light_around(partial(float, lux))
            lit = (lux + 1000.0) * ALBEDO / np.pi
            assert centre(renderer.radiance(data, "down", 160, 120)) == pytest.approx(
                lit, abs=0.02 * lux * ALBEDO / np.pi
            )
    assert model.light_intensity.tolist() == [1.0, 1000.0]


@needs_vulkan
def test_a_world_without_lamps_is_dark() -> None:
    assert look("").max() == 0.0


@needs_vulkan
@pytest.mark.parametrize(("finish", "share"), [(MATT, ALBEDO), (PAINT, 1.0)])
def test_emission_is_luminance(finish: str, share: float) -> None:
    assert centre(look("", emission=500.0, finish=finish)) == pytest.approx(500 * share, rel=0.01)


def shadowed_scene() -> tuple[mujoco.MjModel, mujoco.MjData]:
    """A sun with shadow, a lamp without, a card that glows and a box on a stick, off the card's middle."""
    lamp = '<light type="point" pos="0.5 0 2" intensity="300" diffuse="1 1 1" range="50" castshadow="false"/>'
    box = '<body pos="-0.5 0 0.8"><freejoint/><geom type="box" size="0.2 0.2 0.05" material="card"/></body>'
    return card(SUN.format(dir="1 0 -1", shadow="true") + lamp, box, emission=20.0)


@needs_vulkan
def test_drawing_lights_apart_gives_what_drawing_them_together_gives(monkeypatch: pytest.MonkeyPatch) -> None:
    model, data = shadowed_scene()
    together = split_lights(model)
    monkeypatch.setattr("refseq_bench.sim.rendering.filament.MANY_LAMPS", 1)
    assert [len(together), len(split_lights(model))] == [1, 2]
    with open_renderer("filament", model) as renderer:
        apart = renderer.radiance(data, "down", 320, 240)
    monkeypatch.setattr("refseq_bench.sim.rendering.filament.split_lights", lambda _: together)
    with open_renderer("filament", model) as renderer:
        assert renderer.radiance(data, "down", 320, 240) == pytest.approx(apart, rel=0.01)
    dark = 1000 / np.sqrt(2) * ALBEDO / np.pi
    assert apart[120, 160 - 60 : 160 + 60].max() - apart[120, 160 - 60 : 160 + 60].min() > 0.8 * dark


@needs_vulkan
def test_the_sky_is_as_bright_by_two_passes_as_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    spec = mujoco.MjSpec()
    sky = spec.add_texture(name="sky", type=mujoco.mjtTexture.mjTEXTURE_SKYBOX, width=16, height=96, nchannel=3)
    sky.data = np.full((96, 16, 3), 255, np.uint8).tobytes()
    spec.worldbody.add_camera(name="eye")
    for shadow in (True, False):
        spec.worldbody.add_light(intensity=1.0, castshadow=shadow)
    prepare_spec(spec)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    drawn = []
    for passes, many in ((1, 30), (2, 1)):
        monkeypatch.setattr("refseq_bench.sim.rendering.filament.MANY_LAMPS", many)
        assert len(split_lights(model)) == passes
        with open_renderer("filament", model) as renderer:
            drawn.append(renderer.radiance(data, "eye", 32, 24))
    assert drawn[0].min() > 0.0
    np.testing.assert_allclose(drawn[1], drawn[0], rtol=1e-5)


@pytest.mark.quick_cases("1")
@needs_vulkan
@pytest.mark.parametrize("many", [1, 30])
def test_frames_repeat_bit_by_bit_in_any_order_of_sizes(many: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("refseq_bench.sim.rendering.filament.MANY_LAMPS", many)
    model, data = shadowed_scene()
    with open_renderer("filament", model) as renderer, open_renderer("filament", model) as second:
        first = renderer.radiance(data, "down")
        small = renderer.radiance(data, "down", 64, 48)
        assert np.array_equal(renderer.radiance(data, "down"), first)
        assert np.array_equal(renderer.radiance(data, "down", 64, 48), small)
        assert np.array_equal(second.radiance(data, "down"), first)
    assert first.shape == (480, 640)
    assert small.mean() == pytest.approx(first.mean(), rel=0.02)


@needs_vulkan
def test_what_is_equally_near_looks_alike_in_every_context() -> None:
    spec = mujoco.MjSpec()
    for number in range(48):  # twelve piles of four boxes in the same place
        spec.add_material(name=f"glow-{number}", rgba=[1, 1, 1, 1], emission=number + 1.0)
        place = [0.4 * (number % 12 % 4) - 0.6, 0.4 * (number % 12 // 4) - 0.4, 0.0]
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.1] * 3, pos=place, material=f"glow-{number}")
    spec.worldbody.add_camera(name="down", pos=[0, 0, 3], fovy=40)
    prepare_spec(spec)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    pictures = []
    for _ in range(6):
        with open_renderer("filament", model) as renderer:
            pictures.append(renderer.radiance(data, "down", 64, 48))
    assert len(np.unique(pictures[0])) == 13  # a box of each pile, and the dark between them
    assert all(np.array_equal(picture, pictures[0]) for picture in pictures[1:])


@needs_vulkan
def test_a_moved_body_is_drawn_where_it_is_and_the_model_stays_as_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("refseq_bench.sim.rendering.filament.MANY_LAMPS", 1)
    model, data = shadowed_scene()
    emission = model.mat_emission.copy()
    with open_renderer("filament", model) as renderer:
        before = renderer.radiance(data, "down", 160, 120)
        data.qpos[0] += 0.5
        mujoco.mj_forward(model, data)
        after = renderer.radiance(data, "down", 160, 120)
    assert np.abs(after - before).max() > 10
    assert np.array_equal(model.mat_emission, emission)


@needs_vulkan
def test_the_far_plane_comes_close_to_a_near_wall_but_never_cuts_off_a_deep_picture() -> None:
    near, deep = (card("", more=f'<geom type="box" size="9 9 .1" pos="0 0 {z}"/>') for z in (1.5, 40.0))
    assert farthest(*near, mujoco_camera(*near)) == pytest.approx(1.4, abs=0.01)  # the box's top, 1.4 m below
    assert frustum(*near, "down").frustum_far == pytest.approx(4.8, abs=0.05)
    model, data = deep
    model.cam_quat[0] = (0, 1, 0, 0)  # looks up, at a lid 37 m away
    mujoco.mj_forward(model, data)
    assert frustum(model, data, "down").frustum_far == mujoco_camera(model, data).frustum_far


def test_the_far_plane_looks_at_the_whole_picture_not_at_its_middle() -> None:
    # A lid 3 m above the camera fills all but the right quarter of the picture; past its edge one is 37 m up.
    lids = '<geom type="box" size="9 9 .1" pos="-8.3 0 6.1"/> <geom type="box" size="99 99 .1" pos="0 0 40.1"/>'
    model, data = card("", more=lids)
    model.cam_quat[0] = (0, 1, 0, 0)
    mujoco.mj_forward(model, data)
    assert farthest(model, data, mujoco_camera(model, data)) == pytest.approx(37.0, abs=0.01)
    assert frustum(model, data, "down").frustum_far == mujoco_camera(model, data).frustum_far


def test_the_far_plane_looks_at_all_of_a_broad_picture() -> None:
    # A lid 3 m above the camera that fills 4 : 3 to each side, and beyond it on the right one 37 m up.
    lids = '<geom type="box" size="9 9 .1" pos="-7.4 0 6.1"/> <geom type="box" size="99 99 .1" pos="0 0 40.1"/>'
    model, data = card("", more=lids)
    model.cam_quat[0] = (0, 1, 0, 0)
    mujoco.mj_forward(model, data)
    assert frustum(model, data, "down").frustum_far < 10.0
    assert frustum(model, data, "down", 16 / 9).frustum_far == mujoco_camera(model, data).frustum_far


@pytest.mark.parametrize("lens", ["fovy='40'", "sensorsize='0.036 0.024' focal='0.03 0.03' principal='0.004 -0.002'"])
def test_another_near_plane_leaves_the_picture_as_it_is(lens: str) -> None:
    """All that bounds it grows alike, also where the camera tells of its sensor, off its lens' axis."""
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody><camera name='eye' {lens}/></worldbody></mujoco>")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    seen, theirs = eye_of(model, data, "eye"), mujoco_camera(model, data)
    assert seen.frustum_near == pytest.approx(CLIP_NEAR)
    assert theirs.frustum_near < 0.5 * CLIP_NEAR
    for name in ("bottom", "top", "center", "width"):
        ours, whole = (getattr(one, f"frustum_{name}") / one.frustum_near for one in (seen, theirs))
        assert ours == pytest.approx(whole, rel=1e-5)
    assert (seen.frustum_width > 0.0) == ("sensorsize" in lens)


def mujoco_camera(model: mujoco.MjModel, data: mujoco.MjData) -> mujoco.MjvGLCamera:
    """MuJoCo's own view of the camera, before its planes are moved."""
    view = mujoco.MjvCamera()
    view.type, view.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, 0
    return mujoco.mjv_camera2GLCamera(model, data, view)


@needs_vulkan
def test_what_stands_close_to_a_camera_is_drawn() -> None:
    near = '<geom type="box" size="0.2 0.2 0.01" pos="0 0 2.85" material="card"/>'
    model, data = card("", near, emission=100.0)
    model.stat.extent = 100.0  # MuJoCo's own near plane would be 1 m away
    model.mat_emission[:] = 100.0
    with FilamentRenderer(model) as renderer:
        wide = renderer.radiance(data, "down", 160, 120)
    assert centre(wide) > 0
    with FilamentRenderer(card("", near, emission=100.0)[0]) as renderer:
        assert renderer.radiance(data, "down", 160, 120) == pytest.approx(wide, rel=1e-3)


@needs_vulkan
def test_filament_writes_nothing_to_the_terminal(capfd: pytest.CaptureFixture[str]) -> None:
    model, data = shadowed_scene()
    with open_renderer("filament", model) as renderer:
        renderer.radiance(data, "down", 64, 48)
    print("still here")
    assert capfd.readouterr() == ("still here\n", "")


@needs_vulkan
def test_filament_leaves_nothing_in_a_pipe_for_the_end() -> None:
    """C's standard output holds lines back where it is no terminal, and would let them go when the process ends."""
    program = (
        "import mujoco; from refseq_bench.sim.rendering.opening import open_renderer;"
        "model = mujoco.MjModel.from_xml_string('<mujoco><worldbody><camera name=\"c\"/></worldbody></mujoco>');"
        "data = mujoco.MjData(model); mujoco.mj_forward(model, data);"
        "open_renderer('filament', model).radiance(data, 'c', 16, 16)"
    )
    ended = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True)
    assert (ended.stdout, ended.stderr) == ("", "")


@needs_vulkan
def test_a_closed_renderer_says_so() -> None:
    model, data = card("")
    renderer = open_renderer("filament", model)
    renderer.close()
    renderer.close()
    with pytest.raises(RendererError, match=r"^renderer 'filament' is closed$"):
        renderer.radiance(data, "down")


@needs_vulkan
def test_an_unknown_camera_is_named_with_the_valid_ones() -> None:
    model, data = card("")
    with open_renderer("filament", model) as renderer, pytest.raises(SimError, match="'up': the model has down"):
        renderer.radiance(data, "up")


OPEN = """
import sys, mujoco
from refseq_bench.sim.rendering.drivers import vulkan_device, gl_backend
from refseq_bench.sim.errors import RendererError
from refseq_bench.sim.rendering.opening import open_renderer
try:
    open_renderer(sys.argv[1], mujoco.MjModel.from_xml_string("<mujoco/>"))
except RendererError as error:
    print(error)
print(vulkan_device() if sys.argv[1] == "filament" else gl_backend())
"""


def open_elsewhere(kind: str, **environment: str) -> tuple[list[str], str]:
    """Lines that a fresh process prints on opening a renderer, and its error output."""
    env = {**os.environ, "PYTHONPATH": str(ROOT), **environment}
    done = subprocess.run([sys.executable, "-c", OPEN, kind], env=env, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines(), done.stderr


@needs_gl
def test_what_draws_is_told_with_the_version_of_its_driver() -> None:
    device = gl_device()
    assert device is not None
    assert device.backend == gl_backend()
    assert device.renderer
    assert device.version[:1].isdigit()


def test_a_process_that_cannot_ask_finds_no_device(monkeypatch: pytest.MonkeyPatch) -> None:
    for broken in ("/bin/false", "/bin/true", "/nonexistent"):
        monkeypatch.setattr(sys, "executable", broken)
        assert gl_device() is None


@needs_vulkan
def test_a_vulkan_device_has_a_driver_with_a_version() -> None:
    driver = vulkan_driver()
    assert driver is not None
    assert driver.device == vulkan_device()
    assert driver.version > 0


def test_without_a_vulkan_driver_one_line_names_the_packages() -> None:
    nowhere = "/nonexistent/driver.json"
    (error, device), noise = open_elsewhere("filament", VK_DRIVER_FILES=nowhere, VK_ICD_FILENAMES=nowhere)
    assert "libvulkan1 mesa-vulkan-drivers" in error
    assert "refseq doctor" in error
    assert device == "None"
    assert noise == ""


def test_without_gl_one_line_names_the_packages() -> None:
    (error, backend), _ = open_elsewhere("classic", MUJOCO_GL="egl", __EGL_VENDOR_LIBRARY_FILENAMES="/nonexistent.json")
    assert error.startswith("renderer 'classic' found no GL (egl: ")
    assert "libegl1 libgl1-mesa-dri" in error
    assert backend == "None"


@pytest.fixture
def classic() -> Iterator[tuple[Renderer, mujoco.MjData]]:
    sun = SUN.format(dir="0 0 -1", shadow="false")
    patch = '<geom type="box" size="0.3 0.3 0.1" pos="0 0.8 0" rgba="0.05 0.05 0.05 1"/>'
    model, data = card(sun, patch)
    with open_renderer("classic", model) as renderer:
        yield renderer, data


@needs_gl
def test_classic_draws_the_right_way_up_in_any_size(classic: tuple[Renderer, mujoco.MjData]) -> None:
    renderer, data = classic
    large, small = renderer.radiance(data, "down"), renderer.radiance(data, "down", 64, 48)
    assert large.shape == (480, 640)
    assert small.shape == (48, 64)
    assert large.dtype == np.float32
    # The dark box lies towards +y, which is up for a camera that looks down without a turn.
    assert large[20:100, 300:340].mean() < 0.3 * large[380:460, 300:340].mean()
    assert small.mean() == pytest.approx(large.mean(), rel=0.1)


@needs_gl
def test_classic_repeats_and_refuses_pictures_beyond_its_buffer(classic: tuple[Renderer, mujoco.MjData]) -> None:
    renderer, data = classic
    assert np.array_equal(renderer.radiance(data, "down"), renderer.radiance(data, "down"))
    with pytest.raises(SimError, match="image of 5000×480 is beyond"):
        renderer.radiance(data, "down", 5000, 480)


def test_none_has_no_image() -> None:
    model, data = card("")
    with open_renderer("none", model) as renderer:
        assert renderer.kind is RendererKind.NONE
        with pytest.raises(SimError, match=r"has no image of camera 'down': choose 'baked', 'filament' or 'classic'$"):
            renderer.radiance(data, "down")


@pytest.mark.parametrize("count", range(len(RendererKind)))
def test_all_other_renderers_are_offered(count: int) -> None:
    for kinds in itertools.combinations(RendererKind, count):
        offered = re.split(", | or ", others_than(*kinds))
        assert offered == [f"'{kind}'" for kind in RendererKind if kind not in kinds]


def test_an_unknown_renderer_is_named_with_the_valid_ones() -> None:
    with pytest.raises(SimError, match=r"^unknown renderer 'raytrace': valid are baked, filament, classic, none$"):
        open_renderer("raytrace", card("")[0])


def test_preparing_a_spec_keeps_what_it_has() -> None:
    spec = mujoco.MjSpec()
    spec.add_numeric(name="filament.ao.enabled", data=[1.0])
    prepare_spec(spec)
    prepare_spec(spec)
    model = spec.compile()
    assert model.numeric("filament.ao.enabled").data == 1.0
    assert model.numeric("filament.fallback.head_light_intensity").data == 0.0
