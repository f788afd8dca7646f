"""``refseq map merge | compact | similarity | route``: joins, a person's decisions, legs, and mistakes in one line."""

import json
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from playwright.sync_api import Browser

from refseq.atlas.decision import Decision
from refseq.atlas.found import FoundOverlap
from refseq.atlas.merge import Merged, merge_maps
from refseq.atlas.overlap import Overlap
from refseq.atlas.routes import Leg, Route, islands
from refseq.logs import RecordingWriter
from refseq.map.learning import learn
from refseq.map.map import Map, beside
from refseq.map.merge_record import NOT_MERGED
from refseq.map.profile import BEST, THESIS
from refseq.planar import Pose
from refseq.view import LASER
from refseq_bench.scenarios.cli.terminal.console import out
from refseq_bench.scenarios.maps import similarity
from refseq_bench.scenarios.maps.joins import BY_A_PERSON, decision_table, read_decisions, write_decisions
from refseq_bench.scenarios.maps.joins_page import worst_first
from refseq_bench.scenarios.maps.routes import leg_table
from refseq_bench.scenarios.tables import plural
from tests.refseq.rooms import named_maps
from tests.scenarios.conftest import Answer, Refseq
from tests.support import corridor_drive

SPACING = 0.85
EYE = ["forward", LASER]
"""One camera: a merge compares all places by all that was seen of them."""


@pytest.fixture(scope="module")
def maps(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Maps of the two halves of a drive, which share 12 views, and some that do not go with them."""
    folder = tmp_path_factory.mktemp("maps")
    drive = corridor_drive(np.random.default_rng(1), count=44, spacing=SPACING, size=96)
    names, halves = ["west", "east"], [learn(part, profile=BEST, sensors=EYE) for part in (drive[:28], drive[16:])]
    for name, half in zip(names, halves, strict=True):
        half.save(folder / f"{name}.refseq")
    merge_maps(named_maps(names, halves)).map.save(folder / "atlas.refseq")
    beside(named_maps(names, halves)).save(folder / "apart.refseq")
    (folder / "text.refseq").write_text("no map")
    learn(drive[:5], profile=THESIS).save(folder / "thesis.refseq")
    learn(drive[:5], profile=BEST, sensors=["lateral", LASER]).save(folder / "other-eye.refseq")
    learn(drive[:5], profile=replace(BEST, sift=replace(BEST.sift, cap=7)), sensors=EYE).save(folder / "seven.refseq")
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


def test_a_compact_map_is_smaller_and_says_so(refseq: Refseq, here: Path) -> None:
    answer = refseq("map", "compact", "west.refseq", "-o", "small.refseq", "--alike", "1")
    assert (answer.code, answer.err) == (0, "")
    small, whole = Map.load(here / "small.refseq"), Map.load(here / "west.refseq")
    assert len(small) == len(whole)
    assert small.metadata["compacted"] == "places at most 1 apart, within 2 m"
    share = round(100 * (here / "small.refseq").stat().st_size / len(whole.to_bytes()))
    assert share < 95
    assert re.fullmatch(
        rf"small\.refseq: \d+ of 28 places are told apart, {share} % of the bytes", answer.out.splitlines()[-1]
    )
    sizes = json.loads(refseq("map", "compact", "west.refseq", "-o", "small.refseq", "--alike", "0", "--json").out)
    assert sizes["before"]["distinct"] == sizes["after"]["distinct"] == 28


@pytest.mark.parametrize("wrong", [["--alike", "1.5"], ["--within", "-1"], ["--alike", "nan"]])
def test_shares_and_metres_that_are_none(refseq: Refseq, here: Path, wrong: list[str]) -> None:
    answer = refseq("map", "compact", "west.refseq", "-o", "none.refseq", *wrong)
    assert answer.code == 2
    assert not (here / "none.refseq").exists()


@pytest.fixture(scope="module")
def query(maps: Path) -> Path:
    """A later drive through the first half, darker, with odometry."""
    views = corridor_drive(np.random.default_rng(2), count=44, spacing=SPACING, size=96, brightness=0.8)[:20]
    path, way = maps / "query.mcap", 0.0
    with RecordingWriter(path, {}) as writer:
        for view in views:
            way += view.distance
            writer.write(view, Pose(way, 0.0, 0.0))
    return path


def test_the_best_paths_of_a_drive_are_listed_with_their_shares(refseq: Refseq, here: Path, query: Path) -> None:
    words = ("map", "paths", "west.refseq", query.name, "--count", "3")
    found = json.loads(refseq(*words, "--json").out)
    assert len(found["paths"]) == len(found["shares"]) == 3
    assert found["shares"] == sorted(found["shares"], reverse=True)
    assert 0 < sum(found["shares"]) <= 1
    assert 0 <= found["told"] <= found["unknown"]
    assert [len(path["states"]) for path in found["paths"]] == [20] * 3
    answer = refseq(*words, "--durations", "1", "--second-order", "0.5")
    assert (answer.code, answer.err) == (0, "")
    told = f"20 views tell {found['told']:.1f} of {found['unknown']:.1f} bits of the path"
    assert answer.out.splitlines()[-1].startswith(told)


@pytest.mark.slow
def test_features_are_seen_again_as_channels_that_tell_no_more_than_there_is(
    refseq: Refseq, here: Path, query: Path
) -> None:
    words = ("map", "channel", "west.refseq", query.name)
    found = json.loads(refseq(*words, "--json").out)
    assert found["places"] == 28
    assert {"sift/forward", "walls/laser"} <= {kind["name"] for kind in found["kinds"]}
    for kind in found["kinds"]:
        assert 0 <= kind["capacity"] <= kind["z_capacity"] <= 1
        assert kind["told"]["bits"] <= np.log2(28)
    answer = refseq(*words)
    assert (answer.code, answer.err) == (0, "")
    assert "west.refseq ← query.mcap: features as channels" in answer.out


def test_two_maps_become_an_atlas(refseq: Refseq, here: Path) -> None:
    answer = refseq(
        "map", "merge", "west.refseq", "east.refseq", "-o", "whole.refseq", "--write-decisions", "joins.toml"
    )
    assert (answer.code, answer.err) == (0, "")
    atlas = Map.load(here / "whole.refseq")
    # Of the last 12 views of the one and the first 12 of the other one dozen is left, but for a view at either end.
    assert 42 <= len(atlas) <= 46
    links = len(atlas.links)
    assert (
        answer.out.splitlines()[-1]
        == f"whole.refseq: 2 paths, {len(atlas)} places of 56, {plural(links, 'link')}, 1 of 1 stretch joined"
    )
    assert links in (1, 2)
    assert [path.name for path in atlas.paths] == ["west", "east"]
    told = here / "joins.toml"
    assert read_decisions(told).persons == [], "what the machine did is no word of a person"
    told.write_text(told.read_text().replace("joined = true", "joined = false"))
    (turned,) = read_decisions(told).persons
    assert not turned.joined
    assert np.abs(np.subtract(turned.first, (16, 27))).max() <= 2
    refseq("map", "merge", "west.refseq", "east.refseq", "-o", "apart.refseq", "--decisions", "joins.toml")
    assert len(Map.load(here / "apart.refseq")) == 56


def test_the_shortest_overlap_that_was_asked_for_is_remembered_as_decisions_are(refseq: Refseq, here: Path) -> None:
    """The two share 10 m: too little where 20 m are asked for, until another number is."""
    merge = ("map", "merge")
    assert refseq(*merge, "west.refseq", "east.refseq", "-o", "long.refseq", "--min-overlap", "20").code == 0
    assert refseq(*merge, "long.refseq", "-o", "again.refseq").code == 0
    again = Map.load(here / "again.refseq")
    assert (len(again), again.record.min_overlap) == (56, 20.0)
    assert refseq(*merge, "again.refseq", "-o", "short.refseq", "--min-overlap", "5").code == 0
    short = Map.load(here / "short.refseq")
    assert len(short) < 50
    assert short.record.min_overlap == 5.0
    answer = refseq(*merge, "long.refseq", "short.refseq", "-o", "x.refseq")
    told = "the maps were merged with --min-overlap 5 and 20; valid is to give one for all of them"
    assert (answer.code, answer.out, answer.err) == (2, "", f"error: {told}\n")


@pytest.mark.slow
def test_the_machines_decisions_given_back_pin_nothing(refseq: Refseq, here: Path) -> None:
    words = ["map", "merge", "west.refseq", "east.refseq", "-o", "two.refseq"]
    assert refseq(*words, "--write-decisions", "joins.toml").code == 0
    assert refseq(*words, "--decisions", "joins.toml").code == 0
    assert Map.load(here / "two.refseq").record.rulings == ()
    # Without what the machine said it is a person's.
    told = here / "joins.toml"
    told.write_text("".join(line for line in told.open() if not line.startswith("machine")))
    assert refseq(*words, "--decisions", "joins.toml", "--write-decisions", "later.toml").code == 0
    (ruling,) = Map.load(here / "two.refseq").record.rulings
    assert ruling.joined
    (kept,) = read_decisions(here / "later.toml").persons
    assert (kept.first, kept.second) == (ruling.first, ruling.second)


@pytest.mark.slow
def test_a_join_of_ones_own_is_taken_again_from_the_file_that_tells_of_it(refseq: Refseq, here: Path) -> None:
    """Its stretches differ in length, and it names the later map first."""
    write_decisions(here / "own.toml", [Decision("east", "west", (2, 8), (17, 24), (0, 0), True, BY_A_PERSON)])
    words = ["map", "merge", "west.refseq", "east.refseq", "-o", "own.refseq", "--decisions"]
    assert refseq(*words, "own.toml", "--write-decisions", "told.toml").code == 0
    assert refseq(*words, "told.toml").err == ""


def test_decisions_about_other_maps_of_the_same_names_are_refused(refseq: Refseq, here: Path) -> None:
    words = ["map", "merge", "west.refseq", "east.refseq"]
    assert refseq(*words, "-o", "whole.refseq", "--write-decisions", "joins.toml").code == 0
    text = (here / "joins.toml").read_text().replace("joined = true", "joined = false")
    found = re.search(r"lengths_m = \[(\d+\.\d+)", text)
    assert found
    (here / "joins.toml").write_text(text.replace(found[0], f"lengths_m = [{float(found[1]) + 0.5:.2f}", 1))
    answer = refseq(*words, "-o", "x.refseq", "--decisions", "joins.toml")
    assert (answer.code, answer.out) == (2, "")
    assert f"'west' are {found[1]}" in answer.err
    assert answer.err.endswith("or a join without lengths_m where you changed its views\n")
    assert not (here / "x.refseq").exists()


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ((r"second = .*", "second = [0, 470]"), "'east' has no views 0 to 470; valid are 0 to 27"),
        ((r"second = .*", "second = [0, 5]"), "views 0 to 5 of 'east' are "),
        (('other = "east"', 'other = "north"'), "sequence 'north' is unknown; valid are west, east"),
    ],
)
def test_a_machines_decision_that_a_person_changed_is_not_passed_over(
    refseq: Refseq, here: Path, change: tuple[str, str], told: str
) -> None:
    words = ["map", "merge", "west.refseq", "east.refseq", "-o", "x.refseq"]
    west, east = (Map.load(here / f"{name}.refseq").paths[0].along for name in ("west", "east"))
    lengths = float(west[27] - west[16]), float(east[11] - east[0])
    write_decisions(here / "joins.toml", [Decision("west", "east", (16, 27), (0, 11), lengths, True, "it agrees")])
    text = (here / "joins.toml").read_text()
    assert "machine = true" in text
    (here / "joins.toml").write_text(re.sub(*change, text))
    answer = refseq(*words, "--decisions", "joins.toml")
    assert (answer.code, answer.out, len(answer.err.splitlines())) == (2, "", 1)
    assert answer.err.startswith(f"error: decisions: {told}")
    assert not (here / "x.refseq").exists()


def test_decisions_about_paths_of_any_name_come_back(tmp_path: Path) -> None:
    names = "ä😀\x7f", 'a "b"\n'
    write_decisions(tmp_path / "joins.toml", [Decision(*names, (0, 5), (1, 6), (4.0, 4.5), True, "😀")])
    (machine,) = read_decisions(tmp_path / "joins.toml").machines
    assert (machine.one, machine.other) == names


def test_a_machines_decision_without_its_lengths_is_a_persons(tmp_path: Path) -> None:
    write_decisions(tmp_path / "joins.toml", DECISIONS)
    text = (tmp_path / "joins.toml").read_text()
    assert len(read_decisions(tmp_path / "joins.toml").machines) == 2
    (tmp_path / "joins.toml").write_text(re.sub(r"lengths_m = .*\n", "", text, count=1))
    persons, machines = read_decisions(tmp_path / "joins.toml")
    assert [(one.sides, one.lengths, one.why) for one in persons] == [(DECISIONS[0].sides, (0, 0), BY_A_PERSON)]
    assert [one.sides for one in machines] == [DECISIONS[1].sides]


@pytest.mark.slow
def test_a_person_refuses_and_adds_joins_by_the_file(refseq: Refseq, here: Path) -> None:
    refuse = Decision("west", "east", (14, 27), (0, 11), (0, 0), False, BY_A_PERSON)
    write_decisions(here / "no.toml", [refuse])
    answer = refseq("map", "merge", "west.refseq", "east.refseq", "-o", "two.refseq", "--decisions", "no.toml")
    assert answer.code == 0
    assert "refused" in answer.out
    assert len(Map.load(here / "two.refseq")) == 56
    write_decisions(here / "yes.toml", [refuse, Decision("west", "east", (0, 5), (20, 25), (0, 0), True, BY_A_PERSON)])
    answer = refseq("map", "merge", "west.refseq", "east.refseq", "-o", "two.refseq", "--decisions", "yes.toml")
    assert answer.code == 0
    assert len(Map.load(here / "two.refseq")) == 50


@pytest.fixture(scope="module")
def third(maps: Path) -> Path:
    """A third drive, over the middle of both."""
    drive = corridor_drive(np.random.default_rng(1), count=44, spacing=SPACING, size=96)
    learn(drive[10:36], profile=BEST, sensors=EYE).save(maps / "middle.refseq")
    return maps


def content(file: Path) -> bytes:
    """A map without the record of how it came about."""
    return replace(Map.load(file), record=NOT_MERGED).to_bytes()


@pytest.mark.slow
def test_a_map_that_is_merged_later_is_joined_as_if_all_were_merged_at_once(
    refseq: Refseq, here: Path, third: Path
) -> None:
    refseq("map", "merge", "west.refseq", "east.refseq", "middle.refseq", "-o", "at-once.refseq")
    for first, last in (("west east", "middle"), ("middle west", "east"), ("east middle", "west")):
        early = [f"{name}.refseq" for name in first.split()]
        refseq("map", "merge", *early, "-o", "early.refseq")
        # Paths are in the order of the maps: as at once where the later one is named at its place.
        for words in (["early.refseq", f"{last}.refseq"], [f"{last}.refseq", "early.refseq"]):
            answer = refseq("map", "merge", *words, "-o", "later.refseq")
            assert answer.code == 0, answer.err
            assert held(here / "later.refseq") == held(here / "at-once.refseq")


def held(file: Path) -> dict[tuple[str, int], tuple[str, int]]:
    """For each view of each path the path and view that hold its place now."""
    map_ = Map.load(file)
    views = [(path.name, view) for path in map_.paths for view in range(len(path))]
    return dict(zip(views, (views[holder] for holder in map_.held_by.tolist()), strict=True))


@pytest.mark.slow
def test_an_atlas_of_one_grows_to_what_is_merged_at_once(refseq: Refseq, here: Path) -> None:
    refseq("map", "merge", "west.refseq", "-o", "whole.refseq")
    assert refseq("map", "merge", "whole.refseq", "east.refseq", "-o", "larger.refseq").code == 0
    refseq("map", "merge", "west.refseq", "east.refseq", "-o", "at-once.refseq")
    assert (here / "larger.refseq").read_bytes() == (here / "at-once.refseq").read_bytes()


def test_a_persons_decision_survives_a_later_merge(refseq: Refseq, here: Path, third: Path) -> None:
    write_decisions(here / "no.toml", [Decision("west", "east", (14, 27), (0, 11), (0, 0), False, BY_A_PERSON)])
    refseq("map", "merge", "west.refseq", "east.refseq", "-o", "two.refseq", "--decisions", "no.toml")
    assert refseq("map", "merge", "two.refseq", "-o", "again.refseq").code == 0
    assert len(Map.load(here / "again.refseq")) == 56
    # A newer word about the same stretch holds.
    write_decisions(here / "yes.toml", [Decision("west", "east", (14, 27), (0, 11), (0, 0), True, BY_A_PERSON)])
    refseq("map", "merge", "again.refseq", "-o", "yes.refseq", "--decisions", "yes.toml")
    assert len(Map.load(here / "yes.refseq")) < 56


def test_joins_are_decided_about_on_their_page_by_keyboard(refseq: Refseq, here: Path, browser: Browser) -> None:
    words = ["map", "merge", "west.refseq", "east.refseq", "-o", "paged.refseq", "--page", "joins.html"]
    assert refseq(*words).code == 0
    tab, errors = browser.new_page(), list[str]()
    tab.on("pageerror", lambda error: errors.append(str(error)))
    tab.on("console", lambda message: errors.append(message.text))
    tab.goto((here / "joins.html").as_uri())
    assert tab.locator(".join").count() == 1
    assert "west" in tab.locator("h3").inner_text()
    assert "scans lie on each other to" in tab.locator(".join").inner_text()
    assert tab.locator(".mine").count() >= 1
    tab.keyboard.press("ArrowDown")
    tab.keyboard.press("r")
    assert tab.locator("[aria-pressed=true]").inner_text() == "refuse"
    with tab.expect_download() as download:
        tab.keyboard.press("s")
    download.value.save_as(here / "page.toml")
    tab.close()
    assert errors == []
    # What the page saves is what merging reads, and holds in a later merge.
    refseq("map", "merge", "paged.refseq", "-o", "decided.refseq", "--decisions", "page.toml")
    assert len(Map.load(here / "decided.refseq")) == 56
    refseq("map", "merge", "decided.refseq", "-o", "later.refseq")
    assert len(Map.load(here / "later.refseq")) == 56


def test_doubtful_joins_come_first_on_the_page_and_sure_ones_last() -> None:
    def found(evidence: float, doubt: str = "", objection: str = "") -> FoundOverlap:
        overlap = Overlap(np.zeros((1, 2), np.intp), (9.0, 9.0), {}, objection, doubt, evidence)
        return FoundOverlap(0, 1, overlap.pairs, overlap)

    every = [
        (found(40.0), True),
        (found(20.0), True),
        (found(9.0, "weak"), True),
        (found(5.0, "weak"), False),
        (found(30.0, "weak"), False),
        (found(0.0, "", "too short"), False),
        (found(0.0, "", "too short"), True),
    ]
    decisions = tuple(Decision("a", "b", (0, 1), (0, 1), (9.0, 9.0), joined, "") for _, joined in every)
    merged = Merged(Map((), (), ()), decisions, tuple(one for one, _ in every))
    assert worst_first(merged) == [2, 4, 3, 6, 1, 0]


def two_short(maps: Path, folder: Path) -> tuple[Path, Path]:
    """Two maps of the same five views, in files of their own."""
    west, east = folder / "west.refseq", folder / "east.refseq"
    for file in (west, east):
        file.write_bytes((maps / "thesis.refseq").read_bytes())
    return west, east


def test_a_merge_reads_each_map_once(
    refseq: Refseq, maps: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    parts = two_short(maps, tmp_path)
    assert refseq("map", "merge", *parts, "-o", tmp_path / "whole.refseq").code == 0
    read: list[str] = []
    load = Map.load
    monkeypatch.setattr(Map, "load", lambda file: read.append(Path(file).name) or load(file))
    assert refseq("map", "merge", tmp_path / "whole.refseq", "-o", tmp_path / "again.refseq").code == 0
    assert sorted(read) == ["east.refseq", "west.refseq", "whole.refseq"]
    read.clear()
    assert refseq("map", "merge", *parts, "-o", tmp_path / "again.refseq").code == 0
    assert sorted(read) == ["east.refseq", "west.refseq"]


def test_a_member_that_is_missing_or_was_edited_is_told(refseq: Refseq, maps: Path, tmp_path: Path) -> None:
    for name in ("west", "east"):
        (tmp_path / f"{name}.refseq").write_bytes((maps / f"{name}.refseq").read_bytes())
    whole, out = tmp_path / "whole.refseq", tmp_path / "out.refseq"
    west, east = (str(tmp_path / f"{name}.refseq") for name in ("west", "east"))
    refseq("map", "merge", west, "-o", str(whole))
    Map.load(west).noted({"weather": "rain"}).save(Path(west))
    answer = refseq("map", "merge", str(whole), east, "-o", str(out))
    assert (answer.code, answer.out, len(answer.err.splitlines())) == (2, "", 1)
    assert f"{west}: is not the map any more that was merged into {whole}" in answer.err
    assert answer.err.endswith("themselves, or --keep-joins to add to the places that are left\n")
    Path(west).unlink()
    answer = refseq("map", "merge", str(whole), east, "-o", str(out))
    assert (answer.code, answer.out, len(answer.err.splitlines())) == (2, "", 1)
    assert f"its member {west} is not there; valid is to put it back, or --keep-joins" in answer.err
    assert not out.exists()
    assert refseq("map", "merge", str(whole), east, "-o", str(out), "--keep-joins").code == 0
    assert content(out) == content(maps / "atlas.refseq")


def test_a_merged_map_that_is_named_through_a_link_finds_its_members(
    refseq: Refseq, maps: Path, tmp_path: Path
) -> None:
    (tmp_path / "kept").mkdir()
    west, east = two_short(maps, tmp_path / "kept")
    whole = tmp_path / "kept" / "whole.refseq"
    assert refseq("map", "merge", west, "-o", whole).code == 0
    link, out, at_once = (tmp_path / f"{name}.refseq" for name in ("link", "out", "at-once"))
    link.symlink_to(whole)
    assert refseq("map", "merge", link, east, "-o", out).code == 0
    assert refseq("map", "merge", west, east, "-o", at_once).code == 0
    assert content(out) == content(at_once)


@pytest.mark.slow
def test_the_same_drive_twice_is_joined_whole(refseq: Refseq, here: Path) -> None:
    (here / "again.refseq").write_bytes((here / "west.refseq").read_bytes())
    assert refseq("map", "merge", "west.refseq", "again.refseq", "-o", "both.refseq").code == 0
    map_ = Map.load(here / "both.refseq")
    assert len(map_) <= 28 + 2
    assert np.abs(map_.held_by[28:] - map_.held_by[:28]).max() <= 1


def test_an_odometer_of_another_scale_and_another_robot_are_told(refseq: Refseq, here: Path) -> None:
    drive = corridor_drive(np.random.default_rng(1), count=28, spacing=SPACING, size=96)
    longer = [replace(view, distance=1.1 * view.distance) for view in drive]
    learn(longer, profile=BEST, sensors=EYE, metadata={"robot": "robuter"}).save(here / "longer.refseq")
    learn(drive, profile=BEST, sensors=EYE, metadata={"robot": "segway_rmp"}).save(here / "shorter.refseq")
    answer = refseq("map", "merge", "shorter.refseq", "longer.refseq", "-o", "both.refseq")
    assert answer.code == 0
    assert len(Map.load(here / "both.refseq")) <= 28 + 2, "absorbed"
    assert len(answer.err.splitlines()) == 2, answer
    scale, robots = sorted(answer.err.splitlines(), key=len)
    assert scale.startswith("note: the odometry of longer shows 1.10 m for each metre by that of shorter (shorter ")
    told = "so that fewer joins may be found: shorter by segway_rmp; longer by robuter"
    assert robots == f"note: drives of several robots, whose sensors stand elsewhere, {told}"


@pytest.mark.parametrize(
    ("decisions", "told"),
    [
        (
            [("west", "east", (16, 27), (0, 11), True), ("west", "east", (18, 20), (2, 4), False)],
            "decisions: west 18-20 = east 2-4 is joined and refused; valid is one decision about a stretch",
        ),
        (
            [
                ("west", "east", (16, 27), (0, 11), True),
                ("east", "middle", (0, 11), (6, 17), True),
                ("west", "middle", (18, 26), (8, 16), False),
            ],
            "decisions: west 18-26 = middle 8-16 is refused, but west 16-27 = east 0-11 and east",
        ),
    ],
)
def test_decisions_that_contradict_each_other_are_told(
    refseq: Refseq,
    here: Path,
    third: Path,
    decisions: list[tuple[str, str, tuple[int, int], tuple[int, int], bool]],
    told: str,
) -> None:
    tables = [Decision(one, other, a, b, (0, 0), joined, BY_A_PERSON) for one, other, a, b, joined in decisions]
    write_decisions(here / "odd.toml", tables)
    maps = ["west.refseq", "east.refseq", "middle.refseq"]
    answer = refseq("map", "merge", *maps, "-o", "x.refseq", "--decisions", "odd.toml")
    assert (answer.code, answer.out, len(answer.err.splitlines())) == (2, "", 1)
    assert told in answer.err
    assert not (here / "x.refseq").exists()


def decided(refseq: Refseq, here: Path, maps: str, *joins: Decision, more: Sequence[str] = ()) -> Answer:
    """Merge some maps by a person's decisions."""
    write_decisions(here / "by-hand.toml", [replace(join, why=BY_A_PERSON) for join in joins])
    names = [f"{name}.refseq" for name in maps.split()]
    return refseq("map", "merge", *names, "-o", "by-hand.refseq", "--decisions", "by-hand.toml", *more)


def join(one: str, other: str, first: tuple[int, int], second: tuple[int, int], joined: bool = True) -> Decision:
    return Decision(one, other, first, second, (0.0, 0.0), joined, BY_A_PERSON)


def test_the_order_of_the_maps_does_not_matter_to_decisions(refseq: Refseq, here: Path) -> None:
    assert decided(refseq, here, "east west", join("west", "east", (16, 27), (0, 11), joined=False)).code == 0
    assert len(Map.load(here / "by-hand.refseq")) == 56
    odd = (join("west", "east", (16, 27), (0, 11)), join("east", "west", (2, 4), (18, 20), joined=False))
    answer = decided(refseq, here, "west east", *odd)
    assert (answer.code, answer.out) == (2, "")
    assert answer.err == (
        "error: decisions: east 2-4 = west 18-20 is joined and refused; valid is one decision about a stretch\n"
    )


CONTRADICTED = "is joined as a person says, though odometry and the other joins contradict it"


def test_what_a_person_says_is_taken_and_what_speaks_against_it_told(refseq: Refseq, here: Path) -> None:
    """Views 16 to 27 of the west are 0 to 11 of the east; a person says that 18 to 27 are 18 to 27."""
    answer = decided(refseq, here, "west east", join("west", "east", (18, 27), (18, 27)), more=("--page", "told.html"))
    assert answer.code == 0
    rows = [line.split() for line in answer.out.splitlines() if line.split()[:1] in (["joined"], ["refused"])]
    assert [row[0] for row in rows] == ["refused", "joined"], "the machine's join yields to a person's"
    assert rows[1][2] == rows[1][4] == "18-27"
    mine, its = answer.err.splitlines()
    assert mine == f"note: west 18-27 = east 18-27 {CONTRADICTED}"
    assert its.startswith(f"note: west {rows[0][2]} = east {rows[0][4]} is refused as it contradicts a person's joins")
    page = (here / "told.html").read_text()
    assert page.count("<strong>Against it:</strong> odometry and the other joins contradict it.") == 1


@pytest.mark.slow
def test_of_two_joins_of_one_stretch_the_odd_one_is_told(refseq: Refseq, here: Path) -> None:
    """Both are a person's, and odometry has a word to say."""
    answer = decided(
        refseq, here, "west east", join("west", "east", (18, 27), (18, 27)), join("west", "east", (18, 27), (0, 9))
    )
    assert answer.code == 0
    assert f"note: west 18-27 = east 18-27 {CONTRADICTED}" in answer.err.splitlines()


def test_a_join_of_a_persons_that_agrees_is_told_nothing_against(refseq: Refseq, here: Path) -> None:
    answer = decided(refseq, here, "west east", join("west", "east", (16, 27), (0, 11)))
    assert (answer.code, answer.err) == (0, "")


def test_a_stretch_is_not_joined_to_one_of_another_length(refseq: Refseq, here: Path) -> None:
    (here / "by-hand.refseq").unlink(missing_ok=True)
    answer = decided(refseq, here, "west east", join("west", "east", (0, 20), (20, 22)))
    assert (answer.code, answer.out) == (2, "")
    told = "views 0 to 20 of 'west' are 17.0 m, views 20 to 22 of 'east' 1.7 m"
    assert answer.err == f"error: {told}; valid to join are stretches of about one length\n"
    assert not (here / "by-hand.refseq").exists()


@pytest.mark.slow
def test_what_a_person_refuses_is_not_made_one_by_the_machines_joins(refseq: Refseq, here: Path, third: Path) -> None:
    (here / "by-hand.refseq").unlink(missing_ok=True)
    answer = decided(refseq, here, "west east middle", join("west", "middle", (12, 27), (2, 17), joined=False))
    assert (answer.code, answer.out, len(answer.err.splitlines())) == (2, "", 1)
    assert re.match(r"error: decisions: west \S+ = middle \S+ is refused, but west \S+ = east \S+ and east", answer.err)
    assert not (here / "by-hand.refseq").exists()


@pytest.mark.slow
def test_parts_that_nothing_joins_are_told(refseq: Refseq, here: Path) -> None:
    answer = decided(refseq, here, "west east", join("west", "east", (16, 27), (0, 11), joined=False))
    assert answer.err == "note: 2 parts that share no place, no route leads from one to another: west; east\n"
    assert islands(Map.load(here / "by-hand.refseq")) == (("west",), ("east",))
    assert islands(Map.load(here / "atlas.refseq")) == (("west", "east"),)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("west.refseq none.refseq -o x.refseq", "none.refseq: cannot be read: No such file or directory"),
        ("west.refseq west.refseq -o x.refseq", "path 'west' is there twice; valid are names of their own"),
        ("west.refseq thesis.refseq -o x.refseq", "thesis.refseq: features are sift/forward"),
        ("west.refseq other-eye.refseq -o x.refseq", "other-eye.refseq: features are walls/laser, doors/laser, "),
        ("west.refseq east.refseq seven.refseq -o x.refseq", "seven.refseq: profile.sift"),
        ("west.refseq east.refseq cut.refseq -o x.refseq", "cut.refseq: is not a .refseq map, or is damaged"),
        ("cut.refseq west.refseq -o x.refseq", "cut.refseq: is not a .refseq map, or is damaged"),
        (
            "west.refseq east.refseq -o x.refseq --write-decisions x.refseq",
            "x.refseq: is no name of decisions; valid is one that ends in .toml",
        ),
        ("west.refseq east.refseq -o no/x.refseq", "no/x.refseq: cannot be written: there is no folder no"),
        *(
            (
                f"west.refseq east.refseq -o x.refseq --min-overlap {metres}",
                f"--min-overlap '{metres}' is not valid; valid is a number from 0 to 1000 [METRES]",
            )
            for metres in ("-1", "1e9", "nan")
        ),
        ("west.refseq east.refseq -o x.refseq --decisions bad.toml", "bad.toml: is no TOML: "),
        ("west.refseq east.refseq -o x.refseq --decisions odd.toml", "bad.toml"),
    ],
)
def test_what_is_wrong_is_told_in_one_line(refseq: Refseq, here: Path, words: str, told: str) -> None:
    (here / "bad.toml").write_text("[[join")
    write_decisions(here / "odd.toml", [Decision("west", "moon", (0, 1), (0, 1), (0, 0), True, BY_A_PERSON)])
    answer = refseq("map", "merge", *words.split())
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
    answer = refseq(
        "map", "merge", *sorted(tmp_path.glob("*.refseq")), "-o", "whole.refseq", "--write-decisions", "old.toml"
    )
    assert (answer.code, answer.out) == (2, "")
    assert answer.err.startswith(f"error: {tmp_path / f'{spoilt}.refseq'}: ")
    assert len(answer.err.splitlines()) == 1
    assert not (tmp_path / "whole.refseq").exists()
    assert (tmp_path / "old.toml").read_text() == "an older log"


@pytest.mark.parametrize("joined", [True, False])
@pytest.mark.parametrize(
    ("one", "other", "first", "second", "told"),
    [
        ("west", "east", (100, 120), (0, 5), "'west' has no views 100 to 120; valid are 0 to 27"),
        ("west", "east", (20, 28), (0, 5), "'west' has no views 20 to 28; valid are 0 to 27"),
        ("west", "east", (0, 5), (7, 10**15), "'east' has no views 7 to 1" + 15 * "0" + "; valid are 0 to 27"),
        ("west", "west", (0, 9), (9, 15), "west 0-9 = west 9-15 is one path that comes back to itself; valid is an "),
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
    write_decisions(here / "odd.toml", [Decision(one, other, first, second, (0, 0), joined, BY_A_PERSON)])
    answer = refseq("map", "merge", "west.refseq", "east.refseq", "-o", "x.refseq", "--decisions", "odd.toml")
    assert (answer.code, answer.out) == (2, "")
    assert answer.err.startswith(f"error: decisions: {told}")
    assert len(answer.err.splitlines()) == 1
    assert not (here / "x.refseq").exists()


def test_a_map_that_does_not_go_with_the_others_is_refused_before_any_is_merged(
    refseq: Refseq, here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def begun(*_: object) -> None:
        pytest.fail("a merge was begun")

    monkeypatch.setattr("refseq.atlas.merge.PairSearch", begun)
    answer = refseq("map", "merge", "west.refseq", "east.refseq", "other-eye.refseq", "-o", "x.refseq")
    assert answer.code == 2
    assert answer.err.startswith("error: other-eye.refseq: features are ")


def test_decisions_are_read_as_they_were_written(tmp_path: Path) -> None:
    write_decisions(tmp_path / "joins.toml", [replace(one, why=BY_A_PERSON) for one in DECISIONS])
    read = read_decisions(tmp_path / "joins.toml").persons
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
    answer = refseq("map", "merge", "west.refseq", "east.refseq", "-o", "x.refseq", "--decisions", "wrong.toml")
    assert answer.code == 2
    assert answer.err.startswith(f"error: wrong.toml: {told}")
    assert len(answer.err.splitlines()) == 1


def test_two_maps_are_compared_and_drawn_without_being_merged(refseq: Refseq, here: Path) -> None:
    answer = refseq("map", "similarity", "west.refseq", "east.refseq", "-o", "alike.png", "--arrays", "alike.npz")
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


def test_matrices_that_nobody_asks_for_are_not_made(
    refseq: Refseq, here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[Map] = []
    monkeypatch.setattr(similarity, "view_similarity", lambda of, to: made.append(of))
    answer = refseq("map", "similarity", "west.refseq", "east.refseq")
    assert (answer.code, answer.err, made) == (0, "", [])
    assert "joined" in answer.out


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("west.refseq thesis.refseq", "thesis.refseq: features are sift/forward"),
        (
            "west.refseq east.refseq -o alike.txt",
            "alike.txt: is no name of a picture; valid is one that ends in .png, .svg or .pdf",
        ),
        (
            "west.refseq east.refseq --arrays alike.mat",
            "alike.mat: is no name of arrays; valid is one that ends in .npz",
        ),
        ("west.refseq west.refseq", "path 'west' is there twice"),
    ],
)
def test_what_cannot_be_compared_is_told(refseq: Refseq, here: Path, words: str, told: str) -> None:
    answer = refseq("map", "similarity", *words.split())
    assert (answer.code, answer.out) == (2, "")
    assert answer.err.startswith(f"error: {told}")
    assert len(answer.err.splitlines()) == 1


def test_a_map_is_still_a_map(here: Path) -> None:
    assert len(Map.load(here / "west.refseq")) == 28


# --- route ---


def rows(said: str) -> list[tuple[str, int, int, float]]:
    """The table's legs: path, first and last view, length [m]."""
    found = re.findall(r"^ *(\S+) +(\d+)-(\d+) +(\d+\.\d) *$", said, re.MULTILINE)
    return [(path, int(first), int(last), float(length)) for path, first, last, length in found]


def test_a_route_goes_over_from_path_to_path(refseq: Refseq, here: Path) -> None:
    answer = refseq("map", "route", "atlas.refseq", "west:2", "east:25")
    assert (answer.code, answer.err) == (0, "")
    assert answer.out.split()[:4] == ["path", "views", "length", "[m]"]
    west, east = rows(answer.out)
    # View 16 + k of the west is view k of the east, give or take one: from view 2 to 41 of the whole drive.
    assert (west[:2], east[0], east[2]) == (("west", 2), "east", 25)
    assert west[2] - east[1] == pytest.approx(16, abs=1)
    total = (west[2] - 2 + 25 - east[1]) * SPACING
    assert total == pytest.approx(39 * SPACING, abs=SPACING + 0.01)
    line = re.fullmatch(r"(\d+\.\d) m from west:2 to east:25, (\d+) places, 2 legs", answer.out.splitlines()[-1])
    assert line is not None
    assert float(line[1]) == pytest.approx(total, abs=0.05)
    assert int(line[2]) == pytest.approx(40, abs=1)


def test_a_map_alone_is_an_atlas_of_one(refseq: Refseq, here: Path) -> None:
    answer = refseq("map", "route", "west.refseq", "west:1", "west:21")
    assert (answer.code, answer.err) == (0, "")
    assert rows(answer.out) == [("west", 1, 21, 17.0)]
    assert answer.out.splitlines()[-1] == "17.0 m from west:1 to west:21, 21 places, 1 leg"


def test_where_one_is_there_is_nothing_to_follow(refseq: Refseq, here: Path) -> None:
    answer = refseq("map", "route", "west.refseq", "west:7", "west:7")
    assert answer == (0, "0.0 m from west:7 to west:7, the same place\n", "")


@pytest.mark.parametrize(
    ("atlas", "start", "goal"),
    [("atlas", "east:25", "west:2"), ("apart", "west:2", "east:25"), ("west", "west:2", "west:0")],
)
def test_where_nothing_leads_the_exit_code_is_one(
    refseq: Refseq, here: Path, atlas: str, start: str, goal: str
) -> None:
    answer = refseq("map", "route", f"{atlas}.refseq", start, goal)
    why = "no place is shared by west and east" if atlas == "apart" else "paths are driven one way only"
    assert answer == (1, "", f"no path leads from {start} to {goal}: {why}\n")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("none.refseq west:0 west:1", "none.refseq: cannot be read: No such file or directory"),
        ("text.refseq west:0 west:1", "text.refseq: is not a .refseq map, or is damaged: "),
        (
            "atlas.refseq west west:1",
            "place 'west' is no PATH:VIEW; valid is a path and a view of it: west:0, west:end",
        ),
        ("atlas.refseq west:0 north:1", "place 'north:1': path 'north' is unknown; valid are west, east"),
        ("atlas.refseq west:28 east:0", "place 'west:28': path 'west' has 28 views; valid is 0 to 27"),
        ("west.refseq west:0 west:-1", "place 'west:-1': path 'west' has 28 views; valid is 0 to 27"),
    ],
)
def test_a_place_that_is_none_is_told_in_one_line(refseq: Refseq, here: Path, words: str, told: str) -> None:
    answer = refseq("map", "route", *words.split())
    assert (answer.code, answer.out) == (2, "")
    assert len(answer.err.splitlines()) == 1
    assert answer.err.startswith(f"error: {told}")


def test_a_name_is_printed_as_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    """Names of files may hold what rich takes for markup or for a picture."""
    out.print(leg_table(Route(np.arange(3), (Leg("[red]a", 0, 1, 1.0), Leg(":100:", 1, 2, 2.5)))))
    assert rows(capsys.readouterr().out) == [("[red]a", 0, 1, 1.0), (":100:", 1, 2, 2.5)]


@pytest.mark.slow
def test_the_two_paths_of_the_page_are_joined_by_the_laser_alone(refseq: Refseq, tmp_path: Path) -> None:
    """The first example of docs/atlas.md: at both ends the paths part, and scans there must not spoil the join."""
    for route, seed in (("path-a", "1"), ("path-b", "2")):
        drive, learnt = str(tmp_path / f"{route}.mcap"), str(tmp_path / f"{route}.refseq")
        words = ["record", "second-floor", "--route", route, "--sensors", "laser", "--seed", seed, "-o", drive]
        assert refseq(*words).code == 0
        assert refseq("learn", drive, "--profile", "best", "-o", learnt).code == 0
    maps = [str(tmp_path / f"{route}.refseq") for route in ("path-a", "path-b")]
    assert refseq("map", "merge", *maps, "-o", str(tmp_path / "whole.refseq")).code == 0
    merged = Map.load(tmp_path / "whole.refseq")
    assert 125 <= len(merged) <= 135
    assert len(merged.links) == 2
