"""Fingerprints of all that a campaign made: drives, maps, beliefs and verdict, without times of the clock.

``python -m tests.robustness.fingerprints`` reads which scenarios to run, and prints the fingerprints of each.
"""

import hashlib
import json
import os
import sys
import zipfile
from collections.abc import Mapping
from concurrent.futures import Future
from pathlib import Path

import numpy as np

from refseq.logs import read_recording
from refseq.view import View
from refseq_bench.scenarios.campaign.campaign import Watcher, run_campaign
from refseq_bench.scenarios.campaign.declare.cases import find
from refseq_bench.scenarios.campaign.declare.outcomes import TaskOutcome
from refseq_bench.scenarios.campaign.results import Results
from refseq_bench.scenarios.campaign.run import answering, learning
from refseq_bench.scenarios.campaign.run.learning import LEARNING
from refseq_bench.scenarios.campaign.run.tasks import HANDS, Task, perform
from refseq_bench.scenarios.campaign.store.cache import Store
from refseq_bench.scenarios.campaign.store.keys import code_digest
from refseq_bench.scenarios.campaign.store.result_file import read_result
from refseq_bench.scenarios.drives.record import record

CACHE, RESULTS = "cache", "results"
"""Folders of a campaign's folder."""
CLOCK = ("_ms", "_s")
"""Endings of figures that are times of the processor."""


class Here:
    """A pool of workers that is this process: each task is done when it is handed out."""

    workers = 1

    def __init__(self, store: Store) -> None:
        self._store = store

    def submit(self, task: Task) -> "Future[TaskOutcome]":
        """Carry a task out."""
        done: Future[TaskOutcome] = Future()
        done.set_result(perform(task, self._store))
        return done

    def close(self, *, at_once: bool) -> None:
        """Nothing is held."""


def run_here(scenario: Path, folder: Path) -> dict[str, str]:
    """Run a scenario from an empty store in this process; its fingerprints."""
    store = Store(folder / CACHE)
    (folder / RESULTS).mkdir()
    cases = find([str(scenario)])
    results = Results(folder / RESULTS, cases, store)
    for _ in run_campaign(cases, Here(store), store, Watcher(), conclude=results.add):
        pass
    return fingerprints(folder)


def fingerprints(folder: Path) -> dict[str, str]:
    """Digests of a campaign's drives, maps and verdicts by what they are of; beliefs are in those of the verdicts."""
    found = {f"drive {path.stem}": _drive(path) for path in (folder / CACHE).glob("*.mcap")}
    found |= {f"map {path.stem}": _map(path) for path in (folder / CACHE).glob("*.refseq")}
    for case in read_result(folder / RESULTS).cases:
        methods = {one.method: {**_steady(one.figures), "beliefs": dict(one.digests)} for one in case.methods}
        told = (case.verdict_word, case.reasons, [one.model_dump() for one in case.judgements], methods)
        found[f"verdict of {case.name}"] = _digest(json.dumps([*told, case.views]).encode())
    return dict(sorted(found.items()))


def _steady(figures: Mapping[str, object]) -> dict[str, object]:
    return {name: figure for name, figure in figures.items() if not name.endswith(CLOCK)}


def _drive(path: Path) -> str:
    recording = read_recording(path)
    assert recording.complete, f"{path} is not whole"
    return _digest(*(part for view in recording.views for part in _parts(view)))


def _parts(view: View) -> list[bytes]:
    truth = view.truth
    numbers = [view.time, view.distance, view.turn, *((truth.x, truth.y, truth.heading) if truth else ())]
    scan = b"" if view.scan is None else np.asarray(view.scan.ranges).tobytes()
    return [np.array(numbers).tobytes(), scan, *(view.images[name].tobytes() for name in sorted(view.images))]


def _map(path: Path) -> str:
    """Digest of a map's header, which has the checksums of its arrays; how long learning took is noted in it."""
    with zipfile.ZipFile(path) as archive:
        timeless = json.loads(archive.read("map.json"), object_hook=lambda table: {**table, LEARNING: None})
    return _digest(json.dumps(timeless).encode())


def _digest(*parts: bytes) -> str:
    found = hashlib.sha256()
    for part in parts:
        found.update(len(part).to_bytes(8, "little") + part)
    return found.hexdigest()[:24]


def main() -> None:
    """Import everything, then run the scenarios of the input, a line ``SCENARIO<tab>FOLDER`` each, in a fork each."""
    for module, alone in ((record.__module__, ()), (learning.__name__, HANDS), (answering.__name__, HANDS)):
        code_digest(module, alone=alone)
    for line in sys.stdin:
        if not os.fork():
            scenario, folder = map(Path, line.rstrip("\n").split("\t"))
            print(json.dumps(run_here(scenario, folder)), flush=True)
            os._exit(0)
        if os.wait()[1]:
            print("{}", flush=True)


if __name__ == "__main__":
    main()
