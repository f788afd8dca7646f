import sys
from collections.abc import Iterator
from importlib.metadata import EntryPoint
from pathlib import Path

import numpy as np
import pytest

from refseq.belief import Belief, Timings
from refseq.view import LASER, View
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.imports import closure
from refseq_bench.scenarios.imports.closure import closure_of, spec_of
from refseq_bench.scenarios.methods import plugins
from refseq_bench.scenarios.methods.baselines import Reference
from refseq_bench.scenarios.methods.by_name import Learnt, check_methods, methods_named
from refseq_bench.scenarios.methods.plugins import MisbehavedError, PluginLocaliser, check_plugin, plugin_digest
from tests.support import corridor_drive

GOOD = """
import numpy as np
from refseq.belief import Belief, Timings, belief_from

class Sly(Belief):
    path = property(lambda self: dict()["no"], lambda self, value: None)

class Mine:
    def __init__(self, views): self.views = views
    def reset(self): self.seen = []
    def update(self, view):
        self.seen.append(view)
        return {answer}
"""


@pytest.fixture(scope="module")
def views() -> list[View]:
    return corridor_drive(np.random.default_rng(0), 5, size=24)


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder to stand in, as a user does; modules that were imported from it are forgotten afterwards."""
    before = set(sys.modules)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [entry for entry in sys.path if entry])
    monkeypatch.setattr(sys, "dont_write_bytecode", True)  # two edits within a second must not find an old .pyc
    yield tmp_path
    for name in set(sys.modules) - before:
        if str(tmp_path) in str(getattr(sys.modules[name], "__file__", "")):
            del sys.modules[name]


def written(here: Path, text: str, module: str = "mine.py") -> None:
    (here / module).parent.mkdir(parents=True, exist_ok=True)
    (here / module).write_text(text)


def test_it_sees_no_truth_and_cannot_write_into_what_others_see(here: Path, views: list[View]) -> None:
    written(here, GOOD.format(answer="belief_from(np.ones(5))"))
    localiser = PluginLocaliser("mine:Mine", views)
    localiser.reset()
    localiser.update(views[1])
    seen = [*localiser._inner.views, *localiser._inner.seen]  # type: ignore[attr-defined]
    assert len(seen) == 6
    for one, shown in zip(seen, [*views, views[1]], strict=True):
        assert one.truth is None
        assert shown.truth is not None
        assert (one.time, one.distance, one.turn) == (shown.time, shown.distance, shown.turn)
        assert one.sensors == shown.sensors
        for array, original in [
            (one.scan.ranges, shown.scan.ranges),
            *((one.images[name], shown.images[name]) for name in shown.images),
        ]:
            assert np.array_equal(array, original)
            with pytest.raises(ValueError, match="read-only"):
                array[...] = 0
            assert original.flags.writeable  # the bench's own array is as it was
        with pytest.raises(TypeError):
            one.images["camera-9"] = np.zeros(3)


def test_answers_are_copied_and_timed(here: Path, views: list[View]) -> None:
    text = (
        GOOD.format(answer="self.kept(len(self.seen))")
        .replace("def reset", "{}\n    def reset")
        .format(
            "table = np.zeros(5)\n    def kept(self, n):\n        self.table[:] = 0; self.table[n] = 1\n"
            "        return Belief(self.table, np.float32(0), np.int64(n), [n], 0.0)"
        )
    )
    written(here, text)
    localiser = PluginLocaliser("mine:Mine", views)
    localiser.reset()
    beliefs = [localiser.update(view) for view in views[:3]]
    assert [int(np.argmax(belief.places)) for belief in beliefs] == [1, 2, 3]
    assert all(belief.timings.matching > 0 and belief.timings.features == 0 for belief in beliefs)
    assert beliefs[0] == Belief(beliefs[0].places, 0.0, 1, (1,), 0.0, beliefs[0].timings)
    assert type(beliefs[0].best) is int


def test_its_own_times_are_kept(here: Path, views: list[View]) -> None:
    written(here, GOOD.format(answer="belief_from(np.ones(5), timings=Timings(features=2.0))"))
    localiser = PluginLocaliser("mine:Mine", views)
    localiser.reset()
    assert localiser.update(views[0]).timings == Timings(features=2.0)


BAD_ANSWERS = [
    ("None", "answered NoneType; valid is refseq.belief.Belief"),
    ("np.ones(5) / 5", "answered ndarray; valid is refseq.belief.Belief"),
    ("Belief(np.ones(4) / 4, 0, 0, (0,), 0)", "places has shape (4,); valid is (5,), one a reference view"),
    ("Belief(np.eye(5), 0, 0, (0,), 0)", "places has shape (5, 5); valid is (5,), one a reference view"),
    ("Belief(0.2, 0, 0, (0,), 0)", "places has shape (); valid is (5,), one a reference view"),
    ("Belief('abc', 0, 0, (0,), 0)", "places is str; valid is an array (5,) of numbers"),
    ("Belief(None, 0, 0, (0,), 0)", "places has shape (); valid is (5,), one a reference view"),
    ("Belief(np.full(5, np.nan), 0, 0, (0,), 0)", "places holds what is no probability (nan, infinite or negative)"),
    ("Belief([2, -1, 0, 0, 0], 0, 0, (0,), 0)", "places holds what is no probability (nan, infinite or negative)"),
    ("Belief(np.ones(5), 0, 0, (0,), 0)", "places sums to 5; valid is 1"),
    ("Belief(np.ones(5) / 5, np.nan, 0, (0,), 0)", "lost is nan; valid is 0 to 1"),
    ("Belief(np.ones(5) / 5, 1.5, 0, (0,), 0)", "lost is 1.5; valid is 0 to 1"),
    ("Belief(np.ones(5) / 5, None, 0, (0,), 0)", "lost is None; valid is a number"),
    ("Belief(np.ones(5) / 5, 0, 5, (0,), 0)", "best is 5; valid is a whole number from 0 to 4"),
    ("Belief(np.ones(5) / 5, 0, 1.5, (0,), 0)", "best is 1.5; valid is a whole number from 0 to 4"),
    ("Belief(np.ones(5) / 5, 0, -1, (0,), 0)", "best is -1; valid is a whole number from 0 to 4"),
    ("Belief(np.ones(5) / 5, 0, 0, None, 0)", "path is None; valid is a tuple of places"),
    ("Belief(np.ones(5) / 5, 0, 0, (9,), 0)", "path is 9; valid is a whole number from 0 to 4, or -1 where it is lost"),
    ("Belief(np.ones(5) / 5, 0, 0, (0,), np.nan)", "entropy is nan; valid is 0 or more"),
    ("Belief(np.ones(5) / 5, 0, 0, (0,), np.inf)", "entropy is inf; valid is 0 or more"),
    ("Belief(np.ones(5) / 5, 0, 0, (0,), 0, 3)", "timings is int; valid is refseq.belief.Timings"),
    ("Belief([10**400] * 5, 0, 0, (0,), 0)", "places is list; valid is an array (5,) of numbers"),
    (
        "Belief(np.ones(5) / 5, 10**400, 0, (0,), 0)",
        "lost is 1000000000000000000000000000000000000000; valid is a number",
    ),
    ("Sly(np.ones(5) / 5, 0, 0, (0,), 0)", "raised KeyError: 'no' (mine.py, line 6)"),
    ("1 / 0", "raised ZeroDivisionError: division by zero (mine.py, line 13)"),
    ("view.truth.x", "raised AttributeError: 'NoneType' object has no attribute 'x' (mine.py, line 13)"),
    ("exit(3)", "raised SystemExit: 3 (mine.py, line 13)"),
    ("belief_from(np.zeros(5))", "raised RefseqError: belief: weights of shape (5,), at most 0, make no probabilities"),
]


@pytest.mark.parametrize(("answer", "told"), BAD_ANSWERS)
def test_what_is_no_answer_is_told_with_the_view_s_number(
    here: Path, views: list[View], answer: str, told: str
) -> None:
    written(here, GOOD.format(answer=f"belief_from(np.ones(5)) if len(self.seen) < 3 else {answer}"))
    localiser = PluginLocaliser("mine:Mine", views)
    localiser.reset()
    localiser.update(views[0])
    localiser.update(views[1])
    with pytest.raises(MisbehavedError) as caught:
        localiser.update(views[2])
    assert str(caught.value).startswith(f"mine:Mine, view 2: {told}")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("raise OSError('no\\nweights')\nMine = 1", "being imported: raised OSError: no weights (mine.py, line 1)"),
        ("import not_there_at_all\nMine = 1", "being imported: raised ModuleNotFoundError: No module named"),
        ("def Mine(:", "being imported: raised SyntaxError: invalid syntax"),
        ("Mine = 1", "being imported: raised TypeError: mine:Mine is no class but int"),
        ("class Mine: pass", "learning the reference drive: raised TypeError: Mine() takes no arguments"),
        (
            "class Mine:\n    def __init__(self, views): self.x = views[99]",
            "learning the reference drive: raised Index",
        ),
        ("class Mine:\n    def __init__(self, views): pass", " has no reset(); valid is what fits"),
        ("class Mine:\n    reset = len\n    def __init__(self, views): pass", " has no update(); valid is what fits"),
    ],
)
def test_what_breaks_before_the_first_view_is_its_own_failure(
    here: Path, views: list[View], text: str, told: str
) -> None:
    written(here, text)
    check_plugin("mine:Mine")  # the name is good: nothing more can be told without running it
    with pytest.raises(MisbehavedError) as caught:
        PluginLocaliser("mine:Mine", views)
    assert str(caught.value).startswith(("mine:Mine, " + told, "mine:Mine" + told))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("nowhere:Mine", "there is no module 'nowhere'; valid is package.module:Class, importable from "),
        ("mine.py:Mine", "there is no module 'mine.py' (a module is named without .py); valid is"),
        ("mine.inner:Mine", "there is no module 'mine.inner'; valid is"),
        ("mine:Yours", "mine.py has no 'Yours'; valid are Mine, np, SIZE"),
        ("mine:", "is not valid; it should be package.module:Class"),
        (":Mine", "is not valid; it should be package.module:Class"),
        ("my-own:Mine", "is not valid; it should be package.module:Class"),
    ],
)
def test_a_wrong_name_is_told_without_running_anything(here: Path, name: str, told: str) -> None:
    written(here, "class Mine: pass\nimport numpy as np\nSIZE = 3\nraise SystemExit('was run')")
    with pytest.raises(ScenarioError) as caught:
        check_methods(["vlad", name])
    assert str(caught.value).startswith(f"localiser {name!r}")
    assert told in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["from there import *", "def __getattr__(name): ...", "globals()['Mine'] = int"])
def test_a_name_that_only_running_could_tell_is_left_to_the_run(here: Path, text: str) -> None:
    written(here, text)
    check_plugin("mine:Mine")


def test_the_user_s_folder_hides_no_part_of_the_bench(here: Path, views: list[View]) -> None:
    written(here, "raise RuntimeError", "refseq_bench.py")
    written(here, GOOD.format(answer="belief_from(np.ones(5))"))
    PluginLocaliser("mine:Mine", views)
    found = spec_of("refseq_bench")
    assert found is not None
    assert str(here) not in str(found.origin)


# --- entry points ---


def test_entry_points_are_names_of_methods_but_never_hide_a_baseline(
    here: Path, views: list[View], monkeypatch: pytest.MonkeyPatch
) -> None:
    written(here, GOOD.format(answer="belief_from(np.ones(5))"))
    points = [EntryPoint("ours", "mine:Mine", plugins.GROUP), EntryPoint("vlad", "mine:Mine", plugins.GROUP)]
    monkeypatch.setattr(plugins, "entry_points", lambda group: points)
    plugins._entry_points.cache_clear()
    try:
        assert methods_named(["ours", "vlad"]) == ("ours", "vlad")
        learnt = Learnt(["ours", "vlad"], {"drive": Reference(views)})
        assert isinstance(learnt.localisers["ours"], PluginLocaliser)
        assert not isinstance(learnt.localisers["vlad"], PluginLocaliser)
        assert len(learnt.answers(views)["ours"]) == 5
    finally:
        plugins._entry_points.cache_clear()


# --- digests: equal as long as nothing differs that has a part in the answers ---


def changed_digest(here: Path, name: str, file: str, text: str) -> bool:
    before = plugin_digest(name)
    assert plugin_digest(name) == before
    written(here, text, file)
    return plugin_digest(name) != before


def test_a_digest_follows_the_module_and_what_it_imports_from_beside_it(here: Path) -> None:
    written(here, "import helper\nimport numpy\nclass Mine:\n    def f(self):\n        from deeper import tool")
    written(here, "", "helper.py")
    written(here, "X = 1", "deeper/tool.py")
    written(here, "", "stranger.py")
    for file in ("mine.py", "helper.py", "deeper/tool.py", "deeper/weights.bin"):
        text = (here / file).read_text() if (here / file).exists() else ""
        assert changed_digest(here, "mine:Mine", file, text + "\n# changed"), file
    assert not changed_digest(here, "mine:Mine", "stranger.py", "# changed")
    written(here, "class Mine: pass")
    assert not changed_digest(here, "mine:Mine", "helper.py", "# not imported any more")


def test_a_digest_follows_a_package_with_relative_imports_and_data(here: Path) -> None:
    written(here, "", "ours/__init__.py")
    written(here, "from ..tool import f\nclass Mine: pass", "ours/inner/mine.py")
    written(here, "import helper\ndef f(): pass", "ours/tool.py")
    written(here, "", "helper.py")
    for file in ("ours/__init__.py", "ours/inner/mine.py", "ours/tool.py", "ours/weights.npz", "helper.py"):
        assert changed_digest(here, "ours.inner.mine:Mine", file, "class Mine: pass\nimport helper"), file
    written(here, "rubbish", "ours/__pycache__/tool.cpython-311.pyc")
    assert not changed_digest(here, "ours.inner.mine:Mine", "ours/__pycache__/x.pyc", "other rubbish")


def test_a_digest_follows_a_file_that_is_moved_within_its_package(here: Path) -> None:
    written(here, "class Mine: pass", "ours/__init__.py")
    written(here, "1 2 3", "ours/by_day/weights.txt")
    before = plugin_digest("ours:Mine")
    (here / "ours/by_day").rename(here / "ours/by_night")
    assert plugin_digest("ours:Mine") != before


def test_a_digest_follows_the_versions_of_what_is_imported(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    written(here, "import numpy, scipy.stats, os\nclass Mine: pass")
    before = plugin_digest("mine:Mine")
    true = closure.version
    monkeypatch.setattr(closure, "version", lambda name: "9.9" if name == "scipy" else true(name))
    assert plugin_digest("mine:Mine") != before
    monkeypatch.setattr(closure, "version", lambda name: "9.9" if name == "pyarrow" else true(name))
    assert plugin_digest("mine:Mine") == before


def test_a_digest_follows_what_of_the_bench_one_would_build_on(here: Path) -> None:
    vlad = "refseq_bench/scenarios/methods/baselines/vlad.py"
    plugins._look_here()
    written(here, "from refseq_bench.scenarios.methods.baselines.vlad import VladMap\nclass Mine: pass")
    assert vlad in closure_of("mine").files
    written(here, "class Mine: pass")
    assert vlad not in closure_of("mine").files


def test_a_digest_follows_the_files_of_a_localiser_that_is_installed(
    here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One that is being written is often installed once, to be edited in its place: its version stays."""
    monkeypatch.setattr(closure, "_distributions", lambda: {"mine": ["mine"]})
    monkeypatch.setattr(closure, "version", lambda name: "1.0")
    written(here, "class Mine: pass")
    assert changed_digest(here, "mine:Mine", "mine.py", "class Mine: pass  # changed")


def test_sensors_of_the_corridor_are_what_the_tests_above_count_on(views: list[View]) -> None:
    assert LASER in views[0].sensors
    assert len(views[0].images) == 2
