import hashlib
import io
import json
import os
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from refseq.belief import Stage
from refseq.errors import MapError
from refseq.inference.matching.mixture import MixtureSettings
from refseq.map.extractors import FEATURES
from refseq.map.format import archive as archive_module
from refseq.map.learning import learn
from refseq.map.localiser import localise
from refseq.map.map import Map
from refseq.map.profile import BEST, Profile
from refseq.view import LASER, View
from tests.support import corridor_drive

quick = settings(derandomize=True)
Header = dict[str, object]


@pytest.fixture(scope="module")
def views() -> list[View]:
    views = corridor_drive(np.random.default_rng(1), count=8, size=96)
    views[3] = replace(views[3], truth=None)
    return views


@pytest.fixture(scope="module")
def learnt(views: list[View]) -> Map:
    profile = replace(Profile(), mixture=MixtureSettings(cost=0.9))
    return learn(
        views, profile=profile, metadata={"world": "Gang 1", "seed": "3"}, features=("sift", "walls", "sectors")
    )


@pytest.fixture
def saved(learnt: Map, tmp_path: Path) -> Path:
    learnt.save(tmp_path / "map.refseq")
    return tmp_path / "map.refseq"


def test_a_loaded_map_is_the_saved_one(learnt: Map, saved: Path) -> None:
    loaded = Map.load(saved)
    assert loaded.profile == learnt.profile
    assert loaded.metadata == learnt.metadata
    assert loaded.poses == learnt.poses
    assert loaded.poses[3] is None
    np.testing.assert_array_equal(loaded.sequence.odometry, learnt.sequence.odometry)
    np.testing.assert_array_equal(loaded.paths[0].times, learnt.paths[0].times)
    assert len(learnt.paths[0].times) == len(learnt)
    assert loaded.paths[0].loops.shape == (0, 2)
    assert loaded.sensors == {"forward", "lateral", LASER}
    assert [e.key for e in loaded.sequence.extractors] == [e.key for e in learnt.sequence.extractors]
    np.testing.assert_array_equal(loaded.sequence.along, learnt.sequence.along)
    np.testing.assert_array_equal(loaded.paths[0].along, learnt.paths[0].along)
    np.testing.assert_array_equal(loaded.sequence.emissions.similarity, learnt.sequence.emissions.similarity)


def test_a_path_without_a_name_is_called_as_its_file(learnt: Map, tmp_path: Path) -> None:
    assert learnt.names == ("",)
    for name, called in (("", "east"), ("west", "west")):
        learnt.named(name).save(tmp_path / "east.refseq")
        loaded = Map.load(str(tmp_path / "east.refseq"))
        assert (loaded.names, loaded.paths[0].name) == ((called,), called)


def test_a_loaded_map_gives_the_same_beliefs(learnt: Map, saved: Path, views: list[View]) -> None:
    query = views[1:6]
    ours, theirs = localise(learnt, query, seed=4), localise(Map.load(saved), query, seed=4)
    for stage in Stage:
        for one, other in zip(ours[stage], theirs[stage], strict=True):
            np.testing.assert_array_equal(one.places, other.places)
            assert (one.lost, one.best, one.path, one.entropy) == (other.lost, other.best, other.path, other.entropy)


def test_the_same_map_gives_the_same_bytes(learnt: Map, saved: Path, views: list[View]) -> None:
    Map.load(saved).named("").save(saved.with_name("again.refseq"))
    assert saved.with_name("again.refseq").read_bytes() == saved.read_bytes()
    with zipfile.ZipFile(saved) as archive:
        assert {member.date_time[0] for member in archive.infolist()} == {1980}  # no clock is in it


def test_saving_is_in_one_step(learnt: Map, saved: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = saved.read_bytes()

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(MapError) as caught:
        learnt.noted({"new": "map"}).save(saved)
    assert str(caught.value) == f"{saved}: cannot be written: No space left on device"
    assert saved.read_bytes() == before
    assert list(saved.parent.iterdir()) == [saved]


def encoded(array: np.ndarray, allow_pickle: bool = False) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, array, allow_pickle=allow_pickle)
    return buffer.getvalue()


def rewrite(path: Path, header: Callable[[Header], object] | None = None, **members: bytes | None) -> None:
    """Change a map: its header by a function, its arrays by new bytes with their checksum, or by None to drop them."""
    with zipfile.ZipFile(path) as archive:
        content = {name: archive.read(name) for name in archive.namelist()}
    table = json.loads(content["map.json"])
    for name, data in members.items():
        if data is None:
            del content[f"{name}.npy"]
        else:
            content[f"{name}.npy"] = data
            table["sha256"][name] = hashlib.sha256(data).hexdigest()
    if header is not None:
        table = header(table) or table
    content["map.json"] = json.dumps(table).encode()
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in content.items():
            archive.writestr(name, data)


def error_of(path: Path) -> str:
    with pytest.raises(MapError) as caught:
        Map.load(path)
    return str(caught.value)


def test_loops_of_a_path_are_kept(learnt: Map, tmp_path: Path) -> None:
    looped = replace(learnt, paths=(replace(learnt.paths[0], loops=np.array([[0, 4], [1, 5], [1, 7]])),))
    looped.save(tmp_path / "looped.refseq")
    loaded = Map.load(tmp_path / "looped.refseq")
    assert loaded.paths[0].loops.tolist() == loaded.loops.tolist() == [[0, 4], [1, 5], [1, 7]]
    assert loaded.to_bytes() == looped.named("looped").to_bytes()


def test_files_that_are_no_map(tmp_path: Path) -> None:
    path = tmp_path / "map.refseq"
    assert error_of(path) == f"{path}: cannot be read: No such file or directory"
    path.write_text("hello")
    assert error_of(path) == f"{path}: is not a .refseq map, or is damaged: it does not end as a map does"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("a", "b")
    assert error_of(path) == f"{path}: is not a .refseq map: map.json is missing or no JSON"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("map.json", '{"format": "other"}')
    assert error_of(path) == f"{path}: is not a .refseq map: map.json has no format 'refseq-map'"


def test_another_version(saved: Path) -> None:
    rewrite(saved, lambda header: header.update(version=2))
    assert error_of(saved) == f"{saved}: is of map format version 2; valid is 4: learn it anew"
    rewrite(saved, lambda header: header.update(version=5))
    assert error_of(saved) == f"{saved}: is of map format version 5; valid is 4: a newer refseq wrote it"


def test_more_than_a_map_may_hold_is_neither_read_nor_written(
    saved: Path, learnt: Map, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(archive_module, "MAP_BYTES", 2**20)
    rewrite(saved, **{"sequences/0/places": encoded(np.zeros(2**20, np.int32))})
    assert error_of(saved).startswith(f"{saved}: its arrays take 4 MiB; valid are 1 at most")
    huge = replace(learnt.sequence, odometry=np.zeros((2**20, 3)))
    with pytest.raises(MapError, match="its arrays take 24 MiB; valid are 1 at most"):
        Map.of(huge).save(saved)


def test_no_array_is_allocated_by_what_its_header_says(saved: Path) -> None:
    lie = encoded(np.zeros(1)).replace(b"(1,), }           ", b"(10000000000,), } ")
    rewrite(saved, **{"sequences/0/along": lie})
    assert error_of(saved).endswith("it holds 8 bytes; valid are the 80000000000 that f8 of shape (10000000000,) takes")


def test_a_pipe_is_no_map(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.refseq")
    assert error_of(tmp_path / "pipe.refseq").endswith("cannot be read: is a pipe; valid is a file")
    assert error_of(tmp_path).endswith("cannot be read: is a folder; valid is a file")
    assert error_of(Path("/dev/zero")).endswith("cannot be read: is a device; valid is a file")


@pytest.mark.parametrize("constant", ["Infinity", "NaN", "1" + 400 * "0"])
def test_numbers_that_no_parameter_can_be(saved: Path, constant: str) -> None:
    with zipfile.ZipFile(saved) as archive:
        text = archive.read("map.json").decode()
    with zipfile.ZipFile(saved, "w") as archive:
        archive.writestr("map.json", text.replace('"slack": 0.5', f'"slack": {constant}'))
    assert error_of(saved).startswith(
        (f"{saved}: is not a .refseq map", f"{saved}: {SPOILT}profile.motion.slack is 1000")
    )


@pytest.mark.parametrize("share", [0.2, 0.7, 0.99])
def test_truncated(saved: Path, share: float) -> None:
    content = saved.read_bytes()
    saved.write_bytes(content[: int(share * len(content))])
    assert error_of(saved) == f"{saved}: is not a .refseq map, or is damaged: it does not end as a map does"


def loaded_or_reason(path: Path) -> tuple[Map | None, str]:
    try:
        return Map.load(path), ""
    except MapError as error:
        return None, str(error)


@quick
@given(share=st.floats(0, 1, exclude_max=True), flip=st.integers(1, 255))
def test_damage_is_found(learnt: Map, tmp_path_factory: pytest.TempPathFactory, share: float, flip: int) -> None:
    """A flipped byte either spares all that is read or is refused in one line."""
    path = tmp_path_factory.mktemp("flip") / "map.refseq"
    learnt.save(path)
    content = bytearray(path.read_bytes())
    content[int(share * len(content))] ^= flip
    path.write_bytes(content)
    loaded, refusal = loaded_or_reason(path)
    if loaded is None:
        assert refusal.startswith(f"{path}: ")
        assert "\n" not in refusal
        return
    np.testing.assert_array_equal(loaded.sequence.matrix.places, learnt.sequence.matrix.places)
    np.testing.assert_array_equal(loaded.sequence.along, learnt.sequence.along)
    assert loaded.profile == learnt.profile
    assert loaded.metadata == learnt.metadata


def test_wrong_checksum(saved: Path) -> None:
    def spoil(header: Header) -> None:
        header["sha256"]["sequences/0/places"] = "0" * 64  # type: ignore[index]

    rewrite(saved, spoil)
    assert error_of(saved) == f"{saved}: array sequences/0/places does not match its checksum: the file is damaged"


def test_missing_arrays(saved: Path) -> None:
    content = saved.read_bytes()
    rewrite(saved, **{"sequences/0/places": None})
    assert error_of(saved) == f"{saved}: array sequences/0/places is missing"
    saved.write_bytes(content)

    def forget(header: Header) -> None:
        del header["sha256"]["sequences/0/along"]  # type: ignore[attr-defined]

    rewrite(saved, forget)
    assert error_of(saved) == f"{saved}: map.json and arrays do not make a map: array sequences/0/along is missing"


def test_a_pickled_array_is_refused_and_not_run(saved: Path, tmp_path: Path) -> None:
    class Trap:
        def __reduce__(self) -> tuple[object, ...]:
            return (Path.touch, (tmp_path / "sprung",))

    rewrite(saved, **{"sequences/0/along": encoded(np.array([Trap()], dtype=object), allow_pickle=True)})
    assert error_of(saved) == (
        f"{saved}: array sequences/0/along is no array of numbers: "
        "its header is b\"{'descr': '|O', 'fortran_order': False, 'shape': (1,), }\"; "
        "valid is one of plain numbers in C order"
    )
    assert not (tmp_path / "sprung").exists()


def test_arrays_that_do_not_fit(saved: Path, learnt: Map) -> None:
    sequence = learnt.sequence
    places = sequence.matrix.places.copy()
    places[0] = 8
    content = saved.read_bytes()
    start = f"{saved}: map.json and arrays do not make a map: "
    rewrite(saved, **{"sequences/0/places": encoded(places)})
    assert error_of(saved) == f"{start}a feature is at place 8; valid are 0 to 7"

    saved.write_bytes(content)
    rewrite(saved, **{"sequences/0/pointers": encoded(sequence.matrix.pointers[:-1])})
    n = sequence.matrix.N
    told = f"is i8 of shape ({n},); valid is i8 of shape ({n + 1},)"
    assert error_of(saved) == f"{start}array sequences/0/pointers {told}"
    rewrite(saved, **{"sequences/0/pointers": encoded(np.append(sequence.matrix.pointers[:-1], 0))})
    assert error_of(saved) == f"{start}pointers do not rise from 0 to {len(places)} in {n} steps"

    saved.write_bytes(content)
    rewrite(saved, **{"sequences/0/poses": encoded(np.zeros((5, 3)))})
    assert error_of(saved) == f"{start}array sequences/0/poses is f8 of shape (5, 3); valid is f8 of shape (8, 3)"
    rewrite(saved, **{"sequences/0/poses": encoded(np.zeros((8, 3))), "sequences/0/odometry": encoded(np.ones((7, 3)))})
    assert error_of(saved) == f"{start}array sequences/0/odometry is f8 of shape (7, 3); valid is f8 of shape (8, 3)"

    saved.write_bytes(content)
    rewrite(saved, **{"paths/0/times": encoded(np.zeros(7))})
    assert error_of(saved) == f"{start}array paths/0/times is f8 of shape (7,); valid is f8 of shape (8,)"
    rewrite(saved, **{"paths/0/times": encoded(np.array([*np.arange(7.0), np.nan]))})
    assert error_of(saved).startswith(f"{start}array paths/0/times holds nan; valid are numbers from ")
    saved.write_bytes(content)
    for pairs, told in (
        ([[2, 2]], "path '' comes back to view 2 at view 2; valid is an earlier and a later view of its 8"),
        ([[1, 7], [3, 8]], "path '' comes back to view 3 at view 8; valid is an earlier and a later view of its 8"),
        ([[-1, 3]], "array paths/0/loops holds -1; valid are numbers from 0 to "),
        ([[1, 2, 3]], "array paths/0/loops is i8 of shape (1, 3); valid is i8 of shape (L, 2)"),
    ):
        rewrite(saved, **{"paths/0/loops": encoded(np.array(pairs))})
        assert error_of(saved).startswith(f"{start}{told}")

    saved.write_bytes(content)
    # A map of before does not tell when its views were taken.
    rewrite(saved, **{"paths/0/times": encoded(np.zeros(0))})
    assert len(Map.load(saved).paths[0].times) == 0

    saved.write_bytes(content)
    rewrite(saved, **{"sequences/0/features/sift/forward/words": encoded(np.zeros((2, 128), np.uint8))})
    size = len(sequence.matrix.blocks["sift/forward"])
    words = "array sequences/0/features/sift/forward/words"
    assert error_of(saved) == f"{start}{words} is u1 of shape (2, 128); valid is u1 of shape ({size}, 128)"


@pytest.mark.parametrize("number", range(3))
def test_a_pose_is_known_whole_or_not_at_all(saved: Path, number: int) -> None:
    poses = np.ones((8, 3))
    poses[3] = np.nan
    rewrite(saved, **{"sequences/0/poses": encoded(poses)})
    assert [pose is None for pose in Map.load(saved).poses] == [place == 3 for place in range(8)]
    poses[5, number] = np.nan
    rewrite(saved, **{"sequences/0/poses": encoded(poses)})
    assert f"{SPOILT}array sequences/0/poses holds nan; valid are numbers from " in error_of(saved)


SPOILT = "map.json and arrays do not make a map: "


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"profile": []}, f"{SPOILT}profile is no table"),
        ({"sequences": 3}, f"{SPOILT}sequences is no list of tables"),
        ({"sequences": []}, f"{SPOILT}sequences is no list of tables"),
        ({"paths": [1]}, f"{SPOILT}paths is no list of tables"),
        ({"paths": [{"name": 3}]}, f"{SPOILT}paths: a name is no text"),
        ({"sha256": {"along": 1}}, "map.json: sha256 is no table of checksums"),
    ],
)
def test_headers_that_do_not_fit(saved: Path, change: Header, message: str) -> None:
    rewrite(saved, lambda header: {**header, **change})
    assert error_of(saved).startswith(f"{saved}: {message}")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"blocks": 3}, "blocks is no table"),
        ({"metadata": None}, "metadata is no table"),
        ({"blocks": {"walls/laser": 3.0}}, "blocks: 'walls/laser' has 3.0 features; valid are 0 to 100000000"),
        ({"blocks": {"walls/laser": 10**400}}, "blocks: 'walls/laser' has 1000"),
        ({"metadata": {"a": [1]}}, "metadata: 'a' is [1]; valid is a text"),
    ],
)
def test_tables_of_a_sequence_that_do_not_fit(saved: Path, change: Header, message: str) -> None:
    rewrite(saved, lambda header: header["sequences"][0].update(change))  # type: ignore[index]
    assert error_of(saved).startswith(f"{saved}: {SPOILT}{message}")


def test_an_unknown_feature(saved: Path, learnt: Map) -> None:
    blocks = {"smell/nose": learnt.sequence.matrix.N}
    rewrite(saved, lambda header: header["sequences"][0].update(blocks=blocks))  # type: ignore[index]
    assert error_of(saved) == (
        f"{saved}: feature 'smell/nose' is unknown; valid are {', '.join(FEATURES)}, a slash and a fitting sensor"
    )


def test_files_of_the_format_before(saved: Path) -> None:
    with zipfile.ZipFile(saved, "w") as archive:
        archive.writestr("atlas.json", '{"format": "refseq-atlas", "version": 1}')
    assert error_of(saved) == f"{saved}: is an atlas of map format version 3; valid is 4: learn and merge anew"
    with zipfile.ZipFile(saved, "w") as archive:
        archive.writestr("map.json", '{"format": "refseq-map", "version": 3, "guide": {}}')
    assert error_of(saved) == f"{saved}: is of map format version 3; valid is 4: learn it anew"


# --- a map of the profile best ---


@pytest.fixture(scope="module")
def best(views: list[View]) -> Map:
    return learn(views, profile=BEST)


@pytest.fixture
def saved_best(best: Map, tmp_path: Path) -> Path:
    best.save(tmp_path / "best.refseq")
    return tmp_path / "best.refseq"


def test_a_loaded_map_of_evidence_gives_the_same_beliefs(best: Map, saved_best: Path, views: list[View]) -> None:
    loaded = Map.load(saved_best)
    assert loaded.profile == BEST
    features = {key.partition("/")[0] for key in loaded.sequence.matrix.blocks}
    assert features == {"sift", "dense", "walls", "doors", "boundary", "sectors"} & set(BEST.features)
    assert "dense" in features
    ours, theirs = localise(best, views), localise(loaded, views)
    assert [belief.best for belief in ours[Stage.CHAIN]] == pytest.approx(range(len(views)), abs=1)
    for stage in Stage:
        for one, other in zip(ours[stage], theirs[stage], strict=True):
            assert one.places.tobytes() == other.places.tobytes()
            assert (one.lost, one.best, one.path, one.entropy) == (other.lost, other.best, other.path, other.entropy)
    loaded.named("").save(saved_best.with_name("again.refseq"))
    assert saved_best.with_name("again.refseq").read_bytes() == saved_best.read_bytes()


@pytest.mark.parametrize(
    ("part", "name", "value", "message"),
    [
        ("method", "matching", "guess", "profile.method.matching is 'guess'; valid are mixture, log_ratio"),
        ("method", "decoding", [], "profile.method.decoding is []; valid are viterbi, forward"),
        ("sift", "root", 1, "profile.sift.root is 1; valid is true or false"),
        ("log_ratio", "blind", "0.2", "profile.log_ratio.blind is '0.2'; valid is a number from 0 to 1"),
        ("log_ratio", "blind", 1.5, "profile.log_ratio.blind is 1.5; valid is a number from 0 to 1"),
        ("dense", "codes", None, "profile.dense.codes is None; valid is a whole number from 1 to 64"),
    ],
)
def test_values_that_a_profile_cannot_have(saved_best: Path, part: str, name: str, value: object, message: str) -> None:
    def spoil(header: Header) -> None:
        header["profile"][part][name] = value  # type: ignore[index]

    rewrite(saved_best, spoil)
    assert error_of(saved_best) == f"{saved_best}: map.json and arrays do not make a map: {message}"


def test_a_profile_without_the_parts_of_evidence(saved_best: Path) -> None:
    def forget(header: Header) -> None:
        del header["profile"]["log_ratio"]  # type: ignore[attr-defined]

    rewrite(saved_best, forget)
    assert error_of(saved_best) == (
        f"{saved_best}: map.json and arrays do not make a map: "
        "profile.log_ratio is None; "
        "valid is a table of apart, blind, fixes, geometry, scans, scans_alone, scores, screened, tail, turns, usual, "
        "views"
    )


@pytest.mark.parametrize(
    ("word", "told"),
    [
        (-1, "array sequences/0/features/dense/forward/words holds -1; valid are numbers from 0 to 1e+09"),
        (10**9, "dense/forward has word 1000000000; valid are 0 to 6143"),
    ],
)
def test_grid_words_that_there_are_not(saved_best: Path, best: Map, word: int, told: str) -> None:
    (dense,) = (e for e in best.sequence.extractors if e.key == "dense/forward")
    words = dense.state()["words"].copy()
    words[3] = word
    rewrite(saved_best, **{"sequences/0/features/dense/forward/words": encoded(words)})
    assert error_of(saved_best) == (f"{saved_best}: map.json and arrays do not make a map: {told}")


# --- keys of places ---


@pytest.fixture(scope="module")
def with_keys(views: list[View]) -> Map:
    return learn(views, profile="best+log_ratio.geometry=6", features=("sift",))


@pytest.fixture
def saved_with_keys(with_keys: Map, tmp_path: Path) -> Path:
    with_keys.save(tmp_path / "keys.refseq")
    return tmp_path / "keys.refseq"


def test_keys_of_places_are_kept(with_keys: Map, saved_with_keys: Path, views: list[View]) -> None:
    loaded = Map.load(saved_with_keys)
    assert sorted(loaded.paths[0].keys) == ["forward", "lateral"]
    for camera, keys in with_keys.paths[0].keys.items():
        its = loaded.paths[0].keys[camera]
        assert keys.counts.sum() > 0
        for name in ("counts", "points", "packed"):
            np.testing.assert_array_equal(getattr(its, name), getattr(keys, name))
    ours, theirs = localise(with_keys, views[:3]), localise(loaded, views[:3])
    for stage in Stage:
        for one, other in zip(ours[stage], theirs[stage], strict=True):
            assert one.places.tobytes() == other.places.tobytes()


COUNTS, POINTS, PACKED = (f"paths/0/keys/forward/{name}" for name in ("counts", "points", "packed"))


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        (
            COUNTS,
            lambda a: np.concatenate([a[:1] + 1, a[1:]]),
            "path '': forward has {M} keys; its counts make {N}",
        ),
        (COUNTS, lambda a: a[:-1], f"array {COUNTS} is i4 of shape (7,); valid is i4 of shape (8,)"),
        (COUNTS, lambda a: a - 1000, f"array {COUNTS} holds {{least}}; valid are numbers from 0 to 200"),
        (COUNTS, lambda a: a + np.int32(201), f"array {COUNTS} holds {{most}}; valid are numbers from 0 to 200"),
        (
            POINTS,
            lambda a: a.astype("f4"),
            f"array {POINTS} is f4 of shape ({{M}}, 2); valid is u2 of shape (M forward, 2)",
        ),
        (PACKED, lambda a: a[:-1], f"array {PACKED} is u1 of shape ({{L}}, 64); valid is u1 of shape ({{M}}, 64)"),
        (PACKED, None, "'forward/packed' is missing"),
        (COUNTS, None, "'forward/counts' is missing"),
    ],
)
def test_keys_that_are_damaged(
    saved_with_keys: Path, with_keys: Map, name: str, change: Callable[[np.ndarray], np.ndarray] | None, message: str
) -> None:
    keys = with_keys.paths[0].keys["forward"]
    given = getattr(keys, name.rpartition("/")[2])
    M = len(keys.points)
    numbers = {"M": M, "L": M - 1, "N": M + 1}
    if change is not None and name == COUNTS:
        numbers |= {"least": change(given).min(), "most": change(given).max()}

    def forget(header: Header) -> None:
        if change is None:
            del header["sha256"][name]  # type: ignore[attr-defined]

    rewrite(saved_with_keys, forget, **{name: None if change is None else encoded(change(given))})
    told = message.format(**numbers)
    assert error_of(saved_with_keys) == f"{saved_with_keys}: map.json and arrays do not make a map: {told}"


def test_keys_of_a_camera_that_the_map_does_not_know(saved_with_keys: Path) -> None:
    rewrite(saved_with_keys, **{"paths/0/keys/up/counts": encoded(np.zeros(8, np.int32))})
    assert error_of(saved_with_keys) == (
        f"{saved_with_keys}: map.json and arrays do not make a map: array 'paths/0/keys/up/counts' is not known here"
    )
