import numpy as np

from refseq_bench.worlds.drawing.outline import OPENING, outline_of
from refseq_bench.worlds.plans.frame import LocalFrame
from refseq_bench.worlds.plans.load import load_plan


def test_walls_step_back_at_their_openings_and_cabinets_stand_out() -> None:
    plan = load_plan("annex")
    assert not any(door.open for door in plan.door)
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
        depth = -(line - wall.start) @ LocalFrame.of(wall).inward  # into the wall
        assert depth.min() > -1e-9
        assert np.isclose(
            depth.max(), max([*(door.recess for door in doors), *(OPENING for _ in windows)], default=0.0)
        )


def test_an_open_door_is_a_gap_with_its_leaf_beside() -> None:
    """Both hinges: the office's stands open to beyond the square, at its far jamb; the one that is ajar at the near."""
    plan = load_plan("offices")
    before, between, after, wide, ajar = outline_of(plan)[:5]
    np.testing.assert_allclose(before[-1], (11.75, 1.28))
    np.testing.assert_allclose(between[0], (12.65, 1.28))
    np.testing.assert_allclose(between[-1], (17.95, 1.28))
    np.testing.assert_allclose(after[0], (18.85, 1.28))
    np.testing.assert_allclose(wide[0], (12.65, 1.28))
    np.testing.assert_allclose(ajar[0], (17.95, 1.28))
    assert wide[1][0] > 12.65, "by 105 degrees"
    assert 17.95 < ajar[1][0] < 18.85, "by 40 degrees"
    assert min(wide[1][1], ajar[1][1]) > 1.28, "away from the corridor"
    for leaf in (wide, ajar):
        assert np.isclose(np.linalg.norm(leaf[1] - leaf[0]), 0.9)


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
