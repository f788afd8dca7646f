import os
import subprocess
import threading
import time
from pathlib import Path

import pytest

from refseq.drafts import DRAFT
from refseq_bench.scenarios.campaign.store.cache import ANSWERS, MAP, RECORDING, Store
from refseq_bench.scenarios.errors import ScenarioError
from tests.scenarios.campaign.chores import WHOLE
from tests.support import corridor_drive

needs_root = pytest.mark.skipif(os.geteuid() != 0, reason="only root may mount a small disk")


@pytest.fixture
def store(tmp_path: Path) -> Store:
    return Store(tmp_path / "deep" / "store")


def drafts(store: Store) -> list[Path]:
    return list(store.folder.glob(f"{DRAFT}*"))


def test_a_file_is_made_once_and_found_by_its_key(store: Store) -> None:
    made = []
    for _ in range(2):
        store.make("a", ANSWERS, lambda path: (made.append(1), path.write_bytes(WHOLE)))
    assert store.has("a", ANSWERS)
    assert not store.has("b", ANSWERS)
    assert not store.has("a", RECORDING)
    assert made == [1]
    assert store.size == len(WHOLE)


@pytest.mark.parametrize("ending", [RECORDING, MAP, ANSWERS])
def test_real_files_are_whole_at_their_full_length_only(store: Store, ending: str) -> None:
    path = store.make("key", ending, lambda path: real_file(path, ending))
    content = path.read_bytes()
    assert store.has("key", ending)
    for length in (0, 3, len(content) // 2, len(content) - 1):
        path.write_bytes(content[:length])
        assert not store.has("key", ending), length
    path.write_bytes(bytes(len(content)))
    assert not store.has("key", ending)


def real_file(path: Path, ending: str) -> None:
    import numpy as np

    from refseq.logs import RecordingWriter
    from refseq.logs.beliefs import write_beliefs
    from refseq.map.learning import learn
    from refseq.view import View
    from tests.support import certain

    views = [View(v.time, {}, v.scan, v.distance, 0.0, v.truth) for v in corridor_drive(np.random.default_rng(1), 5)]
    if ending == RECORDING:
        with RecordingWriter(path, {}) as writer:
            for view in views:
                assert view.truth
                writer.write(view, view.truth)
    elif ending == MAP:
        learn(views).save(path)
    else:
        write_beliefs(path, views, {"any": [certain(5, k) for k in range(5)]})


def test_a_file_that_was_cut_off_is_made_anew(store: Store) -> None:
    path = store.make("a", ANSWERS, lambda path: path.write_bytes(WHOLE))
    path.write_bytes(WHOLE[:-1])
    store.make("a", ANSWERS, lambda path: path.write_bytes(WHOLE))
    assert path.read_bytes() == WHOLE


def test_what_fails_in_the_middle_leaves_nothing(store: Store) -> None:
    def half(path: Path) -> None:
        path.write_bytes(WHOLE[:9])
        path.with_name("beside.partial").write_bytes(b"too")
        raise KeyError("half")

    with pytest.raises(KeyError):
        store.make("a", ANSWERS, half)
    assert list(store.folder.iterdir()) == []


def test_a_writer_that_only_seems_to_have_written_is_not_believed(store: Store) -> None:
    with pytest.raises(ScenarioError, match=r"a\.parquet: cannot be kept: it was not written whole$"):
        store.make("a", ANSWERS, lambda path: path.write_bytes(WHOLE[:-4]))
    assert not store.path("a", ANSWERS).exists()


def test_drafts_of_the_dead_are_swept_and_those_of_the_living_are_not(store: Store) -> None:
    (store.folder / f"{DRAFT}dead").mkdir()
    (store.folder / f"{DRAFT}dead" / "half").write_bytes(b"half")
    begun, finish = threading.Event(), threading.Event()

    def slow(path: Path) -> None:
        begun.set()
        finish.wait(10)
        path.write_bytes(WHOLE)

    maker = threading.Thread(target=store.make, args=("a", ANSWERS, slow))
    maker.start()
    begun.wait(10)
    Store(store.folder).sweep()
    assert [path.name for path in drafts(store)] != [f"{DRAFT}dead"]
    assert len(drafts(store)) == 1
    finish.set()
    maker.join()
    assert store.has("a", ANSWERS)
    assert not drafts(store)


def test_two_makers_of_one_file_do_not_disturb_each_other(store: Store) -> None:
    def slowly(path: Path) -> None:
        path.write_bytes(WHOLE[:5])
        time.sleep(0.05)
        path.write_bytes(WHOLE)

    makers = [threading.Thread(target=Store(store.folder).make, args=("a", ANSWERS, slowly)) for _ in range(8)]
    for maker in makers:
        maker.start()
    while any(maker.is_alive() for maker in makers):
        assert not store.path("a", ANSWERS).exists() or store.path("a", ANSWERS).read_bytes() == WHOLE
    assert store.has("a", ANSWERS)
    assert not drafts(store)


@needs_root
def test_a_full_disk_is_told_and_nothing_stays_on_it(tmp_path: Path) -> None:
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", tmp_path], check=True)
    try:
        store = Store(tmp_path)
        store.make("small", ANSWERS, lambda path: path.write_bytes(WHOLE))
        with pytest.raises(ScenarioError, match=r"large\.parquet: cannot be kept: No space left on device$"):
            store.make("large", ANSWERS, lambda path: path.write_bytes(WHOLE + bytes(100_000)))
        assert {path.name for path in tmp_path.iterdir()} == {"small.parquet"}
    finally:
        subprocess.run(["umount", tmp_path], check=True)


def test_a_store_that_cannot_be_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder")
    with pytest.raises(ScenarioError, match=r"file/store: cannot hold what is kept: Not a directory; valid is "):
        Store(tmp_path / "file" / "store")


def test_a_store_that_cannot_be_written_to_is_told_before_the_work_and_can_be_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Store(tmp_path).make("a", ANSWERS, lambda path: path.write_bytes(WHOLE))
    monkeypatch.setattr(os, "access", lambda path, mode: (path, mode) != (tmp_path, os.W_OK | os.X_OK))  # as root too
    with pytest.raises(ScenarioError) as caught:
        Store(tmp_path)
    valid = "valid is a folder that can be written to, by --cache or REFSEQ_CACHE"
    assert str(caught.value) == f"{tmp_path}: cannot hold what is kept: no write access; {valid}"
    assert Store(tmp_path, read_only=True).has("a", ANSWERS)
