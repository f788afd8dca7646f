from collections.abc import Callable

import numpy as np
import pytest

import refseq_bench.worlds.build
from refseq_bench.worlds.build import World, build_world
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.lighting.ambient import AXES, CLEARANCE, EYE, Ambient, ambient
from refseq_bench.worlds.lighting.form_factors import Cards
from refseq_bench.worlds.lighting.photometry import photometry, spot_illuminance, spots
from refseq_bench.worlds.meter import Meter
from refseq_bench.worlds.plans.load import parse_plan
from tests.worlds.conftest import box, corner

Floats = np.ndarray


def sloping(cards: Cards) -> Floats:
    """Light that grows along x and y."""
    return 10.0 + 2.0 * cards.points[:, 0] + 3.0 * cards.points[:, 1]


def test_between_the_nodes_it_is_linear() -> None:
    found = ambient(parse_plan(box(8, 3)), sloping, ())
    for point in ((1.0, 0.0), (3.3, 0.7), (7.0, -1.1, 0.4)):
        assert found.at(point) == pytest.approx(10 + 2 * point[0] + 3 * point[1])
    assert found.at((100, 0)) == pytest.approx(10 + 2 * (8 - CLEARANCE))


def test_around_a_corner_it_goes_on_without_a_great_step() -> None:
    found = ambient(parse_plan(corner()), sloping, ())
    assert len(found.grids) == 2
    for y in np.linspace(-0.7, 4.7, 200):
        assert found.at((5.0, y)) == pytest.approx(10 + 2 * 5 + 3 * y, abs=3 * CLEARANCE / 2 + 1e-6)
    assert found.at((5.0, 4.0)) == pytest.approx(10 + 2 * 5 + 3 * 4)


@pytest.mark.parametrize("light", ["16:00", "late-evening"])
def test_with_the_spots_it_makes_up_all_light_but_the_sun(hallway: World, light: str) -> None:
    setting = light_named(light)
    meter, shining = Meter(hallway.plan, setting), spots(hallway.plan, photometry(hallway.plan, setting))
    found = ambient(hallway.plan, meter.for_camera, shining)
    x = float(np.linspace(CLEARANCE, 100 - CLEARANCE, found.grids[0].lux.shape[0])[17])
    point = np.array([x, 0.0, EYE])
    around = meter.for_camera(Cards(np.tile(point, (6, 1)), AXES)).mean()
    from_spots = sum(np.maximum(0, AXES @ spot_illuminance(s, point[None])[0]).sum() for s in shining) / 6
    assert found.at(point) + from_spots == pytest.approx(around, rel=1e-9)


def test_light_of_the_same_size_everywhere() -> None:
    even = Ambient.even(7.0)
    assert even.at((0.3, 0.3)) == pytest.approx(7.0)
    assert even.at((-5, 99, 3)) == pytest.approx(7.0)


def test_it_is_worked_out_once_and_only_for_who_asks(
    small: Callable[..., str], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []

    class Counted(Meter):
        def for_camera(self, cards: Cards) -> Floats:
            asked.append(cards)
            return super().for_camera(cards)

    monkeypatch.setattr(refseq_bench.worlds.build, "Meter", Counted)
    world = build_world(parse_plan(small()), light_named("16:00"))
    world.spec.compile()
    assert not asked
    assert world.ambient.at((1, 0)) == world.ambient.at((1, 0))
    assert len(asked) == 1


def test_same_plan_same_light(small: Callable[..., str]) -> None:
    plan = parse_plan(small(end='[[window]]\nname = "w"\nwall = "right"\nat = 3'))
    one, two = (build_world(plan, light_named("16:00"), seed=s).ambient for s in (0, 1))
    np.testing.assert_array_equal(one.grids[0].lux, two.grids[0].lux)
    assert one.grids[0].lux.max() > 10
