import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from refseq.errors import MapError
from refseq.features.alias_distance import choose_alias_distance, distances_of_things

quick = settings(derandomize=True)


def drive(same: list[int], other: list[int]) -> list[np.ndarray]:
    """Thing i stands at (1000 i, 0, 0), is seen again ``same[i]`` beside it, and half the drive away is its like."""
    corners = np.array([[1000.0 * i, 0, 0] for i in range(len(same))])
    again = corners + [[0, distance, 0] for distance in same]
    alike = corners + [[0, 0, distance] for distance in other]
    nothing = np.zeros((0, 3))
    return [corners, again, nothing, alike, nothing, nothing]


def by_hand(same: list[int], other: list[int], precision: float) -> float | None:
    valid = []
    for t in same + other:
        right, wrong = sum(s <= t for s in same), sum(o <= t for o in other)
        if right >= precision * (right + wrong):
            valid.append(t)
    return max(valid, default=None)


distances = st.lists(st.tuples(st.integers(0, 90), st.integers(0, 90)), min_size=2, max_size=30)


@quick
@given(distances, st.sampled_from([0.5, 0.6, 0.75, 0.9, 1.0]))
def test_the_largest_precise_distance_is_chosen(pairs: list[tuple[int, int]], precision: float) -> None:
    same, other = ([pair[k] for pair in pairs] for k in (0, 1))
    expected = by_hand(same, other, precision)
    if expected is None:
        with pytest.raises(MapError, match=f"no alias distance has precision {precision:g}"):
            choose_alias_distance(drive(same, other), precision)
    else:
        assert choose_alias_distance(drive(same, other), precision) == pytest.approx(expected)


def sights(things: np.ndarray, noise: float, rng: np.random.Generator) -> np.ndarray:
    return np.clip(things + rng.normal(0, noise, things.shape), 0, 255).astype(np.uint8)


def corridor(seed: int, count: int = 30, each: int = 40, noise: float = 12.0, alike: float = 22.0) -> list[np.ndarray]:
    """Every view shares half its things with the next; all things are variants of a dozen kinds."""
    rng = np.random.default_rng(seed)
    kinds = np.random.default_rng(77).integers(40, 216, (12, 128))
    things = kinds[rng.integers(0, 12, count * each)] + rng.normal(0, alike, (count * each, 128))
    return [sights(things[k * each // 2 : k * each // 2 + each], noise, rng) for k in range(count)]


def test_the_distance_keeps_its_promise_on_another_drive() -> None:
    """Sights of one thing differ by about 12 √256 = 192, of its likes by √(2 · 22² + 2 · 12²) √128 = 401."""
    chosen = [choose_alias_distance(corridor(1), precision) for precision in (0.99, 0.9, 0.7)]
    assert chosen == sorted(chosen)
    assert all(212 < distance < 380 for distance in chosen)
    same, other = distances_of_things(corridor(2))
    for distance, precision in zip(chosen, (0.99, 0.9, 0.7), strict=True):
        right, wrong = np.sum(same <= distance), np.sum(other <= distance)
        assert right / (right + wrong) == pytest.approx(precision, abs=0.03)


def test_what_passes_the_ratio_test_is_the_same_thing() -> None:
    """Each of 29 pairs of views shares 20 of 40 things; now and then a thing's like stands in for it."""
    same, other = distances_of_things(corridor(3))
    assert len(other) == len(same)
    assert 0.95 * 29 * 20 < np.sum(same < 250) <= 29 * 20
    assert np.mean(same < 250) > 0.85
    assert np.mean(other < 250) < 0.02


@pytest.mark.parametrize("views", [[], [np.ones((5, 3))] * 3, [np.zeros((0, 3))] * 9, [np.ones((1, 3))] * 9])
def test_a_drive_that_shows_nothing_twice_is_an_error(views: list[np.ndarray]) -> None:
    with pytest.raises(MapError, match=f"an alias distance cannot be chosen: {len(views)} views show nothing twice"):
        choose_alias_distance(views)


def test_long_drives_are_sampled() -> None:
    views = corridor(4, count=260, each=12)
    same, _ = distances_of_things(views)
    assert len(same) < 100 * 12
    assert choose_alias_distance(views) == pytest.approx(choose_alias_distance(views[:80]), abs=25)
