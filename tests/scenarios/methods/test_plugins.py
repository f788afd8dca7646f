import sys
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from refseq.view import LASER, View
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.imports import closure
from refseq_bench.scenarios.imports.closure import closure_of, spec_of
from refseq_bench.scenarios.methods import plugins
from refseq_bench.scenarios.methods.by_name import Learnt
from refseq_bench.scenarios.methods.checks import check_methods, methods_named
from refseq_bench.scenarios.methods.plugins import MisbehavedError, PluginLocaliser, check_plugin, plugin_digest
from refseq_bench.scenarios.methods.reference import Reference
from tests.scenarios.methods.folder import GOOD, written


def test_it_learns_and_answers_in_a_process_of_its_own(
    here: Path, views: list[View], capfd: pytest.CaptureFixture[str]
) -> None:
    written(
        here,
        GOOD.format(
            answer="print('said', len(self.seen)) or belief_from(np.ones(5), 0.8, lost_after=np.eye(5)[3] / 2)"
        ),
    )
    localiser = PluginLocaliser("mine:Mine", views)
    localiser.reset()
    assert [(found.best, found.last_sure) for found in map(localiser.update, views)] == [(0, 3)] * 5
    assert "mine" not in sys.modules
    assert localiser.bytes_elsewhere() > 5 * views[0].images["forward"].nbytes
    localiser.close()
    assert "said 5\n" in capfd.readouterr().err  # what it prints is shown


@pytest.mark.parametrize(
    ("answer", "told"),
    [
        ("np.ones(5) / 5", "mine:Mine, view 2: answered ndarray; valid is refseq.belief.Belief"),
        ("1 / 0", "mine:Mine, view 2: raised ZeroDivisionError: division by zero (mine.py, line 13)"),
        (
            "open('weights.npy')",
            "mine:Mine, view 2: raised FileNotFoundError: [Errno 2] No such file or directory: 'weights.npy' "
            "(mine.py, line 13); a localiser reads the files of its own package and starts no process "
            "(docs/localiser-protocol.md)",
        ),
        (
            "np.zeros(1 << 40)",
            "mine:Mine, view 2: raised MemoryError: Unable to allocate 8.00 TiB for an array with shape "
            "(1099511627776,) and data type float64 (mine.py, line 13); it may hold 4 GiB, unless "
            "REFSEQ_LOCALISER_LIMITS says otherwise",
        ),
        ("__import__('os')._exit(0)", "mine:Mine, view 2: the localiser ended with code 0"),
    ],
)
def test_a_mishap_is_told_with_the_view_s_number(here: Path, views: list[View], answer: str, told: str) -> None:
    written(here, GOOD.format(answer=f"belief_from(np.ones(5)) if len(self.seen) < 3 else {answer}"))
    localiser = PluginLocaliser("mine:Mine", views)
    localiser.reset()
    localiser.update(views[0])
    localiser.update(views[1])
    with pytest.raises(MisbehavedError) as caught:
        localiser.update(views[2])
    assert str(caught.value) == told
    assert ("Traceback" in caught.value.said) == ("raised" in told)


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
