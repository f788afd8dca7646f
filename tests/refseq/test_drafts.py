import os
import signal
from pathlib import Path

import pytest

from refseq.drafts import DRAFT, draft_folder, sweep_drafts
from refseq.files import replace_text


def test_nobody_else_may_write_into_a_draft_and_it_is_gone_afterwards(tmp_path: Path) -> None:
    with draft_folder(tmp_path) as folder:
        assert folder.parent == tmp_path
        assert folder.stat().st_mode & 0o777 == 0o700
        (folder / "half").write_text("half")
    assert list(tmp_path.iterdir()) == []


def test_a_killed_makers_draft_is_swept_by_the_next_and_a_living_ones_is_not(tmp_path: Path) -> None:
    child = os.fork()
    if not child:
        with draft_folder(tmp_path) as folder:
            (folder / "half").write_text("half")
            os.kill(os.getpid(), signal.SIGKILL)
    os.waitpid(child, 0)
    assert len(list(tmp_path.glob(f"{DRAFT}*/half"))) == 1
    with draft_folder(tmp_path) as living:
        replace_text(tmp_path / "new", "new")
        assert living.is_dir()
        assert {path.name for path in tmp_path.iterdir()} == {living.name, "new"}


def test_a_link_that_looks_like_a_draft_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "dear").write_text("dear")
    link = tmp_path / f"{DRAFT}planted"
    link.symlink_to("mine")
    sweep_drafts(tmp_path)
    assert link.is_symlink()
    assert (tmp_path / "mine" / "dear").read_text() == "dear"


def test_a_draft_that_was_swept_before_it_was_locked_is_made_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import tempfile

    make, made = tempfile.mkdtemp, []

    def swept_once(**given: object) -> str:
        made.append(make(**given))  # type: ignore[call-overload]
        if len(made) == 1:
            Path(made[0]).rmdir()
        return str(made[-1])

    monkeypatch.setattr(tempfile, "mkdtemp", swept_once)
    with draft_folder(tmp_path) as folder:
        assert folder == Path(made[1])
        assert folder.is_dir()
