"""Light that was kept is the light that was baked, to the last bit; whatever it depends on makes it anew."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from refseq_bench.sim.rendering.baked import kept_light
from refseq_bench.sim.rendering.baked.kept_light import kept
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.lighting.baking import Baked, Shell, world_light
from refseq_bench.worlds.lighting.form_factors import Cards
from refseq_bench.worlds.lighting.photometry import photometry
from refseq_bench.worlds.plans.load import parse_plan
from tests.worlds.conftest import SMALL

RNG = np.random.default_rng(1)
CARDS = Cards(RNG.normal(size=(5, 3)), RNG.normal(size=(5, 3)))
OTHERS = Cards(RNG.normal(size=(2, 3)), RNG.normal(size=(2, 3)))
SHELL = Shell(RNG.normal(size=(3, 3, 3)), RNG.uniform(size=3), CARDS, np.array([[0, 1, 2], [1, 2, 3], [2, 3, 4]]))


class Bakery:
    """Bakes at random, so that what was baked twice differs."""

    def __init__(self) -> None:
        self.baked = 0

    def __call__(self, shell: Shell, others: Cards) -> Baked:
        self.baked += 1
        count = len(shell.cards)
        return Baked(RNG.uniform(size=count), RNG.uniform(size=count) > 0.5, RNG.uniform(size=len(others)))


def equal(one: Baked, other: Baked) -> bool:
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in ("lux", "buried", "around"))


def test_it_is_baked_once(tmp_path: Path) -> None:
    bakery = Bakery()
    first = kept(bakery, tmp_path / "new" / "light", "plan")(SHELL, OTHERS)
    again = kept(bakery, tmp_path / "new" / "light", "plan")(SHELL, OTHERS)
    assert bakery.baked == 1
    assert equal(first, again)


@pytest.mark.parametrize(
    "other",
    [
        (replace(SHELL, albedo=SHELL.albedo + 1e-15), OTHERS, "plan"),
        (replace(SHELL, cards=Cards(CARDS.points, -CARDS.normals)), OTHERS, "plan"),
        (SHELL, Cards(OTHERS.normals, OTHERS.points), "plan"),
        (SHELL, OTHERS, "plan in other light"),
    ],
)
def test_another_shell_other_cards_or_another_light_is_baked_anew(
    tmp_path: Path, other: tuple[Shell, Cards, str]
) -> None:
    bakery = Bakery()
    kept(bakery, tmp_path, "plan")(SHELL, OTHERS)
    shell, cards, about = other
    kept(bakery, tmp_path, about)(shell, cards)
    assert bakery.baked == 2


LIT = SMALL.format(
    top="",
    end="""[[window]]
name = "w"
wall = "right"
at = 4
[[lamp]]
name = "l"
first = [2, 0]
step = [2, 0]
count = 3
lumen = 4000
switch = "always"
""",
)


@pytest.mark.parametrize(
    ("was", "became", "light", "baked"),
    [
        ('name = "small"', 'name = "large"', "18:00", 1),
        ("[[1, 0], [7, 0]]", "[[2, 0], [6, 0]]", "18:00", 1),
        ('name = "w"', 'name = "w2"', "18:00", 1),
        ("[[lamp]]", '[[person]]\nname = "p"\nat = [3, 0]\nwalk = [[5, 0]]\n[[lamp]]', "18:00", 1),
        ("count = 3", "count = 2", "18:00", 2),
        ("lumen = 4000", "lumen = 4001", "18:00", 2),
        ("at = 4", "at = 4.01", "18:00", 2),
        ("x_azimuth = 110", "x_azimuth = 111", "18:00", 2),
        ("", "", "18:00,cloud=1", 2),
        ("", "", "18:00,lamps=off", 2),
    ],
)
def test_a_plan_is_baked_anew_where_another_light_shines_and_not_for_who_walks_there(
    tmp_path: Path, was: str, became: str, light: str, baked: int
) -> None:
    bakery = Bakery()
    for text, named in ((LIT, "18:00"), (LIT.replace(was, became), light)):
        plan = parse_plan(text)
        kept(bakery, tmp_path, world_light(plan, photometry(plan, light_named(named))))(SHELL, OTHERS)
    assert bakery.baked == baked


def test_other_code_bakes_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bakery = Bakery()
    kept(bakery, tmp_path)(SHELL, OTHERS)
    monkeypatch.setattr(kept_light, "_code", lambda: "another")
    kept(bakery, tmp_path)(SHELL, OTHERS)
    assert bakery.baked == 2


@pytest.mark.parametrize("content", [b"", b"PK\3\4", b"no light", None])
def test_a_damaged_file_is_made_anew(tmp_path: Path, content: bytes | None) -> None:
    bakery = Bakery()
    light = kept(bakery, tmp_path)
    light(SHELL, OTHERS)
    (file,) = tmp_path.glob("*.npz")
    if content is None:
        np.savez(file, lux=np.zeros(4), buried=np.zeros(5, bool), around=np.zeros(2))
    else:
        file.write_bytes(content)
    whole = light(SHELL, OTHERS)
    assert bakery.baked == 2
    assert equal(light(SHELL, OTHERS), whole)
    assert bakery.baked == 2


def test_no_byte_can_be_damaged_so_that_reading_fails(tmp_path: Path) -> None:
    """Bytes have their bits turned round, one after the other."""
    file = tmp_path / "light.npz"
    light = Baked(RNG.uniform(size=5), RNG.uniform(size=5) > 0.5, RNG.uniform(size=2))
    kept_light._keep(file, light)
    whole = file.read_bytes()
    for place in range(len(whole)):
        file.write_bytes(whole[:place] + bytes([whole[place] ^ 0xFF]) + whole[place + 1 :])
        read = kept_light._read(file, 5, 2)
        assert read is None or equal(read, light), f"byte {place}"


def test_where_nothing_can_be_kept_it_is_baked_each_time(tmp_path: Path) -> None:
    bakery = Bakery()
    (tmp_path / "light").write_text("a file where a folder belongs")
    for _ in range(2):
        kept(bakery, tmp_path / "light")(SHELL, OTHERS)
    assert bakery.baked == 2


def test_what_was_not_used_for_longest_is_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kept_light, "KEPT", 2)
    bakery, asked = Bakery(), iter(range(100, 200))

    def ask(about: str) -> None:
        before = set(tmp_path.glob("*.npz"))
        kept(bakery, tmp_path, about)(SHELL, OTHERS)
        now = next(asked)
        for file in set(tmp_path.glob("*.npz")) - before or [max(before, key=lambda one: one.stat().st_mtime)]:
            os.utime(file, (now, now))

    for about in ("a", "b", "a", "c"):
        ask(about)
    ask("a")
    assert (bakery.baked, len(list(tmp_path.glob("*.npz")))) == (3, 2)
    ask("b")
    assert bakery.baked == 4
