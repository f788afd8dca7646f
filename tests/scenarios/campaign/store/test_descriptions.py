"""Descriptions kept on disk: the same as found, by whoever asks for them, within a bound, and never in the way."""

import ast
import sqlite3
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from refseq.features import SiftWords
from refseq.features.memory import described_once
from refseq.features.sift import NO_KEYS, SiftSettings
from refseq.features.word_extractor import packed
from refseq.view import View
from refseq_bench.scenarios.campaign.store import descriptions
from refseq_bench.scenarios.campaign.store.cache import DESCRIPTIONS
from refseq_bench.scenarios.campaign.store.descriptions import DESCRIBING, KeptDescriptions
from refseq_bench.scenarios.imports.closure import closure_of

ROOT = Path(__file__).resolve().parents[4]


@pytest.fixture(autouse=True)
def all_is_worth_keeping(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(descriptions, "WORTH", 0.0)


def kept_in(folder: Path, most: int = descriptions.MOST) -> KeptDescriptions:
    memory = KeptDescriptions(most)
    memory.keep_in(folder)
    return memory


def never() -> NDArray[Any]:
    raise AssertionError("it was found anew")


def some(seed: int, size: int = 100) -> Callable[[], NDArray[np.uint8]]:
    return lambda: np.random.default_rng(seed).integers(0, 256, size, np.uint8)


@pytest.mark.parametrize("kind", [np.uint8, np.int64, np.float32, packed(NO_KEYS).dtype])
def test_who_opens_the_file_later_has_them_at_hand(kind: np.dtype[Any], tmp_path: Path) -> None:
    made = np.frombuffer(np.random.default_rng(0).bytes(7 * np.dtype(kind).itemsize), kind)
    first, second = kept_in(tmp_path), kept_in(tmp_path)
    first.describe(("settings", 1), made.copy)
    for later in (second, kept_in(tmp_path)):
        found = later.describe(("settings", 1), never)
        assert (found.dtype, found.tobytes()) == (made.dtype, made.tobytes())
        with pytest.raises(ValueError, match="read-only"):
            found[0] = found[1]


def test_what_is_in_memory_stays_where_the_folder_changes(tmp_path: Path) -> None:
    memory = KeptDescriptions()
    memory.describe("before", some(0))
    for name in ("one", "other", "one"):
        (tmp_path / name).mkdir(exist_ok=True)
        memory.keep_in(tmp_path / name)
        memory.describe(name, some(1))
        memory.describe("before", never)
    assert all(kept_in(tmp_path / name).describe(name, never).size for name in ("one", "other"))
    assert np.array_equal(kept_in(tmp_path / "one").describe("other", some(2)), some(2)())


def test_a_picture_s_words_are_those_that_were_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    image = np.kron(np.random.default_rng(0).integers(0, 256, (12, 16), np.uint8), np.ones((10, 10), np.uint8))
    view, alone = View(0.0, {"a": image}), SiftWords("a", SiftSettings())
    expected = alone.describe(view)
    assert len(expected)
    for _ in range(2):
        with described_once(kept_in(tmp_path)):
            np.testing.assert_array_equal(SiftWords("a", SiftSettings()).describe(view), expected)
            np.testing.assert_array_equal(SiftWords("a", SiftSettings()).shown(view).points, alone.shown(view).points)
        monkeypatch.setattr(SiftWords, "find_keys", lambda *_: never())  # points and descriptors are kept together


def test_other_settings_pictures_and_code_are_described_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    memory = kept_in(tmp_path)
    memory.describe((SiftSettings(), (9, 9), b"picture"), some(0))
    for key in ((SiftSettings(cap=3), (9, 9), b"picture"), (SiftSettings(), (9, 9), b"other")):
        assert np.array_equal(kept_in(tmp_path).describe(key, some(1)), some(1)())
    monkeypatch.setattr(descriptions, "code_digest", lambda *_: "other code")
    assert np.array_equal(kept_in(tmp_path).describe((SiftSettings(), (9, 9), b"picture"), some(2)), some(2)())


def test_a_look_up_takes_what_finding_took(tmp_path: Path) -> None:
    kept_in(tmp_path).describe("key", some(0))
    with sqlite3.connect(tmp_path / DESCRIPTIONS) as file:
        file.execute("UPDATE descriptions SET seconds = 30.0")
    later = kept_in(tmp_path)
    later.describe("key", never)
    assert 29 < later.spared < 30
    later.describe("key", never)
    assert 59 < later.spared < 60


def test_what_is_found_at_once_is_not_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(descriptions, "WORTH", 60.0)
    kept_in(tmp_path).describe("key", some(0))
    assert np.array_equal(kept_in(tmp_path).describe("key", some(1)), some(1)())


def test_the_oldest_make_room(tmp_path: Path) -> None:
    most, size = 100_000, 2000
    workers = [kept_in(tmp_path, most) for _ in range(3)]
    for seed in range(200):
        workers[seed % 3].describe(seed, some(seed, size))
        with sqlite3.connect(tmp_path / DESCRIPTIONS) as file:
            (held,) = file.execute("SELECT total(length(described)) FROM descriptions").fetchone()
        assert held <= most
    last = kept_in(tmp_path, most)
    for seed in range(200 - int(0.7 * most / (size + 128)), 200):
        last.describe(seed, never)
    assert np.array_equal(last.describe(0, some(1)), some(1)()), "the first is gone"


def test_a_file_that_is_none_is_made_anew(tmp_path: Path) -> None:
    (tmp_path / DESCRIPTIONS).write_bytes(b"no such file" * 1000)
    for find in (some(0), never):
        assert np.array_equal(kept_in(tmp_path).describe("key", find), some(0)())


@pytest.mark.parametrize("content", [b"", b"none", np.lib.format.magic(1, 0), "text", None])
def test_a_description_that_is_none_is_found_anew(content: object, tmp_path: Path) -> None:
    kept_in(tmp_path).describe("key", some(0))
    with sqlite3.connect(tmp_path / DESCRIPTIONS) as file:
        file.execute("UPDATE descriptions SET described = ?", (content,))
    for find in (some(1), never):
        assert np.array_equal(kept_in(tmp_path).describe("key", find), some(1)())


def test_objects_are_not_unpickled(tmp_path: Path) -> None:
    kept_in(tmp_path).describe("key", some(0))
    np.save(tmp_path / "objects.npy", np.array([print], object), allow_pickle=True)
    with sqlite3.connect(tmp_path / DESCRIPTIONS) as file:
        file.execute("UPDATE descriptions SET described = ?", ((tmp_path / "objects.npy").read_bytes(),))
    assert np.array_equal(kept_in(tmp_path).describe("key", some(1)), some(1)())


def test_without_a_file_it_is_a_memory_like_any_other(tmp_path: Path) -> None:
    (tmp_path / DESCRIPTIONS).mkdir()
    memory = kept_in(tmp_path)
    for find in (some(0), never):
        assert np.array_equal(memory.describe("key", find), some(0)())
    broken = kept_in(tmp_path / "fine")
    assert np.array_equal(broken.describe("key", some(0)), some(0)())


def test_a_file_that_breaks_on_the_way_is_left(tmp_path: Path) -> None:
    memory = kept_in(tmp_path)
    memory.describe("key", some(0))
    with sqlite3.connect(tmp_path / DESCRIPTIONS) as file:
        file.execute("DROP TABLE descriptions")
    for seed in (1, 2):
        assert np.array_equal(memory.describe(seed, some(seed)), some(seed)())


def test_all_that_describes_is_among_what_the_keys_follow() -> None:
    followed = {str(file) for file in closure_of(*DESCRIBING).files} | {
        # Scans, of which no description takes long.
        "refseq/features/scan_bits.py"
    }
    describing = {
        file.relative_to(ROOT).as_posix().replace("scenarios/", "refseq_bench/scenarios/", 1)
        for folder in ("refseq", "scenarios")
        for file in ROOT.joinpath(folder).rglob("*.py")
        for node in ast.walk(ast.parse(file.read_text()))
        if isinstance(node, ast.ImportFrom) and node.module == "refseq.features.memory"
        if "described" in {one.name for one in node.names}
    }
    assert describing
    assert describing <= followed
