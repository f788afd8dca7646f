"""Variations of a scenario: drawn from where they are said to be, the same each time; the file stays as it was."""

import copy
import math

import pytest

from refseq_bench.scenarios.campaign.declare.expand import Values, expanded, put

KEY = "query.light"


def drawn(count: int, seed: int, **ranges: object) -> list[Values]:
    return [values for _, values in expanded({"random": {"count": count, "seed": seed, **ranges}})]


def test_hours_are_drawn_from_the_first_to_the_last_minute() -> None:
    found = {values[KEY] for values in drawn(60, 1, **{KEY: {"from": "09:59", "to": "10:01"}})}
    assert found == {"09:59", "10:00", "10:01"}


def test_numbers_and_choices_are_drawn_from_what_is_given() -> None:
    found = drawn(200, 1, a={"from": -1, "to": 2.5}, b={"of": ["x", "y", [3]]})
    numbers = [values["a"] for values in found]
    assert -1 <= min(numbers) < -0.9
    assert 2.4 < max(numbers) <= 2.5
    assert sum(numbers) / 200 == pytest.approx(0.75, abs=4 * 3.5 / math.sqrt(12 * 200))
    assert {str(values["b"]) for values in found} == {"x", "y", "[3]"}


def test_what_is_drawn_follows_from_the_seed_alone() -> None:
    ranges = {"a": {"from": 0, "to": 1}, KEY: {"from": "08:00", "to": "18:00"}}
    assert drawn(5, 1, **ranges) == drawn(5, 1, **ranges) == drawn(9, 1, **ranges)[:5]
    assert drawn(5, 1, **ranges) != drawn(5, 2, **ranges)


def test_a_case_shares_with_the_file_all_but_what_it_changes():
    table = {"seeds": [1, 2], "query": {"light": "08:00", "cameras": {"left": "a"}}, "further": [{"light": "1"}, {}]}
    before = copy.deepcopy(table)
    changed = put(table, {"query.light": "16:00", "query.cameras.right": "b", "further.0.light": "2", "new.key": 3})
    assert changed == {
        "seeds": [1, 2],
        "query": {"light": "16:00", "cameras": {"left": "a", "right": "b"}},
        "further": [{"light": "2"}, {}],
        "new": {"key": 3},
    }
    assert table == before
    assert changed["seeds"] is table["seeds"]


def test_a_list_at_every_combination_of_a_grid_whichever_is_written_first() -> None:
    grid = {"query.light": ["noon", "18:00"], "reference.robot": ["robuter"]}
    listed = [{"name": "there", "reference.route": "forward"}, {"reference.route": "reverse"}]
    cases = expanded({"list": listed, "grid": grid})
    assert cases == expanded({"grid": grid, "list": listed})
    assert [name for name, _ in cases] == [
        "there,noon,robuter",
        "there,18:00,robuter",
        "reverse,noon,robuter",
        "reverse,18:00,robuter",
    ]
    assert cases[-1][1] == {"reference.route": "reverse", "query.light": "18:00", "reference.robot": "robuter"}
