"""Atlases and maps that cannot be used: each is told in one line, and nothing else is raised."""

import hashlib
import json
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest

from refseq.atlas.decision import Decision
from refseq.atlas.merge import merge_maps
from refseq.atlas.overlap import OverlapSettings
from refseq.atlas.similarity import view_similarity
from refseq.errors import MapError
from refseq.map.format.archive import encode
from refseq.map.learning import learn
from refseq.map.map import Map, beside
from refseq.map.profile import BEST, THESIS, Profile
from refseq.view import LASER, View
from tests.refseq.rooms import named_maps
from tests.support import corridor_drive

SPOILT = "map.json and arrays do not make a map: "
OTHER_SIFT = replace(BEST, sift=replace(BEST.sift, cap=7))


@pytest.fixture(scope="module")
def drive() -> list[View]:
    return corridor_drive(np.random.default_rng(1), count=30, size=96)


@pytest.fixture(scope="module")
def atlas(drive: list[View]) -> Map:
    """Two halves of a drive, which share ten views: these are the first's."""
    halves = named_maps(["first", "second"], [learn(drive[:20], profile=BEST), learn(drive[10:], profile=BEST)])
    return merge_maps(halves, OverlapSettings(alone=0, clear=0)).map


@pytest.fixture
def saved(atlas: Map, tmp_path: Path) -> Path:
    atlas.save(tmp_path / "atlas.refseq")
    return tmp_path / "atlas.refseq"


def rewritten(
    path: Path,
    arrays: Mapping[str, np.ndarray | None] = MappingProxyType({}),
    header: Mapping[str, object] = MappingProxyType({}),
    names: Mapping[str, Sequence[str]] = MappingProxyType({}),
) -> None:
    """Other arrays, with checksums that are right, or none of that name; another header; other names in its tables."""
    with zipfile.ZipFile(path) as archive:
        content = {name: archive.read(name) for name in archive.namelist()}
    table = json.loads(content.pop("map.json"))
    for name, array in arrays.items():
        del content[f"{name}.npy"]
        if array is not None:
            content[f"{name}.npy"] = encode(array)
            table["sha256"][name] = hashlib.sha256(content[f"{name}.npy"]).hexdigest()
    for what, called in names.items():
        table[what] = [one | {"name": name} for one, name in zip(table[what], called, strict=False)]
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("map.json", json.dumps(table | dict(header)))
        for name, data in content.items():
            archive.writestr(name, data)


def error_of(path: Path) -> str:
    """What is told of a file, after its name."""
    with pytest.raises(MapError) as caught:
        Map.load(path)
    name, _, told = str(caught.value).partition(f"{path}: ")
    assert name == ""
    assert "\n" not in told
    return told


# --- files whose arrays are each right, but not together ---


@pytest.mark.parametrize(
    ("array", "values", "told"),
    [
        ("along", np.arange(19.0), "array paths/1/sequences is i8 of shape (20,); valid is i8 of shape (19,)"),
        ("along", np.zeros((20, 2)), "array paths/1/along is f8 of shape (20, 2); valid is f8 of shape (V,)"),
        ("along", np.zeros(20) + 1j, "array paths/1/along is c16 of shape (20,); valid is f8 of shape (V,)"),
        ("along", -np.arange(20.0), "path 'second': along is no list of distances that do not fall, at least one"),
        ("along", np.full(20, np.nan), "array paths/1/along holds nan; valid are numbers from -1e+09 to 1e+09"),
        ("sequences", np.full(20, 2), "path 'second' runs through sequence 2, which is not there"),
        ("sequences", np.full(20, -1), "array paths/1/sequences holds -1; valid are numbers from 0 to 1e+07"),
        ("sequences", np.zeros(20), "array paths/1/sequences is f8 of shape (20,); valid is i8 of shape (20,)"),
        ("sequences", np.zeros(20, int), "path 'second' does not run through place 0 of its sequence"),
        ("places", np.arange(20)[:, None], "array paths/1/places is i8 of shape (20, 1); valid is i8 of shape (20,)"),
        ("places", np.full(20, 20), "path 'second' runs through place 20, which is not there"),
        (
            "places",
            np.full(20, 2**63, np.uint64),
            "array paths/1/places is u8 of shape (20,); valid is i8 of shape (20,)",
        ),
        ("places", np.zeros(20, int), "path 'second' does not run through place 1 of its sequence"),
    ],
)
def test_arrays_that_disagree(saved: Path, array: str, values: np.ndarray, told: str) -> None:
    rewritten(saved, {f"paths/1/{array}": values})
    assert error_of(saved) == f"{SPOILT}{told}"


@pytest.mark.parametrize(
    ("names", "told"),
    [
        ({"sequences": ["first", "first"]}, "sequences: name 'first' is there twice"),
        ({"paths": ["first", "first"]}, "paths: name 'first' is there twice"),
        ({"sequences": ["first", "moon"]}, "sequence 'moon' has no path"),
        ({"paths": ["first"]}, "array 'paths/1/along' is not known here"),
        ({"sequences": ["second", "first"]}, "path 'second' does not run through place 0 of its sequence"),
    ],
)
def test_names_that_disagree(saved: Path, names: dict[str, list[str]], told: str) -> None:
    rewritten(saved, names=names)
    assert error_of(saved) == f"{SPOILT}{told}"


def test_a_path_through_its_places_in_another_order(atlas: Map, saved: Path) -> None:
    assert (atlas.paths[0].places == np.arange(20)).all()  # it is the second that gave places away
    rewritten(saved, {"paths/0/places": np.arange(20)[::-1].copy()})
    told = "path 'first' runs through places of its sequence more than once, or not in their order"
    assert error_of(saved) == f"{SPOILT}{told}"


def test_the_atlas_itself_is_read(atlas: Map, saved: Path) -> None:
    """So it is the changes above that are refused."""
    rewritten(saved)
    loaded = Map.load(saved)
    assert [len(path) for path in loaded.paths] == [20, 20]
    assert len(loaded) == len(atlas) < 40


def test_a_missing_array(saved: Path) -> None:
    rewritten(saved, {"sequences/1/along": None})
    assert error_of(saved) == "array sequences/1/along is missing"


def test_an_array_with_another_checksum(saved: Path) -> None:
    with zipfile.ZipFile(saved) as archive:
        digests = json.loads(archive.read("map.json"))["sha256"]
    rewritten(saved, header={"sha256": digests | {"sequences/0/along": "0" * 64}})
    assert error_of(saved) == "array sequences/0/along does not match its checksum: the file is damaged"


@pytest.mark.parametrize(
    "values", [np.full(20, "x"), np.zeros(20, [("a", "f8"), ("b", "i4")]), np.array(["x" * 99] * 20)]
)
def test_an_array_of_no_numbers(saved: Path, values: np.ndarray) -> None:
    rewritten(saved, {"paths/1/along": values})
    assert error_of(saved).startswith("array paths/1/along is no array of numbers: ")


# --- what is of another version, or of other settings ---


@pytest.mark.parametrize("version", [0, 3, "1", None])
def test_a_map_of_another_version(saved: Path, version: object) -> None:
    rewritten(saved, header={"version": version})
    assert error_of(saved) == f"is of map format version {version!r}; valid is 4: learn it anew"


@pytest.mark.parametrize(
    ("profile", "sensors", "told"),
    [
        (BEST, ["forward", LASER], "features are sift/forward, dense/forward, walls/laser"),
        (BEST, [LASER], "features are walls/laser"),
        (THESIS, None, "features are sift/forward, walls/laser"),
        (OTHER_SIFT, None, "profile.sift.cap is 7; valid is"),
    ],
)
def test_maps_of_other_sensors_or_vocabularies(
    drive: list[View], atlas: Map, saved: Path, profile: Profile, sensors: list[str] | None, told: str
) -> None:
    """All the same if they are compared, laid side by side, merged or read."""
    first, unlike = learn(drive[:8], profile=BEST), learn(drive[4:12], profile=profile, sensors=sensors)
    for refused in (
        lambda: view_similarity(unlike.sequence, first.sequence),
        lambda: beside(named_maps(["a", "b"], [first, unlike])),
        lambda: merge_maps(named_maps(["a", "b"], [first, unlike])),
        lambda: merge_maps([atlas, *named_maps(["b"], [unlike])]),
    ):
        with pytest.raises(MapError) as caught:
            refused()
        assert str(caught.value).startswith(told)
        assert "; valid " in str(caught.value)
        assert "\n" not in str(caught.value)
    unlike_file = replace(atlas, sequences=(atlas.sequences[0], unlike.sequence))
    if profile is BEST:  # a file has one profile
        unlike_file.save(saved)
        assert error_of(saved).startswith(f"{SPOILT}sequence 'second': {told}")


def test_the_last_of_several_is_refused_before_the_first_is_merged(drive: list[View]) -> None:
    asked: list[Decision] = []

    def ask(decision: Decision) -> Decision:
        asked.append(decision)
        return decision

    parts = [learn(views, profile=BEST) for views in (drive[:8], drive[4:12])]
    with pytest.raises(MapError, match="features are walls/laser"):
        merge_maps(named_maps(["a", "b", "c"], [*parts, learn(drive[:8], profile=BEST, sensors=[LASER])]), confirm=ask)
    assert asked == []


@pytest.mark.parametrize("name", ["a", "b"])
def test_wishes_about_views_that_are_not_there(drive: list[View], name: str) -> None:
    parts = [learn(drive[:6], profile=BEST), learn(drive[20:26], profile=BEST)]
    spans = [(70, 80) if name == one else (0, 5) for one in "ab"]
    wish = Decision("a", "b", spans[0], spans[1], (0.0, 0.0), True, "")
    with pytest.raises(MapError, match=f"^views 70 to 80 of '{name}' are not there, or joined already$"):
        merge_maps(named_maps(["a", "b"], parts), wishes=[wish])
