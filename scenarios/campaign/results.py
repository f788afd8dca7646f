"""The folder that a campaign fills: verdicts for CI servers and programs, pages for people.

Every file is replaced in one step, after every case: whatever ends a campaign early leaves a folder that tells the
truth, with the cases that have no verdict marked as such.
"""

import fcntl
import os
import re
import tempfile
import time
from collections.abc import Iterable, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from platform import python_version

from refseq.drafts import draft_folder, locked
from refseq.files import followed, put, replace_text
from refseq_bench.scenarios.campaign.case_types import case_page, case_record
from refseq_bench.scenarios.campaign.declare.case import Case
from refseq_bench.scenarios.campaign.judge.drives import Judged
from refseq_bench.scenarios.campaign.judge.records import open_record
from refseq_bench.scenarios.campaign.pages.index import index_page
from refseq_bench.scenarios.campaign.pages.junit import JUNIT, write_junit
from refseq_bench.scenarios.campaign.pages.sweep_plot import SweepPlot, sweep_plot_of
from refseq_bench.scenarios.campaign.pages.verdicts import INDEX
from refseq_bench.scenarios.campaign.run.machine import this_machine
from refseq_bench.scenarios.campaign.store.cache import Store
from refseq_bench.scenarios.campaign.store.result_file import RESULT, CampaignRecord, by_scenario, write_result
from refseq_bench.scenarios.drives.inputs import writing
from refseq_bench.scenarios.errors import ScenarioError

PAGE = "report.html"
VERSIONS = ("refseq-bench", "mujoco", "numpy", "scipy", "opencv-python-headless", "faiss-cpu")
LONGEST = 80
"""Letters that a case's folder may have."""


class Results:
    """Files of a campaign in ``folder``. Raises ``ScenarioError`` at once where nothing can be written there."""

    def __init__(self, folder: Path, cases: Sequence[Case], store: Store) -> None:
        self.folder, self._store, self._begin = folder, store, time.monotonic()
        self._slugs = slugs(case.name for case in cases)
        self._sweep_plots: dict[str, SweepPlot | None] = {}
        self._record = CampaignRecord(
            started=datetime.now(UTC).isoformat(timespec="seconds"),
            seconds=0.0,
            complete=False,
            versions={"python": python_version(), **{name: version(name) for name in VERSIONS}},
            machine=this_machine(),
            cases=tuple(open_record(case) for case in cases),
        )
        new = not folder.exists()
        _check(folder)
        _claim(folder)
        try:
            self._write()
        except BaseException:
            _leave(folder)
            if new:
                with suppress(OSError):  # not empty, or another's by now
                    folder.rmdir()
            raise

    def add(self, result: Judged) -> None:
        """Write the page of a case that was judged, and the campaign's files anew."""
        page = Path(self._slugs[result.case.name]) / PAGE
        record = case_record(result, page.as_posix())
        path, text = self.folder / page, case_page(result, record, self._record, self._store)
        with writing(path):
            path.parent.mkdir(exist_ok=True)
            replace_text(path, text)
        cases = tuple(record if one.name == record.name else one for one in self._record.cases)
        complete = all(case.verdict is not None for case in cases)
        seconds = time.monotonic() - self._begin
        self._record = self._record.model_copy(update={"cases": cases, "complete": complete, "seconds": seconds})
        self._write()

    def close(self) -> None:
        """Let other runs have the folder, as it is."""
        _leave(self.folder)

    def _write(self) -> None:
        with writing(self.folder), draft_folder(self.folder) as drafts:
            write_result(drafts, self._record)
            write_junit(drafts, self._record)
            replace_text(drafts / INDEX, index_page(self._record, self._plots()))
            for name in (RESULT, JUNIT, INDEX):  # once all of them are on the disk, however full it is
                put(drafts / name, followed(self.folder / name))
        if self._record.complete:
            _leave(self.folder)

    def _plots(self) -> list[SweepPlot]:
        """The sweep plots of those scenarios of which all cases are judged; each is drawn once."""
        for scenario, cases in by_scenario(self._record.cases).items():
            if scenario not in self._sweep_plots and all(case.verdict is not None for case in cases):
                self._sweep_plots[scenario] = sweep_plot_of(cases)
        return [plot for plot in self._sweep_plots.values() if plot is not None]


def slugs(names: Iterable[str]) -> dict[str, str]:
    """A folder for each case: letters that every system and every CI server's archive takes, no two alike."""
    found: dict[str, str] = {}
    taken: set[str] = set()
    for name in names:
        plain = re.sub(r"[^A-Za-z0-9._+-]+", "-", name)[:LONGEST].strip(".-") or "case"
        slug, number = plain, 2
        while slug.lower() in taken:
            slug, number = f"{plain}-{number}", number + 1
        taken.add(slug.lower())
        found[name] = slug
    return found


def _check(folder: Path) -> None:
    """Write something, before the first drive is driven for nothing."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(b"?")
    except OSError as error:
        raise ScenarioError(
            f"{folder}: cannot hold the results: {error.strerror or error}; valid is a folder that can be written to"
        ) from error
    if (folder / INDEX).exists() and not (folder / RESULT).exists():
        raise ScenarioError(f"{folder}: holds an {INDEX} that no run has made; valid is a new folder, or that of a run")


_claimed: dict[Path, int] = {}
"""Locks of the folders that this process fills."""


def _claim(folder: Path) -> None:
    """Keep other processes' runs out of a folder until it is complete, or this process ends."""
    place = folder.resolve()
    if place in _claimed:
        return
    try:
        _claimed[place] = locked(place, wait=False)
    except BlockingIOError:
        raise ScenarioError(f"{folder}: another run is filling it; valid is a folder of its own") from None
    except OSError:  # a file system without locks
        return


def _leave(folder: Path) -> None:
    """Let other runs have a folder."""
    if (lock := _claimed.pop(folder.resolve(), None)) is not None:
        fcntl.flock(lock, fcntl.LOCK_UN)  # a forked child may hold it as well
        os.close(lock)
