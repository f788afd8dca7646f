import cv2
import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq_bench.sim.cameras.lens import Lens, Optics
from refseq_bench.sim.cameras.library import load_camera
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.rendering.drivers import vulkan_device
from refseq_bench.sim.rendering.filament import prepare_spec
from refseq_bench.sim.rendering.opening import open_renderer

needs_vulkan = pytest.mark.skipif(vulkan_device() is None, reason="no Vulkan device on this machine")
PIXEL, SIZE = 5.6e-6, (640, 480)
WIDE = load_camera("fire-i-wide").lens
PINCUSHION = Lens(focal=2.17e-3, k1=0.0633, k2=0.0139)
LENSES = (Lens(), WIDE, PINCUSHION)
every_lens = pytest.mark.parametrize("lens", LENSES, ids=["plain", "barrel", "pincushion"])
pixels = st.tuples(st.floats(0, SIZE[0] - 1), st.floats(0, SIZE[1] - 1))


def optics(lens: Lens) -> Optics:
    return Optics(lens, PIXEL, SIZE)


def by_opencv(lens: Lens, points: np.ndarray) -> np.ndarray:
    """Pixels of points (n, 3) [m] with x right, y down, z ahead, (n, 2)."""
    focal = lens.focal / PIXEL
    K = np.array([[focal, 0, (SIZE[0] - 1) / 2], [0, focal, (SIZE[1] - 1) / 2], [0, 0, 1]])
    distortion = np.array([lens.k1, lens.k2, 0.0, 0.0])
    return cv2.projectPoints(points, np.zeros(3), np.zeros(3), K, distortion)[0].reshape(-1, 2)


@every_lens
def test_points_are_drawn_where_opencv_draws_them(lens: Lens) -> None:
    points = np.random.default_rng(1).uniform([-0.8, -0.6, 1.0], [0.8, 0.6, 3.0], (200, 3))
    u, v = optics(lens).pixels(points[:, 0] / points[:, 2], points[:, 1] / points[:, 2])
    assert np.column_stack([u, v]) == pytest.approx(by_opencv(lens, points), abs=1e-6)


@given(pixels, st.sampled_from(LENSES))
def test_a_ray_is_drawn_at_the_pixel_that_it_is_the_ray_of(pixel: tuple[float, float], lens: Lens) -> None:
    u, v = (np.array([n]) for n in pixel)
    there = optics(lens).pixels(*optics(lens).rays(u, v))
    assert np.ravel(there) == pytest.approx(pixel, abs=1e-3)


def test_the_fire_i_sees_45_degrees_and_its_wide_lens_96() -> None:
    for lens, degrees in ((Lens(), 45.2), (WIDE, 95.7)):
        x, _ = optics(lens).rays(np.array([-0.5, 639.5]), np.array([239.5, 239.5]))
        assert np.degrees(np.ptp(np.arctan(x))) == pytest.approx(degrees, abs=0.1)


def test_the_wide_lens_is_the_closest_to_its_calibration() -> None:
    # Civera's figures: drawn at r mm, a point belongs at r (1 + k1 r^2 + k2 r^4) mm.
    drawn = np.linspace(0, 400 * 5.6e-3, 2000)
    tangents = drawn * (1 + 6.333e-2 * drawn**2 + 1.390e-2 * drawn**4) / 2.1735

    def error(k1: float, k2: float) -> float:
        """RMS [pixels] over the picture: a ring's area goes with its radius."""
        residual = (Lens(k1=k1, k2=k2).drawn(tangents) - drawn / 2.1735) * 2.1735 / 5.6e-3
        return float(np.sqrt(np.average(residual**2, weights=drawn)))

    best = error(WIDE.k1, WIDE.k2)
    assert best == pytest.approx(3.4, abs=0.1)
    around = [error(WIDE.k1 + a, WIDE.k2 + b) for a, b in ((0.01, 0), (-0.01, 0), (0, 0.004), (0, -0.004))]
    assert min(around) > best


def test_without_distortion_the_picture_stays_what_it_is() -> None:
    picture = np.random.default_rng(0).uniform(size=(480, 640)).astype(np.float32)
    assert optics(Lens()).draw(picture) is picture
    assert optics(Lens()).pinhole[:2] == SIZE


@pytest.mark.parametrize("lens", [WIDE, PINCUSHION], ids=["barrel", "pincushion"])
def test_the_pinholes_picture_is_just_large_enough(lens: Lens) -> None:
    eye = optics(lens)
    x, y = eye.rays(*np.meshgrid(np.arange(640.0), np.arange(480.0)))
    for tangents, size in ((x, eye.pinhole.width), (y, eye.pinhole.height)):
        assert 0 <= (size - 1) / 2 - np.abs(tangents).max() * eye.focal < 1
    assert np.tan(np.radians(eye.pinhole.fovy / 2)) * eye.focal == pytest.approx(eye.pinhole.height / 2)


@pytest.mark.quick_cases("barrel")
@needs_vulkan
@every_lens
def test_rendered_and_drawn_lamps_lie_where_opencv_puts_them(lens: Lens) -> None:
    """Small glowing discs on a plane that faces the camera, 2 m ahead."""
    eye, reach = optics(lens), 2.0
    u, v = (a.ravel() for a in np.meshgrid(np.linspace(25, 614, 6), np.linspace(25, 454, 5)))
    points = np.column_stack([*eye.rays(u, v), np.ones(len(u))]) * reach
    size = f"{6 / eye.focal * reach} 0.001"
    discs = "".join(f'<geom type="cylinder" size="{size}" pos="{x} {-y} {-z}" material="glow"/>' for x, y, z in points)
    picture = eye.draw(rendered(eye, discs))
    for u, v in by_opencv(lens, points):
        assert centroid(picture, u, v) == pytest.approx((u, v), abs=0.3)


def rendered(eye: Optics, shapes: str) -> np.ndarray:
    spec = mujoco.MjSpec.from_string(f"""
        <mujoco>
          <asset><material name="glow" rgba="1 1 1 1" roughness="1" metallic="0" emission="100"/></asset>
          <worldbody><camera name="eye" fovy="{eye.pinhole.fovy}"/>{shapes}</worldbody>
        </mujoco>""")
    prepare_spec(spec)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    with open_renderer("filament", model) as renderer:
        return renderer.radiance(data, "eye", eye.pinhole.width, eye.pinhole.height)


def centroid(picture: np.ndarray, u: float, v: float) -> tuple[float, float]:
    left, top = round(u) - 12, round(v) - 12
    patch = picture[top : top + 25, left : left + 25]
    rows, columns = np.indices(patch.shape)
    return left + float(np.average(columns, weights=patch)), top + float(np.average(rows, weights=patch))


@needs_vulkan
def test_an_even_wall_gets_darker_by_the_fourth_power_of_the_cosine() -> None:
    eye = optics(Lens(focal=2.17e-3))
    wall = '<geom type="box" size="9 9 0.1" pos="0 0 -3" material="glow"/>'
    seen = eye.draw(rendered(eye, wall)) * eye.shading
    u, v = np.meshgrid(np.arange(640.0), np.arange(480.0))
    angle = np.arctan(np.hypot(u - 319.5, v - 239.5) * PIXEL / 2.17e-3)
    assert np.abs(seen / seen[239:241, 319:321].mean() / np.cos(angle) ** 4 - 1).max() < 0.002


@pytest.mark.parametrize("lens", [WIDE, PINCUSHION], ids=["barrel", "pincushion"])
def test_distortion_moves_light_and_loses_none(lens: Lens) -> None:
    """What falls within a circle in the picture is what the same rays bring without distortion."""
    eye, flat = optics(lens), optics(Lens(focal=lens.focal))
    u, v = np.meshgrid(np.arange(640.0), np.arange(480.0))
    drawn = np.hypot(u - 319.5, v - 239.5)
    reach = 235.0
    tangent = float(eye.rays(np.array([319.5 + reach]), np.array([239.5]))[0][0])
    # Without distortion the rays up to a tangent t bring, by cos^4, pi f^2 t^2 / (1 + t^2).
    expected = np.pi * flat.focal**2 * tangent**2 / (1 + tangent**2)
    assert eye.shading[drawn <= reach].sum() == pytest.approx(expected, rel=2e-3)


def test_the_mount_takes_its_share_of_the_corners_and_nothing_of_the_centre() -> None:
    natural, whole = optics(Lens()).shading, optics(Lens(corner_loss=0.4)).shading
    assert whole[0, 0] == pytest.approx(0.6 * natural[0, 0])
    assert whole[239:241, 319:321] == pytest.approx(natural[239:241, 319:321], rel=1e-6)
    assert (np.diff(whole[239, 320:]) < 0).all()


def test_blur_spreads_a_point_by_its_sigma_and_loses_no_light() -> None:
    point = np.zeros((480, 640), np.float32)
    point[240, 320] = 1000.0
    spread = optics(Lens(blur=1.5)).blurred(point)
    assert spread.sum() == pytest.approx(1000.0, rel=1e-4)
    columns = np.arange(640) - 320
    assert np.sqrt((spread.sum(axis=0) * columns**2).sum() / 1000) == pytest.approx(1.5, rel=0.05)
    assert np.array_equal(optics(Lens(blur=0.0)).blurred(point), point)


def test_impossible_figures_are_named() -> None:
    with pytest.raises(SimError, match=r"^lens\.focal = 0\.0 is not > 0 and finite$"):
        Lens(focal=0.0)
    with pytest.raises(SimError, match=r"^lens\.transmission = 1\.1 is not > 0 and <= 1$"):
        Lens(transmission=1.1)
    with pytest.raises(SimError, match=r"^lens\.k1 = inf is not finite$"):
        Lens(k1=float("inf"))
    with pytest.raises(SimError, match=r"^lens\.corner_loss = -0\.1 is not >= 0 and <= 1$"):
        Lens(corner_loss=-0.1)


def test_a_distortion_that_folds_the_picture_over_is_refused() -> None:
    # r (1 - 0.9 r^2) rises up to r = 1 / sqrt(2.7), where it is 2/3 of that: 0.4057 of 767.9 pixels.
    message = (
        r"^lens: focal, k1, k2 = 0\.0043, -0\.9, 0\.0 draw 312 pixels around the centre; "
        r"the corner of 640 × 480 is at 400$"
    )
    with pytest.raises(SimError, match=message):
        optics(Lens(k1=-0.9))
