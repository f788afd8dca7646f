"""``refseq route``: legs and a length, exit code 1 where nothing leads, and what is wrong told in one line."""

import re
from pathlib import Path

import numpy as np
import pytest

from refseq.atlas.merge import merge_maps
from refseq.atlas.routes import Leg, Route
from refseq.map.learning import learn
from refseq.map.map import beside
from refseq.map.profile import BEST
from scenarios.cli.console import out
from scenarios.cli.route import leg_table
from tests.refseq.rooms import named_maps
from tests.scenarios.conftest import Refseq
from tests.support import corridor_drive

SPACING = 0.85


@pytest.fixture(scope="module")
def maps(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The two halves of a drive, which share 12 views: merged, side by side, and one of them alone."""
    folder = tmp_path_factory.mktemp("maps")
    drive = corridor_drive(np.random.default_rng(1), count=44, spacing=SPACING, size=96)
    names, halves = ["west", "east"], [learn(drive[:28], profile=BEST), learn(drive[16:], profile=BEST)]
    merge_maps(named_maps(names, halves)).map.save(folder / "atlas.refseq")
    beside(named_maps(names, halves)).save(folder / "apart.refseq")
    halves[0].save(folder / "west.refseq")
    (folder / "text.refseq").write_text("no map")
    return folder


@pytest.fixture
def here(maps: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(maps)
    return maps


def rows(said: str) -> list[tuple[str, int, int, float]]:
    """The table's legs: path, first and last view, length [m]."""
    found = re.findall(r"^ *(\S+) +(\d+)-(\d+) +(\d+\.\d) *$", said, re.MULTILINE)
    return [(path, int(first), int(last), float(length)) for path, first, last, length in found]


def test_a_route_goes_over_from_path_to_path(refseq: Refseq, here: Path) -> None:
    answer = refseq("route", "atlas.refseq", "west:2", "east:25")
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
    answer = refseq("route", "west.refseq", "west:1", "west:21")
    assert (answer.code, answer.err) == (0, "")
    assert rows(answer.out) == [("west", 1, 21, 17.0)]
    assert answer.out.splitlines()[-1] == "17.0 m from west:1 to west:21, 21 places, 1 leg"


def test_where_one_is_there_is_nothing_to_follow(refseq: Refseq, here: Path) -> None:
    answer = refseq("route", "west.refseq", "west:7", "west:7")
    assert answer == (0, "0.0 m from west:7 to west:7, the same place\n", "")


@pytest.mark.parametrize(
    ("atlas", "start", "goal"),
    [("atlas", "east:25", "west:2"), ("apart", "west:2", "east:25"), ("west", "west:2", "west:0")],
)
def test_where_nothing_leads_the_exit_code_is_one(
    refseq: Refseq, here: Path, atlas: str, start: str, goal: str
) -> None:
    answer = refseq("route", f"{atlas}.refseq", start, goal)
    assert answer == (1, "", f"no path leads from {start} to {goal}: paths are driven one way only\n")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("none.refseq west:0 west:1", "none.refseq: cannot be read: No such file or directory"),
        ("text.refseq west:0 west:1", "text.refseq: is not a .refseq map, or is damaged: "),
        ("atlas.refseq west west:1", "place 'west' is no PATH:VIEW; valid is a path and a view of it: west:0"),
        ("atlas.refseq west:0 north:1", "place 'north:1': path 'north' is unknown; valid are west, east"),
        ("atlas.refseq west:28 east:0", "place 'west:28': path 'west' has 28 views; valid is 0 to 27"),
        ("west.refseq west:0 west:-1", "place 'west:-1': path 'west' has 28 views; valid is 0 to 27"),
    ],
)
def test_what_is_wrong_is_told_in_one_line(refseq: Refseq, here: Path, words: str, told: str) -> None:
    answer = refseq("route", *words.split())
    assert (answer.code, answer.out) == (2, "")
    assert len(answer.err.splitlines()) == 1
    assert answer.err.startswith(f"error: {told}")


def test_a_name_is_printed_as_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    """Names of files may hold what rich takes for markup or for a picture."""
    out.print(leg_table(Route(np.arange(3), (Leg("[red]a", 0, 1, 1.0), Leg(":100:", 1, 2, 2.5)))))
    assert rows(capsys.readouterr().out) == [("[red]a", 0, 1, 1.0), (":100:", 1, 2, 2.5)]
