import cv2
import mujoco
import numpy as np
import pytest

from refseq_bench.sim.cameras.lens import Lens, Optics
from refseq_bench.sim.cameras.library import load_camera
from refseq_bench.sim.cameras.motion_blur import (
    BLOCK,
    FAR,
    SHORTEST,
    MocapPoses,
    block_centres,
    paths,
    smeared,
    tell_velocities,
)
from refseq_bench.sim.rendering.drivers import vulkan_device
from refseq_bench.sim.rendering.filament import prepare_spec
from refseq_bench.sim.rendering.opening import open_renderer

needs_vulkan = pytest.mark.skipif(vulkan_device() is None, reason="no Vulkan device on this machine")
SIZE, PIXEL, SHUTTER = (640, 480), 5.6e-6, 1 / 15
PLAIN = Optics(Lens(), PIXEL, SIZE)
WIDE = Optics(load_camera("fire-i-wide").lens, PIXEL, SIZE)
DEPTH = 1.2
"""From the camera to the wall [m]."""
WALL = f'<geom type="plane" size="50 50 1" pos="0 0 {-DEPTH}"/>'


def scene(things: str = WALL, mount: str = "") -> tuple[mujoco.MjModel, mujoco.MjData]:
    """A camera that looks along −z from the origin, on a body that flies freely."""
    model = mujoco.MjModel.from_xml_string(f"""
        <mujoco>
          <option gravity="0 0 0"/>
          <worldbody>
            <body name="carrier"><freejoint/><camera name="eye"/>
              <geom type="box" size="0.1 0.1 0.1" pos="0 0 0.3" mass="1"/>{mount}</body>
            {things}
          </worldbody>
        </mujoco>""")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def run(optics: Optics, linear: list[float], turning: list[float], things: str = WALL, mount: str = "") -> np.ndarray:
    """Paths while the carrier moves at ``linear`` [m/s] and ``turning`` [rad/s], in the camera's axes."""
    model, data = scene(things, mount)
    data.qvel[:6] = [*linear, *turning]
    mujoco.mj_forward(model, data)
    return paths(model, data, "eye", optics, SHUTTER)


def test_sideways_the_path_is_speed_times_shutter_times_focal_over_depth() -> None:
    run_ = run(PLAIN, [0.4, 0, 0], [0, 0, 0])
    # Going right, all goes left: 17 pixels at 0.4 m/s, 1/15 s, 768 pixels, 1.2 m.
    assert run_[..., 0] == pytest.approx(-0.4 * SHUTTER * PLAIN.focal / DEPTH, rel=1e-5)
    assert run_[..., 1] == pytest.approx(0.0, abs=1e-5)
    assert -run_[0, 0, 0] == pytest.approx(17.1, abs=0.1)


def test_going_up_all_goes_down_in_the_picture() -> None:
    run_ = run(PLAIN, [0, 0.3, 0], [0, 0, 0])
    assert run_[..., 1] == pytest.approx(0.3 * SHUTTER * PLAIN.focal / DEPTH, rel=1e-5)


def test_forwards_paths_are_radial_and_grow_from_the_centre() -> None:
    run_ = run(PLAIN, [0, 0, -0.4], [0, 0, 0])  # ahead is −z
    u, v = block_centres(SIZE)
    gone = 0.4 * SHUTTER
    share = DEPTH / (DEPTH - gone / 2) - DEPTH / (DEPTH + gone / 2)
    assert run_ == pytest.approx(np.stack([u - 319.5, v - 239.5], axis=-1) * share, abs=1e-3)


def test_what_the_camera_goes_past_while_the_shutter_is_open_runs_outwards() -> None:
    run_ = run(PLAIN, [0, 0, -2.4 * DEPTH / SHUTTER], [0, 0, 0])  # the wall is behind it in the end
    u, v = block_centres(SIZE)
    assert np.isfinite(run_).all()
    assert (run_[..., 0] * (u - 319.5) + run_[..., 1] * (v - 239.5) > 0).all()


@pytest.mark.parametrize("things", [WALL, ""], ids=["wall", "open air"])
def test_turning_blurs_everywhere_whatever_the_depth(things: str) -> None:
    run_ = run(PLAIN, [0, 0, 0], [0, 0.5, 0], things)  # to the left: all goes right
    x, y = PLAIN.rays(*block_centres(SIZE))
    # The rotational optical flow: u' = f w (1 + x^2), v' = f w x y.
    expected = PLAIN.focal * 0.5 * SHUTTER * np.stack([1 + x**2, x * y], axis=-1)
    assert run_ == pytest.approx(expected, rel=2e-3, abs=2e-3)


def test_what_is_far_away_is_blurred_by_turning_only() -> None:
    assert np.abs(run(PLAIN, [3.0, 3.0, 3.0], [0, 0, 0], "")).max() < 2 * 3.0 * SHUTTER * PLAIN.focal / FAR


def test_standing_there_is_none() -> None:
    assert not run(PLAIN, [0, 0, 0], [0, 0, 0]).any()


@pytest.mark.parametrize("optics", [PLAIN, WIDE], ids=["plain", "wide"])
def test_any_motion_moves_points_as_two_projections_half_a_shutter_before_and_after(optics: Optics) -> None:
    """An askew camera off the axis of a turning, moving body, against MuJoCo's integrator and OpenCV's projection."""
    model, data = scene(mount='<camera name="askew" pos="0.3 -0.2 0.1" euler="12 -9 30"/>')
    data.qpos[:] = [0.1, 0.2, 0.0, *np.array([0.98, 0.1, -0.1, 0.12]) / np.linalg.norm([0.98, 0.1, -0.1, 0.12])]
    data.qvel[:6] = [0.3, -0.2, 0.25, 0.2, -0.3, 0.4]
    mujoco.mj_forward(model, data)
    found = paths(model, data, "askew", optics, SHUTTER).reshape(-1, 2)
    x, y = (a.ravel() for a in optics.rays(*block_centres(SIZE)))
    eye = data.camera("askew")
    rays = np.column_stack([x, -y, -np.ones_like(x)]) @ eye.xmat.reshape(3, 3).T
    points = eye.xpos + rays * ((-DEPTH - eye.xpos[2]) / rays[:, 2])[:, None]
    rest = data.qpos.copy()
    ends = []
    for share in (-0.5, 0.5):
        data.qpos[:] = rest
        mujoco.mj_integratePos(model, data.qpos, data.qvel, share * SHUTTER)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_camlight(model, data)
        ends.append(projected(optics, (points - eye.xpos) @ eye.xmat.reshape(3, 3)))
    assert np.hypot(*found.T).max() > 10
    assert found == pytest.approx(ends[1] - ends[0], abs=0.05)


def projected(optics: Optics, points: np.ndarray) -> np.ndarray:
    """OpenCV's pixels of points in MuJoCo's frame of a camera."""
    K = np.array([[optics.focal, 0, 319.5], [0, optics.focal, 239.5], [0, 0, 1]])
    flipped = points * [1, -1, -1]
    return cv2.projectPoints(flipped, np.zeros(3), np.zeros(3), K, np.array([optics.lens.k1, optics.lens.k2, 0, 0]))[
        0
    ].reshape(-1, 2)


def test_what_moves_with_the_camera_stays_sharp_and_what_goes_by_does_not() -> None:
    part = '<geom type="box" size="0.05 0.05 0.05" pos="-0.2 0 -0.7" mass="0.1"/>'
    passer = '<body pos="0.2 0 -0.75"><freejoint/><geom type="box" size="0.05 0.05 0.05" mass="1"/></body>'
    model, data = scene(WALL + passer, part)
    data.qvel[:3], data.qvel[6:9] = [0.4, 0, 0], [0, 1.0, 0]
    mujoco.mj_forward(model, data)
    found = paths(model, data, "eye", PLAIN, SHUTTER)
    u, v = block_centres(SIZE)
    own = np.hypot(u - 319.5 + 768 * 0.2 / 0.65, v - 239.5) < 40
    other = np.hypot(u - 319.5 - 768 * 0.2 / 0.7, v - 239.5) < 40
    assert np.abs(found[own]).max() < 1e-4
    scale = SHUTTER * PLAIN.focal / 0.7
    assert found[other] == pytest.approx(np.broadcast_to([-0.4 * scale, -1.0 * scale], found[other].shape), rel=1e-3)


def test_a_body_that_is_put_from_place_to_place_is_blurred_as_one_that_moves_there() -> None:
    shape = '<geom type="box" size="0.2 0.1 0.05" pos="0.05 0 0" mass="1"/>'
    turn, shift, elapsed = np.array([0.3, -0.4, 0.5]), np.array([0.6, -0.3, 0.2]), 0.001
    found = []
    for joint, mocap in (("<freejoint/>", ""), ("", 'mocap="true"')):
        model, data = scene(WALL + f'<body pos="0.1 0 -0.8" euler="20 10 0" {mocap}>{joint}{shape}</body>')
        body, before = model.nbody - 1, MocapPoses.of(data)
        if mocap:
            # The body's own frame turns by the vector, as a free joint's velocity is told.
            mujoco.mju_quatIntegrate(data.mocap_quat[0], turn, elapsed)
            data.mocap_pos[0] += shift * elapsed
            mujoco.mj_forward(model, data)
            tell_velocities(model, data, before, elapsed)
        else:
            data.qvel[6:12] = [*shift, *turn]
            mujoco.mj_forward(model, data)
        assert data.xpos[body] == pytest.approx([0.1, 0, -0.8], abs=0.001)
        found.append(paths(model, data, "eye", PLAIN, SHUTTER))
    assert np.abs(found[0]).max() > 20
    assert np.mean(np.abs(found[0] - found[1]).max(axis=-1) < 0.2) > 0.99  # but where an edge crossed a ray


def test_bodies_that_only_the_physics_knows_do_not_hide_what_is_seen() -> None:
    hull = '<geom type="box" size="1 1 0.01" pos="0 0 -0.5" group="3"/>'
    assert np.array_equal(run(PLAIN, [0.4, 0, 0], [0, 0, 0], WALL + hull), run(PLAIN, [0.4, 0, 0], [0, 0, 0]))


def even(run_: tuple[float, float], blocks: tuple[int, int] = (60, 80)) -> np.ndarray:
    return np.broadcast_to(np.array(run_, np.float32), (*blocks, 2)).copy()


@pytest.mark.parametrize("length", [1.0, 3.0, 8.5, 17.0, 40.0, 150.0])
@pytest.mark.parametrize("sign", [1, -1])
def test_an_edge_becomes_a_ramp_of_the_paths_length(length: float, sign: int) -> None:
    edge = np.zeros((480, 640), np.float32)
    edge[:, 320:] = 1.0  # between the pixels 319 and 320
    ramp = smeared(edge, even((sign * length, 0.0)))
    expected = np.clip((np.arange(640) - 319.5) / length + 0.5, 0, 1)
    assert np.abs(ramp - expected).max() < max(0.13 / length, 0.01)
    rise = np.diff(ramp[240])
    at = np.arange(639) + 0.5
    spread = np.sqrt((rise * (at - (rise * at).sum()) ** 2).sum())
    # A box of length L has the variance L^2 / 12; sampling between pixels adds up to 1 / 4.
    assert 0.98 * np.sqrt(length**2 / 12) < spread < 1.02 * np.sqrt(length**2 / 12 + 1 / 4)


def test_an_edge_along_the_path_stays() -> None:
    edge = np.zeros((480, 640), np.float32)
    edge[:, 320:] = 1.0
    assert np.array_equal(smeared(edge, even((0.0, 20.0))), edge)


@pytest.mark.parametrize("angle", [0.0, 37.0, 90.0])
def test_a_grating_keeps_its_mean_and_loses_contrast_as_the_sinc_says(angle: float) -> None:
    length, period = 15.0, 40.0
    along = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
    u, v = np.meshgrid(np.arange(640), np.arange(480))
    wave = np.sin(2 * np.pi / period * (u * along[0] + v * along[1]))
    blurred_ = smeared((100 + 80 * wave).astype(np.float32), even(tuple(length * along)))
    inside = np.s_[40:-40, 40:-40]
    assert np.abs(blurred_ - 100 - 80 * np.sinc(length / period) * wave)[inside].max() < 0.8


def test_light_is_kept_and_never_turns_negative() -> None:
    lamps = np.zeros((480, 640), np.float32)
    lamps[100:380:40, 100:540:40] = 1e5
    blurred_ = smeared(lamps, even((11.3, -6.2)))
    assert blurred_.sum() == pytest.approx(lamps.sum(), rel=1e-4)
    assert blurred_.min() >= 0.0


def test_short_paths_leave_the_picture_as_it_is() -> None:
    picture = np.random.default_rng(0).uniform(size=(480, 640)).astype(np.float32)
    assert smeared(picture, even((0.9 * SHORTEST, 0.0))) is picture


def test_blocks_cover_pictures_of_any_size() -> None:
    for size in ((640, 480), (100, 50), (7, 9)):
        u, v = block_centres(size)
        for centres, n in ((u[0], size[0]), (v[:, 0], size[1])):
            steps = np.diff(centres)
            assert (centres[0] + centres[-1]) / 2 == pytest.approx((n - 1) / 2)
            assert (steps <= BLOCK).all()


@needs_vulkan
def test_a_blurred_picture_is_the_mean_of_those_taken_while_the_shutter_is_open() -> None:
    """A wall of glowing tiles, drawn at 33 instants of a flight along it, while turning and coming nearer."""
    optics = Optics(Lens(), 4 * PIXEL, (160, 120))
    rng = np.random.default_rng(3)
    tiles = "".join(
        f'<geom type="box" size="0.06 0.06 0.01" pos="{x} {y} {-DEPTH - 0.01}" material="glow{rng.integers(4)}"/>'
        for x in np.arange(-0.78, 0.79, 0.12)
        for y in np.arange(-0.6, 0.61, 0.12)
    )
    glows = "".join(f'<material name="glow{i}" roughness="1" metallic="0" emission="{20 + 50 * i}"/>' for i in range(4))
    spec = mujoco.MjSpec.from_string(f"""
        <mujoco>
          <asset>{glows}</asset>
          <worldbody>
            <body name="carrier"><freejoint/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
              <camera name="eye" fovy="{optics.pinhole.fovy}"/></body>
            {tiles}
          </worldbody>
        </mujoco>""")
    prepare_spec(spec)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qvel[:] = [1.2, 0.0, -0.6, 0.0, 0.2, 0.3]
    mujoco.mj_forward(model, data)
    rest = data.qpos.copy()
    with open_renderer("filament", model) as renderer:
        sharp = renderer.radiance(data, "eye", 160, 120)
        blurred_ = smeared(sharp, paths(model, data, "eye", optics, SHUTTER))
        frames = []
        for share in (np.arange(33) + 0.5) / 33 - 0.5:
            data.qpos[:] = rest
            mujoco.mj_integratePos(model, data.qpos, data.qvel, share * SHUTTER)
            mujoco.mj_forward(model, data)
            frames.append(renderer.radiance(data, "eye", 160, 120))
    truth, inside = np.mean(frames, axis=0), np.s_[8:-8, 8:-8]
    error, without = (float(np.std((p - truth)[inside])) for p in (blurred_, sharp))
    assert without > 0.1 * truth.mean()
    # What is left are the edges of the frames, whole pixels without smoothing.
    assert error < 0.3 * without
