import numpy as np
import pytest

from refseq_bench.worlds.lighting.photometry import GLAZING
from refseq_bench.worlds.lighting.sunlight import shaded, sunlit
from refseq_bench.worlds.plans.load import parse_plan
from tests.worlds.conftest import box, corner

ROOM = parse_plan(box(6, 5, end='[[window]]\nname = "w"\nwall = "right"\nat = 3\nglazing = "4mm"'))
"""A window from x = 2 to 4 and z = 0.9 to 2.4 in a wall of 0.3 m, whose inner face is at y = -2.5."""


def beam(sideways: float, down: float) -> np.ndarray:
    """A beam through that window that goes ``sideways`` and ``down`` for each metre inwards."""
    ray = np.array([sideways, 1.0, -down])
    return ray / np.linalg.norm(ray)


@pytest.mark.parametrize(("sideways", "down"), [(0.0, 1.0), (0.3, 1.0), (-0.5, 0.6)])
def test_patch_on_the_floor_is_where_geometry_puts_it(sideways: float, down: float) -> None:
    # Its far edge is drawn by the upper edge of the outer opening, its near edge by the inner sill.
    x, y = np.meshgrid(np.arange(0.005, 6, 0.01), np.arange(-2.495, 2.5, 0.01))
    lit = sunlit(ROOM, np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1), beam(sideways, down)) > 0
    far, near = -2.8 + 2.4 / down, -2.5 + 0.9 / down
    rows = y.ravel()[lit]
    assert rows.min() == pytest.approx(near, abs=0.011)
    assert rows.max() == pytest.approx(min(far, 2.495), abs=0.011)
    row = np.sort(rows)[len(rows) // 2]
    across, middle = x.ravel()[lit & (y.ravel() == row)], row + 2.5
    reveal = 0.3 * sideways
    assert across.min() == pytest.approx(2 + sideways * middle + max(0.0, reveal), abs=0.011)
    assert across.max() == pytest.approx(4 + sideways * middle + min(0.0, reveal), abs=0.011)


def test_sun_loses_what_the_glass_keeps() -> None:
    point = np.array([[3.0, -1.0, 0.0]])
    assert sunlit(ROOM, point, beam(0.0, 1.0)) == GLAZING["4mm"]
    assert sunlit(ROOM, point, beam(0.0, 0.1)) == 0.0
    assert sunlit(ROOM, point, -beam(0.0, 1.0)) == 0.0


def test_sun_does_not_shine_around_corners() -> None:
    window = '[[window]]\nname = "w"\nwall = "outer-1"\nat = {at}'
    for at, lit in ((11.0, True), (5.0, False)):
        plan = parse_plan(corner(length=12, depth=12).replace("[routes]", window.format(at=at) + "\n[routes]"))
        ray = np.array([11.0 - at, 7.2, -0.2]) / np.linalg.norm([11.0 - at, 7.2, -0.2])
        point = np.array([[at, -1.0, 1.6]]) + ray * 7.2 / ray[1]
        assert bool(sunlit(plan, point, ray)[0]) == lit


@pytest.mark.parametrize("elevation", [10, 30, 60])
def test_shadow_of_a_wall_is_as_long_as_its_height_over_the_tangent(elevation: float) -> None:
    text = box(6, 5).replace('[ceiling]\nheight = 2.8\nmaterial = "plaster"\n', "")
    low = text.replace("thickness = 0.3", "thickness = 0.3\nheight = 2").replace(
        "[floor]\n", "[floor]\narea = [[-90, -90], [90, 90]]\n"
    )
    plan = parse_plan(low)
    angle = np.radians(elevation)
    ray = np.array([0.0, np.cos(angle), -np.sin(angle)])  # over the right wall, the only one in the way
    y = np.arange(-2.49, 40, 0.01)
    shade = shaded(plan.model_copy(update={"wall": plan.wall[:1]}), np.stack([3 + 0 * y, y, 0 * y], axis=1), ray)
    assert y[shade].max() + 2.5 == pytest.approx(2 / np.tan(angle), abs=0.011)
    assert not shade[y > -2.5 + 2 / np.tan(angle)].any()
