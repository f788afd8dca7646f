import numpy as np

from scenarios.outline import OPENING, outline_of
from worlds.plan import load_plan


def test_walls_step_back_at_their_openings_and_cabinets_stand_out() -> None:
    plan = load_plan("hallway")
    walls, cabinets = outline_of(plan)[: len(plan.wall)], outline_of(plan)[len(plan.wall) :]
    assert len(cabinets) == len(plan.cabinet)
    for wall, line in zip(plan.wall, walls, strict=True):
        doors = [door for door in plan.door if door.wall == wall.name]
        windows = [window for window in plan.window if window.wall == wall.name]
        assert len(line) == 2 + 4 * len(doors + windows)
        np.testing.assert_allclose((line[0], line[-1]), (wall.start, wall.end), atol=1e-12)
        face = np.linalg.norm(np.diff(line, axis=0), axis=1)
        back = sum(2 * door.recess for door in doors) + 2 * OPENING * len(windows)
        assert np.isclose(face.sum(), wall.length + back)


def test_what_stands_on_the_floor_is_outlined_where_it_stands() -> None:
    plan = load_plan("car-park")
    lines = outline_of(plan)[len(plan.wall) :]
    assert len(lines) == len(plan.car)
    for car, line in zip(plan.car, lines, strict=True):
        assert line.shape == (5, 2)
        np.testing.assert_array_equal(line[0], line[-1])
        np.testing.assert_allclose(line[:4].mean(axis=0), car.at, atol=1e-9)


def test_the_outline_of_a_rectangle_goes_around_it_and_not_across() -> None:
    plan = load_plan("car-park")
    for line in outline_of(plan)[len(plan.wall) :]:
        sides = np.diff(line, axis=0)
        np.testing.assert_allclose(np.sum(sides * np.roll(sides, 1, axis=0), axis=1), 0.0, atol=1e-9)
