"""A task on another machine: what is sent with it, how it is carried out there from copies, what comes back.

All that a task reads goes with it as bytes, real recordings included, and all that it makes comes back as bytes. The
other machine must have the same code and packages; nothing is left on it.
"""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from refseq_bench.scenarios.campaign.declare.outcomes import TaskOutcome, Verdict, one_line
from refseq_bench.scenarios.campaign.declare.real_recordings import DATA, names_in, place_below, real_paths
from refseq_bench.scenarios.campaign.declare.sources import Images, Log
from refseq_bench.scenarios.campaign.run import mission_task
from refseq_bench.scenarios.campaign.run.tasks import Question, RecordTask, Task, perform
from refseq_bench.scenarios.campaign.run.workers import Processes, broken
from refseq_bench.scenarios.campaign.store.cache import ENDS, MAP, RECORDING, Store
from refseq_bench.scenarios.campaign.store.views import drawing_device
from refseq_bench.scenarios.drives.drive import Drive
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.imports.closure import closure_of
from refseq_bench.scenarios.methods.baselines import BASELINES
from refseq_bench.scenarios.methods.names import modules_of
from refseq_bench.scenarios.methods.plugins import plugin_digest
from refseq_bench.sim.rendering.renderer import RendererKind

KEPT, REAL, FILE = "kept", "real", "file"
"""Where a file of the payload belongs: the store, the folder of real recordings, or anywhere by itself."""


@dataclass(frozen=True)
class PayloadFile:
    """Something that a task reads, and where it lies on this machine.

    ``name`` is that in the store, below the folder of real recordings, or the path that a drive names it by.
    """

    where: str
    name: str
    path: Path


@dataclass(frozen=True)
class NodeFingerprint:
    """Code, packages and drawing devices of a machine: where these are equal, it makes the same files."""

    sources: str
    packages: Mapping[str, str]
    devices: Mapping[RendererKind, str]

    def unlike(self, other: "NodeFingerprint") -> str:
        """The first difference of another machine, in words; nothing where it is alike."""
        for name, version in self.packages.items():
            if other.packages.get(name) != version:
                return f"{name} is {other.packages.get(name)} there and {version} here"
        if self.sources != other.sources:
            return f"the code differs (digest {other.sources[:8]} there, {self.sources[:8]} here)"
        return ""


@dataclass(frozen=True)
class RemoteTask:
    """A task for another machine, with the fingerprint of the sender and the digests of its users' localisers."""

    task: Task
    place: NodeFingerprint
    plugins: Mapping[str, str]
    pieces: tuple[PayloadFile, ...]


@dataclass(frozen=True)
class RemoteResult:
    """Outcome of a remote task, and the files that it added to the store, by name."""

    outcome: TaskOutcome
    files: Mapping[str, bytes]


@cache
def here() -> NodeFingerprint:
    """Fingerprint of this machine."""
    found = closure_of(__name__, mission_task.__name__, *modules_of(BASELINES))
    devices = {kind: ", ".join(map(str, drawing_device(kind) or ("none",))) for kind in RendererKind}
    return NodeFingerprint(found.digest, found.versions, devices)


def remote_task_for(task: Task, store: Store) -> RemoteTask:
    """Pack a task for another machine; what it needs is in the store."""
    files = tuple(PayloadFile(FILE, name, Path(name)) for name in _files_of(task.drive))
    if isinstance(task, RecordTask):
        return RemoteTask(task, here(), {}, files)
    return RemoteTask(task, here(), task.plugins, (*files, *_views_of(task, store), *_maps_of(task, store)))


def _files_of(drive: Drive | None) -> list[str]:
    """Files that a drive names."""
    named = () if drive is None else (drive.world, *drive.cameras.values())
    return [name for name in named if name.endswith(".toml")]


def _views_of(task: Question, store: Store) -> list[PayloadFile]:
    pieces: dict[str, PayloadFile] = {}
    for source, key in zip(task.read, task.sources, strict=False):
        if isinstance(source, Drive):
            path = store.path(key, RECORDING)
            found = [PayloadFile(KEPT, path.name, path)]
        else:
            found = _real_files(source)
        pieces |= {piece.name: piece for piece in found}
    return list(pieces.values())


def _real_files(source: Log | Images) -> list[PayloadFile]:
    named = zip(map(place_below, names_in(source)), real_paths(source), strict=True)
    return [piece for place, path in named for piece in _pieces(place, path)]


def _pieces(place: Path, path: Path) -> list[PayloadFile]:
    """A file, or all files of a folder, as a recording may be one."""
    if not path.is_dir():
        return [PayloadFile(REAL, place.as_posix(), path)]
    files = sorted(file for file in path.rglob("*") if file.is_file())
    return [PayloadFile(REAL, (place / file.relative_to(path)).as_posix(), file) for file in files]


def _maps_of(task: Question, store: Store) -> list[PayloadFile]:
    """Maps that earlier tasks have learnt of the same reference."""
    paths = (store.path(key, MAP) for key in task.maps if store.has(key, MAP))
    return [PayloadFile(KEPT, path.name, path) for path in paths]


# --- on the other machine ---


def carry_out(order: RemoteTask, *contents: bytes) -> RemoteResult:
    """Carry an order out on this machine; ``contents`` are those of its pieces."""
    if unlike := _unlike(order):
        node = os.uname().nodename
        reason = f"{order.task.title}: not on node {node}: {unlike}; valid is the same checkout and lock on all nodes"
        return RemoteResult(TaskOutcome(Verdict.ERROR, reason), {})
    try:
        with TemporaryDirectory(prefix="refseq-") as folder:
            return _carried_out(order, contents, Path(folder))
    except OSError as error:
        return RemoteResult(TaskOutcome(Verdict.ERROR, f"{order.task.title}: {one_line(error)}"), {})


def _unlike(order: RemoteTask) -> str:
    place = here()
    if unlike := order.place.unlike(place):
        return unlike
    drive = order.task.drive
    if drive is not None:
        there, sender = place.devices[drive.renderer], order.place.devices[drive.renderer]
        if there != sender:
            return f"the device of {drive.renderer} is {there} there and {sender} here"
    for name, digest in order.plugins.items():
        try:
            same = plugin_digest(name) == digest
        except ScenarioError as error:
            return str(error)
        if not same:
            return f"the code of {name} differs"
    return ""


def _carried_out(order: RemoteTask, contents: Sequence[bytes], folder: Path) -> RemoteResult:
    kept, real, files = (folder / name for name in (KEPT, REAL, FILE))
    moved: dict[str, str] = {}
    for number, (piece, content) in enumerate(zip(order.pieces, contents, strict=True)):
        path = {KEPT: kept, REAL: real, FILE: files / str(number)}[piece.where]
        path /= Path(piece.name).name if piece.where == FILE else piece.name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
        moved[piece.name] = str(path)
    task, store = _with_files(order.task, moved), Store(kept)
    outcome = _process().call(lambda error: broken(task, error), task.limit, _perform, task, kept, real).result()
    made = {path.name: path for path in kept.iterdir() if path.suffix in ENDS and path.name not in moved}
    if outcome.good:
        # Where a drive's files lie elsewhere it may go by another key here.
        name = store.path(order.task.key, order.task.ending).name
        made[name] = made.pop(store.path(task.key, task.ending).name)
    return RemoteResult(outcome, {name: path.read_bytes() for name, path in made.items()})


def _with_files(task: Task, moved: Mapping[str, str]) -> Task:
    """The task with the files that it names itself where they lie on this machine."""
    return task.with_files(moved) if _files_of(task.drive) else task


def _perform(task: Task, folder: Path, real: Path) -> TaskOutcome:
    os.environ[DATA] = str(real)
    return perform(task, Store(folder))


@cache
def _process() -> Processes:
    """A process below this one, which may hang or break; it is kept, for it takes long to begin."""
    return Processes(1, sharing=os.cpu_count())
