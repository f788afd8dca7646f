"""The names that `worlds` gives to programs."""

import subprocess
import sys

import pytest

from refseq_bench import worlds


def test_every_name_is_found_and_listed() -> None:
    assert [name for name in worlds.__all__ if getattr(worlds, name) is None] == []
    assert set(worlds.__all__) <= set(dir(worlds))


def test_an_unknown_name_is_told_with_those_there_are() -> None:
    with pytest.raises(
        AttributeError, match=r"module 'refseq_bench.worlds' has no attribute 'build_word'; it has Change, .*World"
    ):
        _ = worlds.build_word


def test_mujoco_is_not_imported_before_it_is_needed() -> None:
    code = (
        "import sys; from refseq_bench import worlds; worlds.light_named('morning'); sys.exit('mujoco' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_a_named_world_in_a_named_light_compiles() -> None:
    world = worlds.build_world(worlds.load_plan("annex"), worlds.light_named("morning"))
    assert world.spec.compile().ngeom > 100
