"""``refseq merge``: maps to an atlas, a person's decisions, and what is wrong told in one line."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from refseq.atlas.merge import Decision
from refseq.map.learning import learn
from refseq.map.map import Map
from refseq.map.profile import BEST, THESIS
from refseq.view import LASER
from scenarios.maps.joins import BY_A_PERSON, decision_table, read_decisions, write_decisions
from tests.scenarios.conftest import Refseq
from tests.support import corridor_drive


@pytest.fixture(scope="module")
def maps(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Maps of the two halves of a drive, which share 12 views, and some that do not go with them."""
    folder = tmp_path_factory.mktemp("maps")
    drive = corridor_drive(np.random.default_rng(1), count=44, size=96)
    learn(drive[:28], profile=BEST).save(folder / "west.refseq")
    learn(drive[16:], profile=BEST).save(folder / "east.refseq")
    learn(drive[:5], profile=THESIS).save(folder / "thesis.refseq")
    learn(drive[:5], profile=BEST, sensors=["forward", LASER]).save(folder / "one-eye.refseq")
    learn(drive[:5], profile=replace(BEST, sift=replace(BEST.sift, cap=7))).save(folder / "seven.refseq")
    (folder / "cut.refseq").write_bytes((folder / "east.refseq").read_bytes()[:5000])
    return folder


@pytest.fixture
def here(maps: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(maps)
    return maps


DECISIONS: Sequence[Decision] = (
    Decision("a", 'b "quoted"', (0, 5), (3, 8), (4.25, 4.5), True, "6 views lead to each other"),
    Decision("a", "c", (1, 1), (0, 0), (0.0, 0.0), False, "only 0.0 m long"),
)


def test_two_maps_become_an_atlas(refseq: Refseq, here: Path) -> None:
    answer = refseq("merge", "west.refseq", "east.refseq", "-o", "atlas.refseq", "--log", "joins.toml")
    assert (answer.code, answer.err) == (0, "")
    atlas = Map.load(here / "atlas.refseq")
    # Of the last 12 views of the one and the first 12 of the other one dozen is left, but for a view at either end.
    assert 42 <= len(atlas) <= 46
    links = len(atlas.links)
    assert (
        answer.out.splitlines()[-1]
        == f"atlas.refseq: 2 paths, {len(atlas)} places of 56, {links} links, 1 of 1 stretches joined"
    )
    assert links in (1, 2)
    assert [path.name for path in atlas.paths] == ["west", "east"]
    (decision,) = read_decisions(here / "joins.toml")
    assert decision.joined
    assert np.abs(np.subtract(decision.first, (16, 27))).max() <= 2


def test_a_person_refuses_and_adds_joins_by_the_file(refseq: Refseq, here: Path) -> None:
    refuse = Decision("west", "east", (14, 27), (0, 11), (0, 0), False, "")
    write_decisions(here / "no.toml", [refuse])
    answer = refseq("merge", "west.refseq", "east.refseq", "-o", "two.refseq", "--decisions", "no.toml")
    assert answer.code == 0
    assert "refused" in answer.out
    assert len(Map.load(here / "two.refseq")) == 56
    write_decisions(here / "yes.toml", [refuse, Decision("west", "east", (0, 5), (20, 25), (0, 0), True, "")])
    answer = refseq("merge", "west.refseq", "east.refseq", "-o", "two.refseq", "--decisions", "yes.toml")
    assert answer.code == 0
    assert len(Map.load(here / "two.refseq")) == 50


def test_an_atlas_can_be_added_to(refseq: Refseq, here: Path) -> None:
    refseq("merge", "west.refseq", "-o", "atlas.refseq")
    answer = refseq("merge", "atlas.refseq", "east.refseq", "-o", "larger.refseq")
    assert answer.code == 0
    refseq("merge", "west.refseq", "east.refseq", "-o", "at-once.refseq")
    assert (here / "larger.refseq").read_bytes() == (here / "at-once.refseq").read_bytes()


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("west.refseq none.refseq -o x.refseq", "none.refseq: cannot be read: No such file or directory"),
        ("west.refseq west.refseq -o x.refseq", "path 'west' is there twice; valid are names of their own"),
        ("west.refseq thesis.refseq -o x.refseq", "thesis.refseq: features are sift/forward"),
        ("west.refseq one-eye.refseq -o x.refseq", "one-eye.refseq: features are sift/forward, dense/forward, walls"),
        ("west.refseq east.refseq seven.refseq -o x.refseq", "seven.refseq: profile.sift"),
        ("west.refseq east.refseq cut.refseq -o x.refseq", "cut.refseq: is not a .refseq map, or is damaged"),
        ("cut.refseq west.refseq -o x.refseq", "cut.refseq: is not a .refseq map, or is damaged"),
        (
            "west.refseq east.refseq -o x.refseq --log x.refseq",
            "x.refseq: is the atlas and the log at once; valid are two files",
        ),
        ("west.refseq east.refseq -o no/x.refseq", "no/x.refseq: cannot be written: there is no folder no"),
        ("west.refseq east.refseq -o x.refseq --least -1", "overlap.least is -1.0 m; valid is 0 or more"),
        ("west.refseq east.refseq -o x.refseq --decisions bad.toml", "bad.toml: is no TOML"),
        ("west.refseq east.refseq -o x.refseq --decisions odd.toml", "bad.toml"),
    ],
)
def test_what_is_wrong_is_told_in_one_line(refseq: Refseq, here: Path, words: str, told: str) -> None:
    (here / "bad.toml").write_text("[[join")
    write_decisions(here / "odd.toml", [Decision("west", "moon", (0, 1), (0, 1), (0, 0), True, "")])
    answer = refseq("merge", *words.split())
    assert (answer.code, answer.out) == (2, "")
    assert len(answer.err.splitlines()) == 1
    if "odd" in words:
        told = "decisions: sequence 'moon' is unknown; valid are west, east"
    assert answer.err.startswith(f"error: {told}")
    assert not (here / "x.refseq").exists()


@pytest.mark.parametrize("spoilt", [0, 3, 7])
def test_one_corrupt_map_among_eight_is_named_and_nothing_is_written(
    refseq: Refseq, maps: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, spoilt: int
) -> None:
    monkeypatch.chdir(tmp_path)
    whole = (maps / "west.refseq").read_bytes()
    for number in range(8):
        at = len(whole) // 2
        (tmp_path / f"{number}.refseq").write_bytes(
            whole[:at] + bytes([whole[at] ^ 255]) + whole[at + 1 :] if number == spoilt else whole
        )
    (tmp_path / "old.toml").write_text("an older log")
    answer = refseq("merge", *sorted(tmp_path.glob("*.refseq")), "-o", "atlas.refseq", "--log", "old.toml")
    assert (answer.code, answer.out) == (2, "")
    assert answer.err.startswith(f"error: {tmp_path / f'{spoilt}.refseq'}: ")
    assert len(answer.err.splitlines()) == 1
    assert not (tmp_path / "atlas.refseq").exists()
    assert (tmp_path / "old.toml").read_text() == "an older log"


@pytest.mark.parametrize("joined", [True, False])
@pytest.mark.parametrize(
    ("one", "other", "first", "second", "told"),
    [
        ("west", "east", (100, 120), (0, 5), "'west' has no views 100 to 120; valid are 0 to 27"),
        ("west", "east", (20, 28), (0, 5), "'west' has no views 20 to 28; valid are 0 to 27"),
        ("west", "east", (0, 5), (7, 10**30), "'east' has no views 7 to 1" + 30 * "0" + "; valid are 0 to 27"),
        ("east", "west", (0, 5), (0, 5), "'east' comes first in 'east' and 'west'; valid is 'west', which is merged"),
        ("west", "west", (0, 5), (9, 15), "'west' is one and other; valid are two sequences"),
    ],
)
def test_decisions_about_what_is_not_there(
    refseq: Refseq,
    here: Path,
    one: str,
    other: str,
    first: tuple[int, int],
    second: tuple[int, int],
    told: str,
    joined: bool,
) -> None:
    """None of them would ever have held, or not for the views that it names."""
    write_decisions(here / "odd.toml", [Decision(one, other, first, second, (0, 0), joined, "")])
    answer = refseq("merge", "west.refseq", "east.refseq", "-o", "x.refseq", "--decisions", "odd.toml")
    assert (answer.code, answer.out) == (2, "")
    assert answer.err.startswith(f"error: decisions: {told}")
    assert len(answer.err.splitlines()) == 1
    assert not (here / "x.refseq").exists()


def test_a_map_that_does_not_go_with_the_others_is_refused_before_any_is_merged(
    refseq: Refseq, here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def begun(*_: object) -> None:
        pytest.fail("a merge was begun")

    monkeypatch.setattr("refseq.atlas.merge.added", begun)
    answer = refseq("merge", "west.refseq", "east.refseq", "one-eye.refseq", "-o", "x.refseq")
    assert answer.code == 2
    assert answer.err.startswith("error: one-eye.refseq: features are ")


def test_decisions_are_read_as_they_were_written(tmp_path: Path) -> None:
    write_decisions(tmp_path / "joins.toml", DECISIONS)
    read = read_decisions(tmp_path / "joins.toml")
    assert [d.why for d in read] == [BY_A_PERSON] * 2
    for one, other in zip(read, DECISIONS, strict=True):
        assert (one.one, one.other, one.first, one.second) == (other.one, other.other, other.first, other.second)
        assert one.joined is other.joined
    assert decision_table(DECISIONS).row_count == 2


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[[join]]\none = 3\n", "join.0.one = 3: input should be a valid string"),
        ("[[join]]\none = 'a'\n", "join.0.other = "),
        ("joins = 1\n", "joins = 1: extra inputs are not permitted"),
        (
            "[[join]]\none='a'\nother='b'\nfirst=[3,1]\nsecond=[0,1]\njoined=true\n",
            "join.0.first = [3, 1]; valid is first view, last view",
        ),
    ],
)
def test_decisions_that_are_none(refseq: Refseq, here: Path, text: str, told: str) -> None:
    (here / "wrong.toml").write_text(text)
    answer = refseq("merge", "west.refseq", "east.refseq", "-o", "x.refseq", "--decisions", "wrong.toml")
    assert answer.code == 2
    assert answer.err.startswith(f"error: wrong.toml: {told}")
    assert len(answer.err.splitlines()) == 1


def test_two_maps_are_compared_and_drawn_without_being_merged(refseq: Refseq, here: Path) -> None:
    answer = refseq("similarity", "west.refseq", "east.refseq", "-o", "alike.png", "--arrays", "alike.npz")
    assert (answer.code, answer.err) == (0, "")
    assert "joined" in answer.out
    assert answer.out.splitlines()[-2:] == ["alike.npz", "alike.png"]
    with np.load(here / "alike.npz") as arrays:
        there, back = arrays["there"], arrays["back"]
    assert (there.shape, back.shape) == ((28, 28), (28, 28))
    assert there.sum(axis=1) == pytest.approx(np.ones(28))
    # View 16 + k of the one is view k of the other.
    assert np.abs(there[18:26].argmax(axis=1) - np.arange(2, 10)).max() <= 1
    image = cv2.imread(str(here / "alike.png"))
    assert image is not None
    assert image.std() > 10


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("west.refseq thesis.refseq", "thesis.refseq: features are sift/forward"),
        ("west.refseq east.refseq -o alike.txt", "alike.txt: is no picture's name"),
        (
            "west.refseq east.refseq --arrays alike.mat",
            "alike.mat: is no name for arrays; valid is one that ends in .npz",
        ),
        ("west.refseq west.refseq", "path 'west' is there twice"),
    ],
)
def test_what_cannot_be_compared_is_told(refseq: Refseq, here: Path, words: str, told: str) -> None:
    answer = refseq("similarity", *words.split())
    assert (answer.code, answer.out) == (2, "")
    assert answer.err.startswith(f"error: {told}")
    assert len(answer.err.splitlines()) == 1


def test_a_map_is_still_a_map(here: Path) -> None:
    assert len(Map.load(here / "west.refseq")) == 28
