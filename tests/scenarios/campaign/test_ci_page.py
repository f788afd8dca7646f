"""The page's commands are what the command line takes."""

import re
import shlex
from pathlib import Path

import click
import pytest

from refseq_bench.scenarios.campaign.declare.cases import find
from refseq_bench.scenarios.campaign.pages.junit import JUNIT
from refseq_bench.scenarios.campaign.pages.verdicts import INDEX
from refseq_bench.scenarios.campaign.results import PAGE as CASE_PAGE
from refseq_bench.scenarios.campaign.store.result_file import RESULT
from refseq_bench.scenarios.cli.app import NAMES, command_tree
from refseq_bench.user_cache import VARIABLE

PAGE = (Path(__file__).resolve().parents[3] / "docs" / "ci.md").read_text()
COMMANDS = [line.split(">>")[0] for line in re.findall(r"(?:^|run: |- )(?:\./run )?(refseq scenario .*)$", PAGE, re.M)]


@pytest.mark.parametrize("line", COMMANDS)
def test_commands_of_the_page_are_taken(line: str) -> None:
    words = shlex.split(line)[1:]
    command: click.Command = command_tree(*NAMES)
    context = click.Context(command)
    while isinstance(command, click.Group):
        command = command.commands[words.pop(0)]
        context = click.Context(command, parent=context)
    command.parse_args(context, words)
    assert context.params
    for name in context.params.get("scenarios", ()):
        assert name.endswith(".toml") or find([name])


def test_page_names_what_a_campaign_leaves() -> None:
    assert len(COMMANDS) >= 6
    assert all(name in PAGE for name in (JUNIT, RESULT, INDEX, CASE_PAGE, VARIABLE))
