"""The files for CI servers and for pre-commit: valid against their schemas, and what they call exists."""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

from refseq_bench.scenarios.campaign.declare.cases import find
from tests.commands import check_commands, commands
from tests.pages import ROOT, pages
from tests.robustness.attack import attacks

WORKFLOW = ROOT / ".github" / "workflows" / "ci.yml"
NIGHTLY = WORKFLOW.with_name("nightly.yml")
HOOKS = ROOT / ".pre-commit-config.yaml"
PIECES = ("style", "types", "imports")
"""Of `run lint`."""


def jobs(workflow: Path) -> dict[str, Any]:
    found: dict[str, Any] = yaml.safe_load(workflow.read_text())["jobs"]
    return found


def steps(workflow: Path) -> Iterator[dict[str, Any]]:
    for job in jobs(workflow).values():
        yield from job["steps"]


def entries() -> list[str]:
    return [hook["entry"] for repo in yaml.safe_load(HOOKS.read_text())["repos"] for hook in repo["hooks"]]


def check_schema(file: Path, schema: str) -> str:
    """Objections of the schema to a file."""
    command = [sys.executable, "-m", "check_jsonschema", "--builtin-schema", f"vendor.{schema}", str(file)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return "" if done.returncode == 0 else done.stdout + done.stderr


@pytest.mark.parametrize("workflow", [WORKFLOW, NIGHTLY], ids=lambda workflow: workflow.stem)
def test_a_workflow_is_valid_and_the_schema_finds_a_mistake(workflow, tmp_path):
    wrong = tmp_path / "wrong.yml"
    wrong.write_text(workflow.read_text().replace("runs-on:", "runs-in:"))
    assert check_schema(workflow, "github-workflows") == ""
    assert "runs-in" in check_schema(wrong, "github-workflows")


@pytest.mark.parametrize(("place", "schema"), [(0, "github-workflows"), (1, "gitlab-ci")])
def test_the_examples_of_the_page_are_valid(place, schema, tmp_path):
    (page,) = [page for page in pages() if page.name == "docs/ci.md"]
    file = tmp_path / "example.yml"
    file.write_text([example for example in page.examples if example.language == "yaml"][place].code)
    assert check_schema(file, schema) == ""


def test_the_workflow_runs_the_gate_and_the_smoke_scenario():
    called = [" ".join(words) for step in steps(WORKFLOW) if "run" in step for words in commands(step["run"])]
    assert called[0] == ".ci/run"
    assert called[1].startswith("./run audit ")
    assert called[2].startswith("./run refseq scenario run smoke ")
    assert find(["smoke"])


def test_the_nightly_workflow_runs_every_family_of_attacks():
    assert jobs(NIGHTLY)["attacks"]["strategy"]["matrix"]["family"] == sorted(
        {one.family for one in attacks().values()}
    )


def test_the_nightly_workflow_covers_slow_tests_and_runs_benchmarks_and_audits():
    called = [step["run"] for step in steps(NIGHTLY) if "run" in step]
    parallel = "./run coverage --numprocesses logical --dist worksteal --durations 10"
    thorough = f'{parallel} -m "not benchmark" --hypothesis-profile thorough'
    assert called[1:] == [thorough, "./run bench --json bench.json", "./run audit || test $? = 2"]


CALLED = [step["run"] for workflow in (WORKFLOW, NIGHTLY) for step in steps(workflow) if "run" in step] + entries()


@pytest.mark.parametrize("code", CALLED)
def test_what_is_called_exists(code):
    check_commands(code)


def test_pre_commit_calls_each_piece_of_lint():
    assert entries() == [f"./run lint {piece}" for piece in PIECES]


def test_an_unknown_piece_of_lint_is_refused():
    text = (ROOT / "run").read_text()
    lint = text[text.index("\nlint() {") : text.index("\n}\n", text.index("\nlint() {")) + 3]
    script = f'die() {{ echo "$*"; exit 2; }}\n{lint}\nlint colours'
    told = subprocess.run(["sh", "-c", script], capture_output=True, text=True, check=False)
    assert (told.returncode, told.stdout) == (2, f"unknown piece 'colours' of lint; valid: {', '.join(PIECES)}\n")
