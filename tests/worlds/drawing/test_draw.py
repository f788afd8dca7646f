import struct
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from refseq_bench.worlds.drawing.draw import DPI, draw_plan
from refseq_bench.worlds.drawing.sheet import PAPERS
from refseq_bench.worlds.drawing.title_block import _bearing
from refseq_bench.worlds.errors import WorldsError
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.lighting.daylight import sun_position
from refseq_bench.worlds.plans.load import load_plan, parse_plan
from refseq_bench.worlds.plans.schema import FloorPlan

SVG = "{http://www.w3.org/2000/svg}"
GENERATED = load_plan("corridor:6")


def texts(path: Path) -> list[str]:
    return ["".join(t.itertext()).strip() for t in ElementTree.parse(path).iter(f"{SVG}text")]


def drawn(path: Path) -> set[str]:
    """Names of the groups of a drawing."""
    return {group.get("id", "") for group in ElementTree.parse(path).iter(f"{SVG}g")}


@pytest.fixture(scope="module")
def hallway_svg(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("drawings") / "hallway.svg"
    draw_plan(load_plan("hallway"), path, light_named("16:00"))
    return path


def test_every_thing_of_the_hallway_is_in_the_drawing(hallway_svg: Path) -> None:
    plan, found = load_plan("hallway"), drawn(hallway_svg)
    for table in ("wall", "window", "door", "poster", "board", "cabinet", "bin", "fixture", "lamp"):
        assert {f"{table}_{item.name}" for item in getattr(plan, table)} <= found


def test_doors_have_their_numbers_and_routes_their_distances(hallway_svg: Path) -> None:
    plan, said = load_plan("hallway"), texts(hallway_svg)
    assert {door.label or door.name for door in plan.door} <= set(said)
    assert {str(distance) for distance in range(0, 100, 10)} <= set(said)
    assert plan.name in said
    assert plan.title in said
    assert any("drawn 1:100 on A3" in text for text in said)
    assert any("the sun is 29.7° up in 241°" in text for text in said)


def test_the_same_plan_gives_the_same_bytes(tmp_path: Path) -> None:
    for suffix in (".svg", ".png"):
        paths = [tmp_path / f"{i}{suffix}" for i in range(2)]
        for path in paths:
            draw_plan(GENERATED, path)
        assert paths[0].read_bytes() == paths[1].read_bytes()
    width, height = struct.unpack(">II", (tmp_path / "0.png").read_bytes()[16:24])
    assert (width, height) in {tuple(int(side / 25.4 * DPI) for side in paper) for paper in PAPERS.values()}


def outline(path: Path, name: str) -> np.ndarray:
    """Points of the first outline of a group, (n, 2), in the drawing's units; y runs down."""
    group = next(g for g in ElementTree.parse(path).iter(f"{SVG}g") if g.get("id") == name)
    first = next(group.iter(f"{SVG}path"))
    numbers = [float(word) for word in str(first.get("d")).split() if word not in "MLZCz"]
    return np.array(numbers).reshape(-1, 2)


def position(path: Path, name: str) -> np.ndarray:
    """Middle of the first outline of a group, (2,), in the drawing's units; y runs down."""
    return np.asarray(outline(path, name).mean(axis=0))


def test_distances_on_paper_are_distances_over_the_scale(hallway_svg: Path) -> None:
    """Posters p01 and p05 are both on the left wall of the first piece, 13 m apart: 130 mm at 1:100."""
    apart = position(hallway_svg, "poster_p05") - position(hallway_svg, "poster_p01")
    assert apart * 25.4 / 72 == pytest.approx([130.0, 0.0], abs=0.01)


def test_only_the_routes_that_are_asked_for(tmp_path: Path) -> None:
    path = tmp_path / "annex.svg"
    draw_plan(load_plan("annex"), path, routes=("detour",))
    assert {name for name in drawn(path) if name.startswith("route_")} == {"route_detour"}
    assert "route detour, 107 m" in texts(path)


def test_north_and_sun_on_the_sheet_agree_with_the_plan(hallway_svg: Path) -> None:
    """Bearings turn clockwise on the sheet, and the x axis lies where the plan says."""
    plan = load_plan("hallway")
    assert _bearing(plan, plan.place.x_azimuth) == pytest.approx([1.0, 0.0])
    assert _bearing(plan, plan.place.x_azimuth + 90.0) == pytest.approx([0.0, -1.0])
    _, azimuth = sun_position(plan.place, plan.place.date, 16.0)
    # The windows are in the wall to -y, and by day the sun shines in.
    assert _bearing(plan, float(np.degrees(azimuth)))[1] < -0.5


OPEN_AIR = """
floor = { material = "m", area = [[0, 0], [30, 20]] }
car = [{ name = "c1", at = [5, 5], heading = 90 }]
tree = [{ name = "t1", at = [20, 10] }]
kerb = [{ name = "k1", points = [[2, 15], [10, 15], [10, 18]], material = "m" }]
marking = [{ name = "m1", points = [[2, 2], [2, 6]], material = "m" }]
post = [{ name = "l1", at = [25, 5] }]
person = [{ name = "a", at = [15, 15], walk = [[18, 15]] }]
stairs = [{ name = "s1", at = [25, 15], width = 2, steps = 4, material = "m" }]
furniture = [{ name = "f1", at = [12, 5], kind = "box", width = 1, depth = 1, height = 1, material = "m" }]
name = "yard"
[place]
latitude = 40.63
longitude = -8.66
timezone = "Europe/Lisbon"
date = 2008-03-20
x_azimuth = 0
[material]
m = { albedo = 0.3, roughness = 0.9 }
[routes]
there = [[1, 10], [29, 10]]
"""


def test_all_that_stands_in_the_open_air_is_drawn(tmp_path: Path) -> None:
    path = tmp_path / "yard.svg"
    draw_plan(parse_plan(OPEN_AIR), path, light_named("23:00"))
    names = {"car_c1", "tree_t1", "kerb_k1", "marking_m1", "post_l1", "person_a", "stairs_s1", "furniture_f1"}
    assert names <= drawn(path)
    assert any("below the horizon" in text for text in texts(path))


def test_a_route_lies_to_the_right_of_its_line(tmp_path: Path) -> None:
    """Along x at y = 10: 0.16 m below that on the sheet, the crate of 1 m around y = 5."""
    path = tmp_path / "yard.svg"
    draw_plan(parse_plan(OPEN_AIR), path)
    crate, route = outline(path, "furniture_f1"), outline(path, "route_there")
    metre, low = np.ptp(crate[:, 1]), crate[:, 1].max()
    assert (low - route[:, 1]) / metre == pytest.approx(10.0 - 0.16 - 4.5, abs=0.01)


@pytest.mark.parametrize(("angle", "size"), [(0, (0.9, 0.04)), (90, (0.04, 0.9))])
def test_a_leaf_is_drawn_as_it_stands(
    small: Callable[..., str], tmp_path: Path, angle: float, size: tuple[float, float]
) -> None:
    path = tmp_path / "small.svg"
    draw_plan(parse_plan(small(f'door = [{{ name = "d", wall = "left", at = 4, open = {angle} }}]')), path)
    metre = np.ptp(outline(path, "wall_right")[:, 0]) / 8
    leaf = outline(path, "door_d")
    assert np.ptp(leaf, axis=0) / metre == pytest.approx(size, abs=0.01)
    assert leaf[:, 1].min() < outline(path, "wall_right")[:, 1].min() - 2.4 * metre  # behind the face of the left wall


@pytest.mark.parametrize("name", ["plan.pdf", "plan", "plan.SVG", "plan.svg.txt"])
def test_a_file_that_is_no_drawing(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    with pytest.raises(WorldsError) as caught:
        draw_plan(GENERATED, path)
    assert str(caught.value) == f"{path}: cannot draw a '{path.suffix}' file; valid are .svg, .png"
    assert not path.exists()


def test_a_route_that_is_not_there(small: Callable[..., str], tmp_path: Path) -> None:
    plan: FloorPlan = parse_plan(small())
    with pytest.raises(WorldsError) as caught:
        draw_plan(plan, tmp_path / "plan.svg", routes=("up",))
    assert str(caught.value) == "unknown route 'up' in world 'small'; known are forward"
    assert not list(tmp_path.iterdir())
