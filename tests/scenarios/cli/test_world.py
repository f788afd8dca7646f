"""The commands about worlds as a user meets them."""

import re
from collections.abc import Callable, Iterator
from itertools import pairwise
from math import dist
from pathlib import Path

import pytest

from refseq_bench import robots
from refseq_bench.scenarios.world_survey.facts import robot_box
from refseq_bench.scenarios.world_survey.library import routes_text
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.meter import Meter
from refseq_bench.worlds.plans.generate import corridor
from refseq_bench.worlds.plans.load import load_plan, parse_plan, world_names
from tests.scenarios.conftest import Answer, Refseq
from tests.worlds.conftest import SMALL

CRATE = """
[[furniture]]
name = "crate"
kind = "box"
at = [4, 0]
width = 0.5
depth = 0.5
height = 0.5
material = "door"
"""


ENDS = "".join(
    f'[[wall]]\nname = "{name}"\nstart = [{x}, -1.2]\nend = [{x}, 1.2]\ninside = "{inside}"\nmaterial = "plaster"\n'
    for name, x, inside in (("near", 0, "right"), ("far", 8, "left"))
)


Worlds = Callable[[str], Answer]


@pytest.fixture
def worlds(refseq: Refseq, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Worlds:
    """Run a command about worlds, in an empty folder with four plans and a terminal of 80 characters."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    (tmp_path / "small.toml").write_text(SMALL.format(top="", end=""))
    (tmp_path / "closed.toml").write_text(SMALL.format(top="", end=ENDS))
    (tmp_path / "blocked.toml").write_text(SMALL.format(top="", end=CRATE))
    (tmp_path / "broken.toml").write_text(SMALL.format(top="colour = 1", end=""))
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder.toml").mkdir()
    return lambda words: refseq("world", *words.split())


# --- what is right ---


def test_list_names_every_world_and_the_one_from_a_seed(worlds: Worlds) -> None:
    answer = worlds("list")
    assert answer.code == 0
    for name in (*world_names(), "corridor:SEED"):
        assert re.search(rf"^ ?{re.escape(name)} ", answer.out, re.MULTILINE), name
    assert "forward ⇄ 96" in answer.out
    assert max(map(len, answer.out.splitlines())) <= 80


def test_routes_along_one_line_are_told_once() -> None:
    assert routes_text(load_plan("annex")) == "forward ⇄ 73, detour 107"
    assert routes_text(parse_plan(SMALL.format(top="", end=""))) == "forward 6"


def test_show_tells_place_things_lamps_routes_and_the_sun(worlds: Worlds) -> None:
    answer = worlds("show hallway")
    assert answer.code == 0
    for said in (
        "latitude 40.63°, longitude -8.66°; Europe/Lisbon, 2008-03-20",
        "100 × 2.4 m, x 0 to 100, y -1.2 to 1.2",
        "door 21 (3 open)",
        "25 lamps of 1000 lm, 4000 K, switch dusk",
        "96.0 m, 2 points from (2, 0) to (98, 0)",
        "16:00, the sun is 29.7° up in 241°",
        "21:30, the sun is 30.3° below the horizon",
    ):
        assert said in answer.out
    assert max(map(len, answer.out.splitlines())) <= 80


def test_show_tells_how_much_of_the_walls_is_window(worlds: Worlds, tmp_path: Path) -> None:
    """Of a wall of 8 m: two windows of 1.2 m, one above the other, and one of 1 m beside them."""
    windows = "".join(
        f'[[window]]\nname = "w{i}"\nwall = "left"\nat = {at}\nwidth = {width}\nsill = {sill}\nheight = 0.8\n'
        for i, (at, width, sill) in enumerate([(2, 1.2, 0.2), (2, 1.2, 1.2), (5, 1, 1)])
    )
    (tmp_path / "glazed.toml").write_text(SMALL.format(top="", end=windows))
    assert re.search(
        r"^windows +28 % of the length of the walls that have any *$", worlds("show glazed.toml").out, re.M
    )
    assert "windows  " not in worlds("show small.toml").out


def test_check_says_nothing_found_of_a_good_world(worlds: Worlds) -> None:
    answer = worlds("check closed.toml")
    assert (answer.code, answer.err) == (0, "")
    assert re.fullmatch(r"closed\.toml: [\d.]+ s, \d+ MB, \d+ geoms, 5 solid: nothing found\n", answer.out)


def test_check_tells_where_a_building_is_open_and_leaves_with_1(worlds: Worlds) -> None:
    answer = worlds("check small.toml")
    assert (answer.code, answer.err) == (1, "")
    assert "wall 'left' meets no other one at x 8.00, y 1.20: the building is open there" in answer.out


def test_check_names_what_is_in_the_way_and_leaves_with_1(worlds: Worlds) -> None:
    answer = worlds("check small.toml blocked.toml")
    assert answer.code == 1
    assert answer.err == ""
    lines = [line for line in answer.out.splitlines() if line.startswith("blocked.toml: route")]
    assert len(lines) == len(robots.names())
    for line in lines:
        assert re.match(r"blocked\.toml: route 'forward': robot '[\w-]+' does not get past box 'crate' at x 3\.", line)


def test_a_robot_s_room_is_that_of_its_facts() -> None:
    """1.031 x 0.710 m with its end modules; the laser stands out in front, the mast up."""
    robuter = robot_box("robuter")
    assert 1.031 <= robuter.front + robuter.back < 1.1
    assert 2 * robuter.half_width == pytest.approx(0.710, abs=0.005)
    assert robuter.height > 1.35


@pytest.mark.parametrize("suffix", ["svg", "png"])
def test_draw_writes_a_drawing(suffix: str, worlds: Worlds, tmp_path: Path) -> None:
    answer = worlds(f"draw small.toml --light 18:00 --route forward -o plan.{suffix}")
    assert (answer.code, answer.out) == (0, f"plan.{suffix}\n")
    start = (tmp_path / f"plan.{suffix}").read_bytes()[:5]
    assert start in (b"<?xml", b"\x89PNG\r")


def test_lux_is_what_the_meter_reads_there(worlds: Worlds) -> None:
    answer = worlds("lux small.toml --at 4,0,1 --at 2,0.5,0 --facing 0,1,0 --light 21:00,lamps=on")
    assert answer.code == 0
    assert answer.out.startswith("small at 21:00, the sun is ")
    plan = parse_plan(SMALL.format(top="", end=""))
    reading = Meter(plan, light_named("21:00,lamps=on")).read((4, 0, 1), (0, 1, 0))
    assert "at [m]" in answer.out
    assert "sun [lx]" in answer.out
    row = next(line.split() for line in answer.out.splitlines() if line.split()[:1] == ["4,0,1"])
    assert float(row[-1]) == pytest.approx(reading.total, rel=0.05, abs=0.05)
    assert any(line.split()[:1] == ["2,0.5,0"] for line in answer.out.splitlines())


def test_lux_takes_an_hour(worlds: Worlds) -> None:
    by_day, at_night = (worlds(f"lux corridor:6 --at 5,0,1 --light {hour}") for hour in ("13:00", "23:00"))
    totals = [float(answer.out.split()[-1]) for answer in (by_day, at_night)]
    assert totals[0] > totals[1] > 0


def test_generate_writes_the_corridor_of_that_seed(worlds: Worlds, tmp_path: Path) -> None:
    answer = worlds("generate --seed 7 -o mine.toml")
    assert (answer.code, answer.out) == (0, f"mine.toml: {corridor(7).title}\n")
    assert load_plan(tmp_path / "mine.toml") == load_plan("corridor:7") == corridor(7)
    assert (tmp_path / "mine.toml").read_text().startswith("# Made by: refseq world generate corridor:7\n")
    again = worlds("generate --seed 8 -o mine.toml")  # somebody may have gone on with it
    assert (again.code, again.err) == (2, "error: mine.toml: is there already; valid is a new file\n")
    assert load_plan(tmp_path / "mine.toml") == corridor(7)


@pytest.mark.parametrize("name", ["building:5,texture=0.3,width=2", "corridor:3,glass=0.2", "annex"])
def test_generate_takes_worlds_by_the_names_that_other_commands_take(worlds: Worlds, tmp_path: Path, name: str) -> None:
    answer = worlds(f"generate {name} -o mine.toml")
    assert (answer.code, answer.out) == (0, f"mine.toml: {load_plan(name).title}\n")
    assert load_plan(tmp_path / "mine.toml") == load_plan(name)
    assert (tmp_path / "mine.toml").read_text().startswith(f"# Made by: refseq world generate {name}\n")


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ("building:5 --seed 5", "--seed 5 is that of a corridor; valid is WORLD or --seed, not both"),
        ("building:5,glass=2", "world 'building:5,glass=2': glass = '2' is not valid; it should be from 0 to 0.9"),
    ],
)
def test_generate_refuses_a_world_that_is_none(worlds: Worlds, tmp_path: Path, given: str, told: str) -> None:
    answer = worlds(f"generate {given} -o mine.toml")
    assert (answer.code, answer.out, answer.err) == (2, "", f"error: {told}\n")
    assert not (tmp_path / "mine.toml").exists()


def test_lengths_that_are_told_are_those_of_the_lines() -> None:
    for name in world_names():
        plan = load_plan(name)
        first = next(iter(plan.routes))
        along = sum(dist(a, b) for a, b in pairwise(plan.routes[first]))
        assert re.match(rf"{first}( ⇄)? {along:.0f}\b", routes_text(plan))


# --- what is wrong ---

LUX = "lux small.toml --at 4,0,1"
BAD_INPUT = [
    ("show nowhere", "unknown world 'nowhere'; known are annex, "),
    ("show corridor:x", "unknown world 'corridor:x'; known are annex, "),
    ("show lost.toml", "lost.toml: cannot be read: No such file or directory\n"),
    ("check small.toml broken.toml", "broken.toml: colour: unknown key; valid keys are name, title, "),
    ("check small.toml nowhere", "unknown world 'nowhere'; known are annex, "),
    ("draw small.toml -o plan.pdf", "plan.pdf: is no name of a picture; valid is one that ends in .svg or .png\n"),
    ("draw small.toml -o lost/plan.svg", "lost/plan.svg: cannot be written: there is no folder lost\n"),
    ("draw small.toml --route up -o plan.svg", "unknown route 'up' in world 'small'; known are forward\n"),
    ("draw small.toml --light dawn -o plan.svg", "unknown light 'dawn'; known are morning, noon, "),
    ("draw broken.toml -o plan.svg", "broken.toml: colour: unknown key; valid keys are name, title, "),
    (
        "lux small.toml --at 4,9,1",
        "at '4,9,1' lies outside 'small'; valid is x 0 to 8, y -1.2 to 1.2; z 0 to 2.8\n",
    ),
    (
        "lux small.toml --at 4,0,3",
        "at '4,0,3' lies outside 'small'; valid is x 0 to 8, y -1.2 to 1.2; z 0 to 2.8\n",
    ),
    ("lux small.toml --at 4,0", "at '4,0' is not valid; it should be X,Y,Z in metres, such as 12.5,0,1\n"),
    ("lux small.toml --at 4,0,nan", "at '4,0,nan' is not valid; it should be X,Y,Z in metres, such as 12.5,0,1\n"),
    (
        f"{LUX} --facing left",
        "facing 'left' is not valid; it should be up, down or X,Y,Z, a direction such as 0,1,0\n",
    ),
    (
        f"{LUX} --facing 0,0,0",
        "facing '0,0,0' is not valid; it should be up, down or X,Y,Z, a direction such as 0,1,0\n",
    ),
    (f"{LUX} --light 25:00", "unknown light '25:00'; known are morning, noon, "),
    (
        f"{LUX} --light 18:00,cloud=2",
        "light '18:00,cloud=2': cloud '2' is not valid; it should be a share from 0 to 1\n",
    ),
    (
        "contact-sheet small.toml -o sheet.gif",
        "sheet.gif: is no name of a picture; valid is one that ends in .svg or .png\n",
    ),
    ("contact-sheet small.toml --light dawn -o s.png", "unknown light 'dawn'; known are morning, noon, "),
    ("contact-sheet small.toml --along 9 -o s.png", "place 9 m is not on the route; valid is 0 to 6\n"),
    ("contact-sheet small.toml --route up -o s.png", "unknown route 'up' in world 'small.toml'; valid are forward\n"),
    (
        "contact-sheet small.toml --change rain=1 -o s.png",
        "change 'rain=1': unknown 'rain=1'; valid is none, few, busy, or ",
    ),
    ("contact-sheet small.toml --robot r2d2 -o s.png", "unknown robot 'r2d2': valid are robuter, "),
    ("day small.toml --light dawn -o d.png", "unknown light 'dawn'; known are morning, noon, "),
    ("day small.toml --conditions fog=1 -o d.png", "light '06:00,fog=1': unknown option 'fog=1'; valid is HH:MM "),
    (
        "day small.toml --first-hour 9 --last-hour 8 -o d.png",
        "--first-hour 9 --last-hour 8: no hour lies between; valid is a last hour ",
    ),
    ("generate --seed 7 -o mine.txt", "mine.txt: is no name of a plan; valid is one that ends in .toml\n"),
    ("generate --seed 7 -o folder.toml", "folder.toml: is a folder; valid is the name of a file to write\n"),
]


@pytest.fixture
def untouched(worlds: Worlds, tmp_path: Path) -> Iterator[None]:
    """The folder is afterwards as it was."""
    before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*") if path.is_file()}
    yield
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*") if path.is_file()} == before


@pytest.mark.parametrize(("words", "said"), BAD_INPUT)
@pytest.mark.usefixtures("untouched")
def test_bad_input_is_one_line_and_leaves_with_2(words: str, said: str, worlds: Worlds) -> None:
    answer = worlds(words)
    assert (answer.code, answer.out) == (2, "")
    assert answer.err.startswith(f"error: {said}")
    assert answer.err.count("\n") == 1
