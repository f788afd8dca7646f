import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from refseq.belief import Stage
from refseq.logs import Recording
from refseq.map.learning import learn
from refseq.map.localiser import localise
from refseq_bench import scenarios
from refseq_bench.scenarios import api
from refseq_bench.scenarios.campaign.declare.outcomes import Verdict
from refseq_bench.scenarios.campaign.store.cache import Store
from refseq_bench.scenarios.drives.evaluate import compare
from refseq_bench.scenarios.scoring.path_geometry import NARROW
from refseq_bench.scenarios.scoring.score import score
from tests.scenarios.campaign.chores import AtOnce, scenario_in
from tests.support import corridor_drive


def recorded(seed: int) -> Recording:
    views = corridor_drive(np.random.default_rng(seed), count=12, size=48)
    return Recording(tuple(replace(view, images={}) for view in views), {})


def test_the_face_is_lazy_and_tells_its_names() -> None:
    only = "import sys; from refseq_bench import scenarios; print('numpy' in sys.modules, 'run' in dir(scenarios))"
    said = subprocess.run([sys.executable, "-c", only], capture_output=True, text=True, check=True).stdout
    assert said == "False True\n"
    for name in scenarios.__all__:
        assert getattr(scenarios, name) is not None
    with pytest.raises(AttributeError, match=r"^module 'refseq_bench.scenarios' has no attribute 'walk'; it has "):
        scenarios.walk  # noqa: B018


def test_a_score_is_the_one_that_the_commands_tell() -> None:
    reference, query = recorded(1), recorded(2)
    learnt = learn(reference.views, features=("walls", "boundary"))
    beliefs = localise(learnt, query.views, stages=(Stage.CHAIN,), seed=3)[Stage.CHAIN]
    found = scenarios.score(beliefs, query, learnt)
    compared = compare("x", learnt, query, stages=(Stage.CHAIN,), seed=3)
    assert found.outcomes == score(compared, Stage.CHAIN).outcomes
    assert found.success.trials == 12
    assert scenarios.score(beliefs, query, learnt, tolerance=NARROW).tolerance == NARROW
    with pytest.raises(scenarios.ScenarioError, match="11 answers; valid is one a query view, 12"):
        scenarios.score(beliefs[1:], query, learnt)


def test_a_scenario_runs_from_a_program(tmp_path: Path) -> None:
    with pytest.raises(scenarios.ScenarioError, match=r"^scenario 'nowhere' is unknown; valid are "):
        scenarios.run("nowhere", cache=tmp_path)


def test_a_scenario_run_gives_verdicts_figures_and_comparisons(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(api, "LocalWorkers", lambda _count, folder: AtOnce(Store(folder)))
    (result,) = scenarios.run(scenario_in(tmp_path), cache=tmp_path / "cache", seeds=(1,))
    assert (result.case.name, result.verdict) == ("tiny", Verdict.PASSED)
    assert [one.method for one in result.figures] == list(result.comparisons[0].beliefs)
    assert not (tmp_path / "index.html").exists()
