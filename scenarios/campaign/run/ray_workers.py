"""Workers of an existing Ray cluster: the same tasks, sent with all that they read; what they make comes back whole.

Each task runs in a process below Ray's own worker (``refseq_bench.scenarios.campaign.run.remote_payload``), so that a
time limit and a crash mean the same as on this machine. What a lost node was doing is done again by another.
"""

import contextlib
import logging
import os
import socket
import threading
from collections import OrderedDict
from concurrent.futures import Future
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

from refseq.viewer.http2 import speaks_http2
from refseq_bench.scenarios.campaign.declare.outcomes import TaskOutcome, Verdict, one_line
from refseq_bench.scenarios.campaign.run.remote_payload import (
    NodeFingerprint,
    PayloadFile,
    RemoteResult,
    carry_out,
    here,
    remote_task_for,
)
from refseq_bench.scenarios.campaign.run.tasks import Task
from refseq_bench.scenarios.campaign.store.cache import Store
from refseq_bench.scenarios.errors import ScenarioError

PATIENCE = 5.0
"""Time in which an address has to answer [s]."""
GREETING = 120.0
"""Time in which the nodes have to say what they have [s]: each imports all that simulates."""
RETRIES = 5
"""Number of times that a task is begun again when its node is lost."""
HELD = 16
"""Recordings that are held ready in the cluster's memory; more are read again."""
LOOK = 5.0
"""Period in which the cluster is asked for its number of cores [s]."""
AUTO = "auto"
QUIET = {
    "RAY_USAGE_STATS_ENABLED": "0",  # no telemetry
    "RAY_DEDUP_LOGS": "0",
    "RAY_ENABLE_AUTO_CONNECT": "0",  # else whoever asks after the end would begin a cluster on this machine
    "RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO": "0",
}


class RayWorkers:
    """Cores of the Ray cluster at an ``address``: HOST:PORT of its head, or auto for the one on this machine.

    Raises ``ScenarioError`` where Ray is not installed, nothing answers there, or a node has other code.
    """

    def __init__(self, address: str, store: Store) -> None:
        self._store, self._lock = store, threading.Lock()
        self._ray = _connected(address)
        self._held: OrderedDict[tuple[Path, int], Any] = OrderedDict()
        self._closed = threading.Event()
        self._flying: dict[Any, tuple[Task, Future[TaskOutcome]]] = {}
        try:
            _check_nodes(self._ray)
        except BaseException:
            self._ray.shutdown()
            raise
        self._carry_out = self._ray.remote(num_cpus=1, max_retries=RETRIES)(carry_out)
        self._cores = int(self._ray.cluster_resources().get("CPU", 0))
        self._threads = [threading.Thread(target=work, daemon=True) for work in (self._collect, self._count)]
        for thread in self._threads:
            thread.start()

    @property
    def workers(self) -> int:
        """Cores of all nodes that live."""
        return self._cores

    def submit(self, task: Task) -> "Future[TaskOutcome]":
        """Have a task carried out by a node; what it makes is put into the store."""
        answer: Future[TaskOutcome] = Future()
        try:
            order = remote_task_for(task, self._store)
            contents = [self._put(piece) for piece in order.pieces]
            with self._lock:
                self._flying[self._carry_out.remote(order, *contents)] = task, answer
        except Exception as error:
            answer.set_result(TaskOutcome(Verdict.ERROR, f"{task.title}: {one_line(error)}"))
        return answer

    def _put(self, piece: PayloadFile) -> Any:
        """A file's content in the cluster's memory; the last few stay there, as many tasks read the same drive."""
        state = piece.path, piece.path.stat().st_mtime_ns  # one that was damaged is made anew under the same name
        if state not in self._held:
            self._held[state] = self._ray.put(piece.path.read_bytes())
        self._held.move_to_end(state)
        while len(self._held) > HELD:
            self._held.popitem(last=False)
        return self._held[state]

    def _collect(self) -> None:
        """Take in what comes back, as long as there are workers."""
        while not self._closed.is_set():
            with self._lock:
                flying = list(self._flying)
            if not flying:
                self._closed.wait(0.05)
                continue
            try:
                done, _ = self._ray.wait(flying, timeout=0.2)
            except Exception:  # the cluster is gone: whoever asks for what is on its way is told so
                done = flying
            for one in done:
                with self._lock:
                    task, answer = self._flying.pop(one)
                answer.set_result(self._taken_in(task, one))

    def _taken_in(self, task: Task, flown: Any) -> TaskOutcome:
        try:
            delivery: RemoteResult = self._ray.get(flown)
            for name, content in delivery.files.items():
                file = Path(name)
                self._store.make(file.stem, file.suffix, partial(Path.write_bytes, data=content))
        except self._ray.exceptions.RayError as error:
            return TaskOutcome(Verdict.ERROR, f"{task.title}: Ray: {_first_line(error)}")
        except Exception as error:
            return TaskOutcome(Verdict.ERROR, f"{task.title}: {one_line(error)}")
        return delivery.outcome

    def _count(self) -> None:
        """Follow nodes that come and go."""
        while not self._closed.wait(LOOK):
            with contextlib.suppress(Exception):  # the head may be gone for a while
                self._cores = int(self._ray.cluster_resources().get("CPU", 0))

    def close(self, *, at_once: bool) -> None:
        """Leave the cluster; what still runs there for us is ended."""
        self._closed.set()
        for thread in self._threads:
            thread.join(PATIENCE)
        for one in self._flying if at_once else ():
            with contextlib.suppress(Exception):
                self._ray.cancel(one, force=True)
        self._ray.shutdown()


def _place() -> NodeFingerprint:
    """Ray takes functions only, and ``here`` is an object that remembers what it has answered."""
    return here()


def _connected(address: str) -> ModuleType:
    """Ray, connected to a cluster."""
    os.environ.update(QUIET)
    try:
        import ray
    except ImportError:
        raise ScenarioError(
            "--ray: Ray is not installed; valid is the extra of that name: pip install '.[ray]' in a clone"
        ) from None
    _check_answers(address)
    try:
        ray.init(address=address, log_to_driver=False, logging_level=logging.ERROR)
    except (RuntimeError, ValueError, OSError, SystemExit) as error:
        raise ScenarioError(f"--ray {address!r}: no cluster answers there: {_first_line(error)}") from error
    module: ModuleType = ray
    return module


def _check_answers(address: str) -> None:
    """Raise ``ScenarioError`` where no Ray listens: it would itself try for two minutes, and then end the process."""
    if address == AUTO:
        return
    host, colon, port = address.rpartition(":")
    if not (host and colon and port.isascii() and port.isdigit() and 0 < int(port) < 65536) or "/" in host:
        raise ScenarioError(f"--ray {address!r} is not valid; it should be HOST:PORT, or {AUTO}")
    try:
        with socket.create_connection((host.strip("[]"), int(port)), timeout=PATIENCE) as line:
            speaks = speaks_http2(line)
    except OSError as error:
        why = error.strerror or str(error)
        raise ScenarioError(f"--ray {address!r}: no cluster answers there: {why}; valid is a running one") from error
    if not speaks:
        raise ScenarioError(f"--ray {address!r}: what answers there is no Ray; valid is the port of its head, 6379")


def _check_nodes(ray: ModuleType) -> None:
    """Raise ``ScenarioError`` where a node has not what this machine has: it would make something else."""
    from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

    ask = ray.remote(num_cpus=0, max_retries=1)(_place)
    asked = [
        (
            node["NodeManagerHostname"],
            ask.options(scheduling_strategy=NodeAffinitySchedulingStrategy(node["NodeID"], soft=False)).remote(),
        )
        for node in ray.nodes()
        if node["Alive"] and node["Resources"].get("CPU")
    ]
    for name, answer in asked:
        try:
            unlike = here().unlike(ray.get(answer, timeout=GREETING))
        except ray.exceptions.RayError as error:
            unlike = _first_line(error)
        if unlike:
            raise ScenarioError(f"--ray: node {name}: {unlike}; valid is the same checkout and lock on all nodes")


def _first_line(error: BaseException) -> str:
    """Ray's errors hold whole traces, with the cause in the last line."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[-1] if lines else type(error).__name__
