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
