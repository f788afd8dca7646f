"""The file of a map of several paths: what was written is read, and what is wrong is told in one line."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from refseq.atlas.merge import merge_maps
from refseq.errors import MapError
from refseq.map.learning import learn
from refseq.map.map import Map
from refseq.map.profile import BEST
from refseq.view import View
from tests.refseq.rooms import named_maps
from tests.support import corridor_drive

DAMAGED = settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])


@pytest.fixture(scope="module")
def drive() -> list[View]:
    return corridor_drive(np.random.default_rng(1), count=30, size=96)


@pytest.fixture(scope="module")
def atlas(drive: list[View]) -> Map:
    half = len(drive) // 2
    parts = {"first": drive[: half + 5], "second": drive[half - 5 :]}
    return merge_maps(named_maps(list(parts), [learn(views, profile=BEST) for views in parts.values()])).map


@pytest.fixture
def saved(atlas: Map, tmp_path: Path) -> Path:
    atlas.save(tmp_path / "atlas.refseq")
    return tmp_path / "atlas.refseq"


def loaded_or_reason(path: Path) -> tuple[Map | None, str]:
    try:
        return Map.load(path), ""
    except MapError as error:
        return None, str(error)


def test_what_was_saved_is_loaded(atlas: Map, saved: Path) -> None:
    loaded = Map.load(saved)
    assert loaded.names == atlas.names
    for one, other in zip(loaded.sequences, atlas.sequences, strict=True):
        np.testing.assert_array_equal(one.matrix.places, other.matrix.places)
        assert one.profile == other.profile
    for path, other_path in zip(loaded.paths, atlas.paths, strict=True):
        assert path.name == other_path.name
        for name in ("along", "sequences", "places"):
            np.testing.assert_array_equal(getattr(path, name), getattr(other_path, name))
    loaded.save(saved.with_name("again.refseq"))
    assert saved.with_name("again.refseq").read_bytes() == saved.read_bytes()


def test_what_takes_one_path_refuses_several(saved: Path) -> None:
    with pytest.raises(MapError, match="the map holds 2 paths, first, second; valid is a map of one"):
        _ = Map.load(saved).sequence


@DAMAGED
@given(share=st.floats(0, 1, exclude_max=True), flip=st.integers(1, 255))
def test_damage_is_found_or_spares_all_that_is_read(atlas: Map, saved: Path, share: float, flip: int) -> None:
    whole = saved.read_bytes()
    content = bytearray(whole)
    content[int(share * len(content))] ^= flip
    damaged = saved.with_name("damaged.refseq")
    damaged.write_bytes(content)
    loaded, refusal = loaded_or_reason(damaged)
    if loaded is None:
        assert refusal.startswith(f"{damaged}")
        assert "\n" not in refusal
        return
    assert [path.places.tolist() for path in loaded.paths] == [path.places.tolist() for path in atlas.paths]
