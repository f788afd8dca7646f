import io
from pathlib import Path

import cv2
import numpy as np
import pytest
from rich.console import Console

from refseq.features.sift import SiftSettings, SiftWords
from refseq.features.word_extractor import PictureKeys
from refseq_bench.scenarios.drives.drive import Drive
from refseq_bench.scenarios.world_survey.day import (
    SAME_PLACE,
    Day,
    Recall,
    day_table,
    found_again,
    through_the_day,
)
from refseq_bench.scenarios.world_survey.day_curve import day_curve
from refseq_bench.sim.rendering.drivers import vulkan_device
from refseq_bench.worlds.light import light_named
from tests.worlds.conftest import SMALL


def random_keys(count: int, seed: int) -> PictureKeys:
    rng = np.random.default_rng(seed)
    points = rng.uniform(0, 400, (count, 2)).astype(np.float32)
    return PictureKeys(points, rng.integers(0, 256, (count, 128), dtype=np.uint8))


def test_keys_are_found_again_in_the_same_picture_and_in_no_empty_one() -> None:
    keys, none = random_keys(30, 0), random_keys(0, 0)
    assert found_again(keys, keys, 250.0) == 1.0
    assert found_again(keys, none, 250.0) == found_again(none, keys, 250.0) == 0.0


def test_keys_count_by_word_and_place_as_pairs_tried_one_by_one() -> None:
    rng = np.random.default_rng(3)
    known = random_keys(40, 1)
    moved = known.points + rng.uniform(-4, 4, known.points.shape).astype(np.float32)
    altered = np.clip(known.descriptors + rng.normal(0, 22, (40, 128)), 0, 255).astype(np.uint8)
    order = rng.permutation(40)
    other = PictureKeys(moved[order], altered[order])
    hits = 0
    for point, descriptor in zip(*known, strict=True):
        distances = [np.linalg.norm(descriptor.astype(float) - d.astype(float)) for d in other.descriptors]
        best = int(np.argmin(distances))
        hits += distances[best] <= 250.0 and np.linalg.norm(point - other.points[best]) <= SAME_PLACE
    assert 5 < hits < 35
    assert found_again(known, other, 250.0) == hits / 40


def test_a_picture_shifted_by_more_than_the_tolerance_is_not_found() -> None:
    rng = np.random.default_rng(0)
    picture = cv2.resize(rng.integers(0, 256, (40, 50), dtype=np.uint8), (500, 400), interpolation=cv2.INTER_CUBIC)
    finder = SiftWords("camera", SiftSettings())
    keys = finder.keys(picture[:, :460])
    near, far = (finder.keys(picture[:, shift : 460 + shift]) for shift in (1, 20))
    assert found_again(keys, near, 250.0) > 0.7
    assert found_again(keys, far, 250.0) < 0.05


FOUND = [
    Recall(hour, along, camera, 50, 0.5 + hour / 100, 100 * hour)
    for hour in (8.0, 9.5)
    for along in (10.0, 20.0)
    for camera in ("camera-1", "camera-2")
]


def test_the_table_has_a_row_for_each_hour() -> None:
    table = day_table(FOUND)
    assert [str(cell) for cell in table.columns[0].cells] == ["08:00", "09:30"]
    assert [str(column.header) for column in table.columns[1:4]] == [
        "10 m\ncamera-1\n% of 50",
        "10 m\ncamera-2\n% of 50",
        "lx",
    ]
    assert [str(cell) for cell in table.columns[1].cells] == ["58", "60"]
    assert [str(cell) for cell in table.columns[3].cells] == ["800", "950"]


def test_three_places_of_two_cameras_fit_a_terminal() -> None:
    found = [
        Recall(15.0, along, camera, 200, 0.9, 46_400.0)
        for along in (24.0, 48.0, 72.0)
        for camera in ("camera-1", "camera-2")
    ]
    console = Console(width=80, record=True, file=io.StringIO())
    console.print(day_table(found))
    text = console.export_text()
    assert "…" not in text
    assert text.split()[-9:] == ["90", "90", "46400"] * 3


def test_the_curve_has_a_panel_for_each_camera_and_one_for_the_light() -> None:
    *cameras, light = day_curve("day", FOUND).axes
    assert [len(axes.lines) for axes in (*cameras, light)] == [2, 2, 2]
    np.testing.assert_allclose(cameras[0].lines[0].get_ydata(), [58, 59.5])
    np.testing.assert_allclose(light.lines[1].get_ydata(), [800, 950])


ROOM = """
poster = [{ name = "p", wall = "left", at = 4, style = "plots" }]
window = [{ name = "w", wall = "right", at = 4 }]
"""


def test_no_place_is_left_out_where_there_are_more_than_colours() -> None:
    many = [Recall(8.0, float(along), "camera-1", 50, 0.5, 100.0) for along in range(9)]
    assert [len(axes.lines) for axes in day_curve("day", many).axes] == [9, 9]


@pytest.mark.slow
@pytest.mark.skipif(vulkan_device() is None, reason="no Vulkan device")
def test_the_same_hour_is_found_again_and_a_night_without_lamps_is_not(tmp_path: Path) -> None:
    (tmp_path / "room.toml").write_text(SMALL.format(top=ROOM, end=""))
    lights = tuple(light_named(text) for text in ("16:00", "23:00,lamps=off"))
    drive = Drive(world=str(tmp_path / "room.toml"), light="16:00", sensors=("camera-2",))
    same, dark = through_the_day(Day(drive, lights, (3.0,)))
    assert same.keys == dark.keys > 20
    assert same.share > 0.8 > 0.1 > dark.share
    assert same.lux > 200 > 1 > dark.lux
