"""The commands about scenarios, and a localiser of one's own in a campaign, as a user types them."""

import importlib
import json
import shlex
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from refseq.logs import RecordingWriter
from refseq.planar import Pose
from refseq_bench.scenarios.api import run
from refseq_bench.scenarios.campaign.campaign import Watcher, run_campaign
from refseq_bench.scenarios.campaign.declare.cases import load, names
from refseq_bench.scenarios.campaign.declare.outcomes import Verdict
from refseq_bench.scenarios.campaign.declare.overrides import with_methods
from refseq_bench.scenarios.campaign.judge.drives import Judged
from refseq_bench.scenarios.campaign.store.cache import Store
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.methods.templates.my_localiser import MyLocaliser
from tests.scenarios.campaign.chores import AtOnce
from tests.scenarios.conftest import Refseq
from tests.support import corridor_drive
from tests.worlds.conftest import SMALL

LASER = """
title = "Laser [only]"
seeds = [1]
tags = ["mine"]
expect = ["success >= 1 %", "success_hmm >= 1 %", "failures of vlad <= 3"]
[reference]
world = "annex"
renderer = "none"
end = 4.0
[query]
light = "18:00"
[localise]
methods = ["thesis"]
[limits]
seconds = 60.0
"""

SMALL_LASER = (
    LASER.replace("annex", "small.toml")
    .replace("end = 4.0", "trigger = { distance = 0.4 }")
    .replace('"success_hmm >= 1 %", "failures of vlad <= 3"', '"success_hmm >= 0 %"')
    .replace("60.0", "600.0")
)

OWN = """
import os, time
import numpy as np
from refseq.belief import Belief, belief_from

class Good:
    def __init__(self, views):
        assert all(view.truth is None for view in views)
        self.K = len(views)
    def reset(self): self.n = -1
    def update(self, view):
        assert view.truth is None
        self.n += 1
        return self.answer()
    def answer(self): return belief_from(np.eye(self.K)[min(self.n, self.K - 1)])

class Raising(Good):
    def answer(self): return 1 / 0 if self.n == 2 else super().answer()

class Nan(Good):
    def answer(self): return super().answer() if self.n < 1 else Belief(np.full(self.K, np.nan), 0, 0, (0,), 0)

class Hanging(Good):
    def answer(self):
        time.sleep(1e6)
"""


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("REFSEQ_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(sys, "path", [entry for entry in sys.path if entry])
    monkeypatch.setattr(sys, "dont_write_bytecode", True)  # two edits within a second must not find an old .pyc
    yield tmp_path
    for name in [name for name, one in sys.modules.items() if str(tmp_path) in str(getattr(one, "__file__", ""))]:
        del sys.modules[name]


def test_list_has_all_of_the_library(refseq: Refseq) -> None:
    answer = refseq("scenario", "list")
    assert answer.code == 0
    assert [line.split()[0] for line in answer.out.splitlines()[3:] if line.strip()] == list(names())
    listed = json.loads(refseq("scenario", "list", "smoke", "--json").out)
    assert [(one["name"], len(one["seeds"])) for one in listed] == [("smoke", 2)]


def test_a_list_does_not_ask_whether_a_route_can_be_driven(refseq: Refseq, here: Path) -> None:
    (here / "up.toml").write_text(
        LASER.replace(', "failures of vlad <= 3"', "").replace("[query]", 'route = "up"\n[query]', 1)
    )
    assert json.loads(refseq("scenario", "list", "up.toml", "--json").out)[0]["name"] == "up"
    shown = refseq("scenario", "show", "up.toml")
    assert (shown.code, "unknown route 'up'" in shown.err) == (2, True)


def test_show_needs_no_cache_that_could_be_made(refseq: Refseq, here: Path) -> None:
    (here / "laser.toml").write_text(LASER.replace(', "failures of vlad <= 3"', ""))
    answer = refseq("scenario", "show", "laser.toml", "--cache", here / "laser.toml" / "cache")
    assert (answer.code, answer.err) == (0, "")
    assert "kept: 0 of 2 drives" in answer.out


def test_show_tells_all_that_is_left_open(refseq: Refseq, here: Path) -> None:
    (here / "laser.toml").write_text(LASER.replace(', "failures of vlad <= 3"', ""))
    answer = refseq("scenario", "show", "laser.toml")
    assert answer.code == 0, answer.err
    for line in (
        "laser: Laser [only]",
        "  reference: world annex, robot robuter, light 16:00, route forward, end 4.0, renderer none",
        "  query: world annex, robot robuter, light 18:00, route forward, end 4.0, renderer none",
        "  limits: ",
        "  methods: thesis/uniform, thesis/prior, thesis/chain; judged: thesis/chain",
        "  expected: success_hmm >= 1 %",
        "  kept: 0 of 2 drives, 0 of 1 answers; the rest: about ",
    ):
        assert line in answer.out
    (shown,) = json.loads(refseq("scenario", "show", "laser.toml", "--json").out)
    assert shown["scenario"]["query"]["trigger"]["distance"] == 0.85
    answer = refseq("scenario", "show", "kidnap/ahead")
    assert (
        "  query: world hallway, robot robuter, light 18:00, route forward, faults [{at 30.0, to 70.0, kind kidnap}]"
        in answer.out.splitlines()
    )
    answer = refseq("scenario", "show", "light-dial", "--case", "midnight")
    assert (answer.code, answer.err.splitlines()[0][:34]) == (2, "error: case 'midnight' is unknown;")


@pytest.mark.parametrize(
    ("output", "told"),
    [
        ("mine.txt", "mine.txt: is no module's name; valid is a name that can be imported, ending in .py"),
        ("my-own.py", "my-own.py: is no module's name"),
        ("no/where.py", "no/where.py: cannot be written: there is no folder no"),
        ("there.py", "there.py: is there already; valid is a new file"),
    ],
)
def test_a_template_overwrites_nothing(refseq: Refseq, here: Path, output: str, told: str) -> None:
    (here / "there.py").write_text("precious")
    answer = refseq("scenario", "template", "-o", output)
    assert (answer.code, answer.out) == (2, "")
    assert answer.err.startswith(f"error: {told}")
    assert (here / "there.py").read_text() == "precious"


def test_the_template_is_the_localiser_that_is_tested(refseq: Refseq, here: Path) -> None:
    assert refseq("scenario", "template").code == 0
    assert (here / "my_localiser.py").read_text() == Path(
        sys.modules[MyLocaliser.__module__].__file__ or ""
    ).read_text()


def test_wrong_names_are_told_before_anything_runs(refseq: Refseq, here: Path) -> None:
    (here / "laser.toml").write_text(LASER.replace(', "failures of vlad <= 3"', ""))
    (here / "own.py").write_text(OWN)
    for words, told in {
        "--localiser own:Bad": "error: localiser 'own:Bad': ",
        "--localiser owner:Good": "error: localiser 'owner:Good': there is no module 'owner'",
        "--localiser magic": "error: method 'magic' is unknown",
        "--methods magic": "error: method 'magic' is unknown",
        "--methods none": "error: methods 'none': nobody is left to be asked",
    }.items():
        answer = refseq("scenario", "run", "laser.toml", *shlex.split(words))
        assert (answer.code, answer.out) == (2, "")
        assert answer.err.startswith(told)
        assert len(answer.err.splitlines()) == 1
    assert not (here / "cache").exists() or not any((here / "cache").iterdir())


def test_a_file_that_compares_its_method_with_itself_is_refused_unless_another_is_judged(
    refseq: Refseq, here: Path
) -> None:
    (here / "first.toml").write_text(blocks("toml")[0])
    (here / "own.py").write_text(OWN)
    told = "error: first.toml: expect: 'success > success of vlad': compares success with itself, as vlad is judged"
    assert refseq("scenario", "show", "first.toml").err.startswith(told)
    assert refseq("scenario", "run", "first.toml").err.startswith(told)
    judged = refseq("scenario", "run", "first.toml", "--localiser", "own:Bad")
    assert (judged.code, judged.err.partition(": ")[2][:20]) == (2, "localiser 'own:Bad':")
    with pytest.raises(ScenarioError, match="localiser 'own:Bad'"):
        run("first.toml", localisers=["own:Bad"])


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Store:
    """A store of its own for these tests, which drive the same drives."""
    return Store(tmp_path_factory.mktemp("store"))


def answers_in(store: Store) -> set[Path]:
    return set(store.folder.glob("*.parquet"))


def campaign(here: Path, store: Store, *own: str, methods: tuple[str, ...] | None = None) -> Judged:
    """The laser's scenario with localisers of one's own."""
    cases = with_methods(load(here / "laser.toml"), own, methods)
    (result,) = run_campaign(cases, AtOnce(store), store, Watcher())
    return result


@pytest.fixture
def laser(here: Path) -> Path:
    """The laser's scenario and a module of localisers, in a world of seconds."""
    (here / "small.toml").write_text(SMALL.format(top="", end=""))
    (here / "laser.toml").write_text(SMALL_LASER)
    (here / "own.py").write_text(OWN)
    return here


def test_a_localiser_that_does_wrong_fails_alone(laser: Path, store: Store) -> None:
    result = campaign(laser, store, "own:Good", "own:Raising", "own:Nan")
    line = 1 + OWN.splitlines().index("    def answer(self): return 1 / 0 if self.n == 2 else super().answer()")
    assert result.reasons == (
        f"own:Raising, view 2: raised ZeroDivisionError: division by zero (own.py, line {line})",
        "own:Nan, view 1: places holds what is no probability (nan, infinite or negative)",
        "not judged: success of own:Raising >= 1 % (own:Raising has no answers)",
        "not judged: success of own:Nan >= 1 % (own:Nan has no answers)",
    )
    assert result.verdict is Verdict.ERROR
    assert "return 1 / 0" in result.mishaps[0].details
    assert [one.met for one in result.judgements] == [True, True, None, None]
    assert {one.method: one.wide.success.value for one in result.figures}["own:Good"] > 0.9
    alone = campaign(laser, store)
    assert alone.digests["thesis/chain"] == result.digests["thesis/chain"]


def test_answers_are_kept_until_the_localiser_is_changed(laser: Path, store: Store) -> None:
    first = campaign(laser, store, "own:Good", methods=("none",))
    kept = answers_in(store)
    assert campaign(laser, store, "own:Good", methods=("none",)).digests == first.digests
    assert answers_in(store) == kept
    assert first.verdict is Verdict.PASSED
    assert first.reasons == ("not judged: success_hmm >= 0 % (thesis/chain has no answers)",)
    (laser / "own.py").write_text(OWN.replace("min(self.n, self.K - 1)", "0"))
    sys.modules.pop("own", None)
    importlib.invalidate_caches()
    assert campaign(laser, store, "own:Good", methods=("none",)).digests != first.digests
    assert len(answers_in(store) - kept) == 1


def test_what_nothing_could_be_judged_of_has_not_passed(laser: Path, store: Store) -> None:
    (laser / "laser.toml").write_text(SMALL_LASER.replace('"success >= 1 %", ', ""))
    result = campaign(laser, store, "own:Good", methods=("none",))
    assert result.verdict is Verdict.SKIPPED
    assert result.reasons == ("not judged: success_hmm >= 0 % (thesis/chain has no answers)",)


@pytest.mark.slow
def test_a_localiser_that_hangs_is_ended(refseq: Refseq, laser: Path) -> None:
    (laser / "laser.toml").write_text(SMALL_LASER)
    assert refseq("scenario", "run", "laser.toml", "--localiser", "own:Good", "-o", "out").code == 0
    # The recordings are there now, so that the limit is the localiser's alone.
    (laser / "laser.toml").write_text(SMALL_LASER.replace("seconds = 600.0", "seconds = 20.0"))
    answer = refseq("scenario", "run", "laser.toml", "--localiser", "own:Hanging", "--methods", "none", "-o", "out")
    assert answer.code == 1
    assert "not done within 20 s (limits.seconds)" in answer.err


def test_compare_asks_it_too(refseq: Refseq, here: Path) -> None:
    (here / "own.py").write_text(OWN)
    with RecordingWriter(here / "a.mcap", {"world": "corridor"}) as writer:
        for view in corridor_drive(np.random.default_rng(0), 6, size=24):
            writer.write(view, Pose(0.0, 0.0, 0.0))
    answer = refseq("compare", "a.mcap", "a.mcap", "--methods", "own:Good")
    assert answer.code == 0, answer.err
    assert "own:Good  100.0" in answer.out
    answer = refseq("compare", "a.mcap", "a.mcap", "--methods", "own:Good,own:Raising")
    assert answer.code == 1
    assert "own:Good  100.0" in answer.out  # whoever else was asked is not touched
    assert "Raising" not in answer.out
    assert answer.err.splitlines()[-1].startswith("failed: own:Raising, view 2: raised ZeroDivisionError")


PAGE = Path(__file__).resolve().parents[3] / "docs" / "own-localiser.md"


def blocks(kind: str) -> list[str]:
    """What stands in the page's blocks of a kind."""
    return [part.split("```", 1)[0] for part in PAGE.read_text().split(f"```{kind}\n")[1:]]


@pytest.mark.slow
def test_the_page_s_commands_do_what_it_says(refseq: Refseq, here: Path) -> None:
    (here / "first.toml").write_text(blocks("toml")[0])
    commands = [shlex.split(line) for block in blocks("sh") for line in block.splitlines()]
    ran = []
    for command in commands:
        if "smoke" in command or "fig-3.11-daylight" in command or "compare" in command:
            continue  # those drive for minutes, or need recordings that a reader has
        answer = refseq(*command[1:])
        ran.append((command[2], answer.code))
    assert [name for name, _ in ran] == ["template", "run", "report", "list"]
    assert all(code in (0, 1) for _, code in ran)
    assert (here / "out/first/index.html").is_file()
    assert "my_localiser:MyLocaliser" in refseq("scenario", "report", "out/first", "--figures").out


def test_the_page_s_tables_are_read() -> None:
    first, entry = (tomllib.loads(block) for block in blocks("toml"))
    assert first["reference"]["world"] == "annex"
    assert "refseq.localisers" in entry["project"]["entry-points"]
