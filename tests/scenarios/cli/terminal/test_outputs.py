"""Names of files to write by their endings."""

from pathlib import Path

import pytest

from refseq_bench.scenarios.cli.terminal.outputs import FIGURE, MAP
from refseq_bench.scenarios.errors import ScenarioError


@pytest.mark.parametrize("name", ["whole.refseq", "Whole.REFSEQ", "two.mcap.refseq", "folder"])
def test_names_of_the_kind_are_taken_and_folders_are_told_of_elsewhere(tmp_path: Path, name: str) -> None:
    (tmp_path / "folder").mkdir()
    MAP.check(tmp_path / name)
    MAP.check(None)


@pytest.mark.parametrize("name", ["whole.mcap", "whole", ".refseq", "mapfile"])
def test_other_names_are_refused_with_what_is_valid(name: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        MAP.check(Path(name))
    assert str(caught.value) == f"{name}: is no name of a map; valid is one that ends in .refseq"


def test_several_endings_are_listed() -> None:
    with pytest.raises(ScenarioError, match=r"valid is one that ends in \.png, \.svg or \.pdf$"):
        FIGURE.check(Path("plan.gif"))
