"""The file of an atlas: what was written is read, and what is wrong is told in one line."""

import json
import zipfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from refseq.atlas.atlas import Atlas
from refseq.atlas.file import load_atlas, save_atlas
from refseq.atlas.merge import merge
from refseq.errors import MapError
from refseq.map.file import load_map, save_map
from refseq.map.profile import BEST
from refseq.map.sequence import learn
from refseq.view import View
from tests.support import corridor_drive

DAMAGED = settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])


@pytest.fixture(scope="module")
def drive() -> list[View]:
    return corridor_drive(np.random.default_rng(1), count=30, size=96)


@pytest.fixture(scope="module")
def atlas(drive: list[View]) -> Atlas:
    half = len(drive) // 2
    parts = {"first": drive[: half + 5], "second": drive[half - 5 :]}
    return merge(list(parts), [learn(views, profile=BEST) for views in parts.values()]).atlas


@pytest.fixture
def saved(atlas: Atlas, tmp_path: Path) -> Path:
    save_atlas(atlas, tmp_path / "atlas.refseq")
    return tmp_path / "atlas.refseq"


def error_of(path: Path) -> str:
    with pytest.raises(MapError) as caught:
        load_atlas(path)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def loaded_or_reason(path: Path) -> tuple[Atlas | None, str]:
    try:
        return load_atlas(path), ""
    except MapError as error:
        return None, str(error)


def rewritten(path: Path, **changes: object) -> None:
    with zipfile.ZipFile(path) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    header = json.loads(members["atlas.json"]) | changes
    members["atlas.json"] = json.dumps(header).encode()
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in members.items():
            archive.writestr(name, content)


def test_what_was_saved_is_loaded(atlas: Atlas, saved: Path) -> None:
    loaded = load_atlas(saved)
    assert loaded.names == atlas.names
    for one, other in zip(loaded.sequences, atlas.sequences, strict=True):
        np.testing.assert_array_equal(one.matrix.places, other.matrix.places)
        assert one.profile == other.profile
    for path, other_path in zip(loaded.paths, atlas.paths, strict=True):
        assert path.name == other_path.name
        for name in ("along", "sequences", "places"):
            np.testing.assert_array_equal(getattr(path, name), getattr(other_path, name))
    save_atlas(loaded, saved.with_name("again.refseq"))
    assert saved.with_name("again.refseq").read_bytes() == saved.read_bytes()


def test_a_map_is_an_atlas_of_one_and_an_atlas_no_map(atlas: Atlas, saved: Path, tmp_path: Path) -> None:
    save_map(atlas.sequences[0], tmp_path / "one.refseq")
    loaded = load_atlas(tmp_path / "one.refseq")
    assert loaded.names == ("one",)
    assert len(loaded) == len(atlas.sequences[0])
    with pytest.raises(MapError, match="is an atlas of several sequences; valid is a map of one"):
        load_map(saved)


def test_files_that_are_no_atlas(saved: Path, tmp_path: Path) -> None:
    assert (
        error_of(tmp_path / "none.refseq") == f"{tmp_path / 'none.refseq'}: cannot be read: No such file or directory"
    )
    (tmp_path / "text.refseq").write_text("hello")
    assert "is not a .refseq file, or is damaged" in error_of(tmp_path / "text.refseq")
    rewritten(saved, version=7)
    assert error_of(saved) == f"{saved}: is of atlas format version 7; valid is 1: merge anew"


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"paths": 3}, "atlas.json: paths is no list of names"),
        ({"sequences": [1]}, "atlas.json: sequences is no list of names"),
        ({"sha256": []}, "atlas.json: sha256 is no table of checksums"),
        ({"format": "other"}, "is no atlas: atlas.json has no format 'refseq-atlas'"),
        ({"paths": []}, "atlas.json and members do not make an atlas: there is no sequence or no path"),
        ({"paths": ["a", "b", "c"]}, "atlas.json and members do not make an atlas: 'paths/2/along.npy' is missing"),
    ],
)
def test_headers_that_do_not_fit(saved: Path, change: dict[str, object], told: str) -> None:
    rewritten(saved, **change)
    assert error_of(saved) == f"{saved}: {told}"


@DAMAGED
@given(share=st.floats(0, 1, exclude_max=True), flip=st.integers(1, 255))
def test_damage_is_found_or_spares_all_that_is_read(atlas: Atlas, saved: Path, share: float, flip: int) -> None:
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
