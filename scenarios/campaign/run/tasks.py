"""The tasks of a campaign: recording a drive, and asking methods about it. Each leaves a file in the store.

Missions, which ask methods while the robot goes by their answers, are in ``scenarios.campaign.run.mission_task``.

A task is a value, so that it can be sent to another process or machine; what it needs and what it makes are named by
keys. Who carries it out is no concern of its own.
"""

import json
import math
import time
import traceback
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from refseq.belief import Belief
from refseq.errors import LogError, RefseqError
from refseq.logs import Recording
from refseq.logs.beliefs import read_beliefs, write_beliefs
from refseq.map.file import load_map, save_map
from refseq.map.profile import PROFILES
from refseq.map.sequence import ReferenceSequence
from robots.errors import RobotsError
from scenarios.campaign.declare.outcomes import Outcome, Verdict, one_line
from scenarios.campaign.declare.sources import AbsentError, Source, names_of, only, read_views, source_key
from scenarios.campaign.store.cache import ANSWERS, MAP, RECORDING, DamagedError, Store
from scenarios.campaign.store.keys import key_of, packages, recording_key, sources_digest
from scenarios.drives.inputs import stretch
from scenarios.drives.record import Drive, record
from scenarios.errors import ScenarioError
from scenarios.methods.baselines import BASELINES, Reference, Shelf
from scenarios.methods.by_name import Learnt
from scenarios.methods.plugins import MisbehavedError, is_plugin, plugin_digest
from scenarios.scoring.cost import Cost, bytes_kept, forget_peak, peak_bytes
from scenarios.scoring.merging import Merging
from sim.errors import SimError, StuckError
from worlds.errors import WorldsError

LEARNING = "learning_s"
"""In a kept map's metadata: how long learning it took [s]."""
MAP_SOURCES = ("refseq",)
ANSWER_SOURCES = (
    "refseq",
    "scenarios.methods.by_name",
    "scenarios.scoring.merging",
    "scenarios.campaign.declare.sources",
)
BASELINE_SOURCES = ("scenarios.methods.baselines",)
ANSWER_PACKAGES = ("numpy", "scipy", "opencv-python-headless", "faiss-cpu")


@dataclass(frozen=True)
class RecordTask:
    """Simulate a drive and keep its recording. ``limit`` is how long that may take on the wall clock [s]."""

    drive: Drive
    limit: float
    ending: str = RECORDING

    @cached_property
    def key(self) -> str:
        """Key of the recording."""
        return recording_key(self.drive)

    @property
    def needs(self) -> tuple["RecordTask", ...]:
        """Nothing."""
        return ()

    @property
    def kind(self) -> str:
        """What takes about as long as this."""
        return f"drive, {self.drive.renderer.value}"

    @property
    def title(self) -> str:
        """What is done, in words."""
        drive = self.drive
        change = "" if drive.change == "none" else f" {drive.change}"
        return f"drive {Path(drive.world).stem} {drive.light}{change} by {drive.robot}, seed {drive.seed}"

    def with_files(self, moved: Mapping[str, str]) -> "RecordTask":
        """The task with the files that its drive names where they lie on another machine."""
        return replace(self, drive=drive_with_files(self.drive, moved))

    def carry_out(self, store: Store) -> None:
        """Simulate."""
        store.make(self.key, self.ending, lambda path: record(self.drive, path))


@dataclass(frozen=True)
class Question(ABC):
    """Something is asked of ``methods``, which learn the reference drive; ``query`` says where and when.

    Only ``places`` FROM:TO of the reference are learnt, only ``sensors`` are looked at (None: all). ``seed`` is that of
    the methods' own draws. Where there are ``further`` references, all are learnt, as an atlas by our own localiser,
    with ``merge`` after what they share was taken out.
    """

    methods: tuple[str, ...]
    reference: Source
    query: Source
    places: str | None
    sensors: tuple[str, ...] | None
    seed: int
    limit: float
    further: tuple[Source, ...] = ()
    merge: bool = True
    ending: str = ANSWERS

    @property
    def references(self) -> tuple[Source, ...]:
        """All that is learnt."""
        return (self.reference, *self.further)

    @cached_property
    def sources(self) -> tuple[str, ...]:
        """Keys of the views of the references, and last of the query.

        They are reckoned where the campaign is run and go with the task: on another machine, where it answers from
        copies, the renderer's device or a log's date may be others.
        """
        return tuple(source_key(source) for source in (*self.references, self.query))

    @property
    @abstractmethod
    def key(self) -> str:
        """Key of what comes of it."""

    @cached_property
    def needs(self) -> tuple[RecordTask, ...]:
        """The recordings of drives that are simulated before."""
        return tuple(RecordTask(source, self.limit) for source in self.read if isinstance(source, Drive))

    @property
    @abstractmethod
    def read(self) -> tuple[Source, ...]:
        """The sources of which it reads the views."""

    @property
    @abstractmethod
    def kind(self) -> str:
        """What takes about as long as this."""

    @property
    @abstractmethod
    def title(self) -> str:
        """What is done, in words."""

    @abstractmethod
    def carry_out(self, store: Store) -> None:
        """Learn and ask."""

    @property
    def drive(self) -> Drive | None:
        """What it simulates itself, None: nothing."""
        return None

    def with_files(self, moved: Mapping[str, str]) -> "Question":
        """The task with the files that it names itself where they lie on another machine; its keys stay."""
        return self

    @property
    def own(self) -> Mapping[str, str]:
        """Digests of users' localisers among the methods."""
        return {name: plugin_digest(name) for name in self.methods if is_plugin(name)}

    def shelf(self, store: Store, number: int) -> Shelf:
        """Maps from the store: a reference drive that many queries are compared with is learnt once a profile."""

        def shelf(profile: str, learnt: Callable[[], ReferenceSequence]) -> ReferenceSequence:
            def make(path: Path) -> None:
                begin = time.perf_counter()
                sequence = learnt()
                took = {LEARNING: f"{time.perf_counter() - begin:.3f}"}
                save_map(replace(sequence, metadata={**sequence.metadata, **took}), path)

            key = self._map_key(profile, number)
            try:
                return load_map(store.make(key, MAP, make))
            except RefseqError:
                store.discard(key)  # what is kept there is damaged
                return load_map(store.make(key, MAP, make))

        return shelf

    @property
    def maps(self) -> tuple[str, ...]:
        """Keys of the maps that it may learn, or find in the store."""
        return tuple(self._map_key(profile, n) for profile in PROFILES for n in range(len(self.references)))

    def _map_key(self, profile: str, number: int) -> str:
        made_of = (self.sources[number], self.places, self.sensors, sources_digest(MAP_SOURCES))
        return key_of("map", profile, *made_of, packages(ANSWER_PACKAGES))


@dataclass(frozen=True)
class AnswerTask(Question):
    """Ask methods, which share what is dear, where the robot was at each view of the query drive."""

    @cached_property
    def key(self) -> str:
        """Key of the answers: views, methods, and the code and packages that answer."""
        return key_of(
            "answers",
            self.methods,
            self.own,
            *self.sources,
            self.places,
            self.sensors,
            self.seed,
            self.merge if self.further else None,
            sources_digest(ANSWER_SOURCES),
            sources_digest(BASELINE_SOURCES) if set(self.methods) & set(BASELINES) else None,
            packages(ANSWER_PACKAGES),
        )

    @property
    def read(self) -> tuple[Source, ...]:
        """All of them."""
        return (*self.references, self.query)

    @property
    def kind(self) -> str:
        """What takes about as long as this."""
        return f"ask {', '.join(self.methods)}"

    @property
    def title(self) -> str:
        """What is done, in words."""
        return f"ask {', '.join(self.methods)}, seed {self.seed}"

    def carry_out(self, store: Store) -> None:
        """Learn and ask."""
        drives, query = learnt_drives(self, store), asked_views(self, store)
        forget_peak()
        begin = time.perf_counter()
        learnt = self._learnt(drives, store)
        middle = time.perf_counter()
        blind = [replace(view, truth=None) for view in query.views]
        beliefs = learnt.answers(blind)
        sequences = [sequence for one in learnt.ours.values() for sequence in one.sequences]
        cost = Cost(
            learn_s=_learning(learnt, middle - begin),
            answer_s=time.perf_counter() - middle,
            places=sum(len(drive.views) for drive in drives),
            bytes_kept=bytes_kept(*sequences, *learnt.localisers.values()),
            features=sum(sequence.matrix.N for sequence in sequences) or None,
            peak_bytes=peak_bytes(),
        )
        merged = {method: merging.to_dict() for method, merging in learnt.mergings.items()}
        metadata = {**query.metadata, "cost": json.dumps(asdict(cost)), "merged": json.dumps(merged)}
        store.make(self.key, self.ending, lambda path: write_beliefs(path, query.views, beliefs, metadata))

    def _learnt(self, drives: Sequence[Recording], store: Store) -> Learnt:
        references = [Reference(drive.views, self.shelf(store, number)) for number, drive in enumerate(drives)]
        named = dict(zip(names_of(self.references), references, strict=True))
        return Learnt(self.methods, named, seed=self.seed, merging=self.merge)


def drive_with_files(drive: Drive, moved: Mapping[str, str]) -> Drive:
    """A drive with the files that it names where they lie now."""
    cameras = {camera: moved.get(model, model) for camera, model in drive.cameras.items()}
    return replace(drive, world=moved.get(drive.world, drive.world), cameras=cameras)


def _learning(learnt: Learnt, took: float) -> float:
    """How long learning took [s]: now, or when the maps were made that were at hand."""
    if not learnt.ours:
        return took
    maps = [float(sequence.metadata[LEARNING]) for one in learnt.ours.values() for sequence in one.maps]
    return math.fsum(maps) + math.fsum(one.merging.seconds for one in learnt.ours.values() if one.merging)


Task = RecordTask | Question


def learnt_drives(task: Question, store: Store) -> list[Recording]:
    """The views of each reference that are learnt."""
    found = []
    for source, key in zip(task.references, task.sources, strict=False):
        recording = read_views(source, key, store)
        views = recording.views[_stretch(task, len(recording.views))]
        found.append(Recording(tuple(only(view, task.sensors) for view in views), recording.metadata))
    return found


def _stretch(task: Question, count: int) -> slice:
    return stretch(task.places, count, Path("localise.places"))


def asked_views(task: AnswerTask, store: Store) -> Recording:
    """The views of the query that are asked about."""
    recording = read_views(task.query, task.sources[-1], store)
    return Recording(tuple(only(view, task.sensors) for view in recording.views), recording.metadata)


def answers_of(task: AnswerTask, store: Store) -> tuple[dict[str, list[Belief]], Cost]:
    """What a task that is done left in the store: beliefs by method, and what they cost. Raises ``DamagedError``."""
    path = store.path(task.key, task.ending)
    try:
        return read_beliefs(path), Cost(**_told(path, "cost"))
    except (LogError, OSError, pa.ArrowException, ValueError, KeyError, TypeError) as error:
        raise DamagedError(task.key, f"{path}: are no answers: {one_line(error)}") from error


def mergings_of(task: AnswerTask, store: Store) -> dict[str, Merging]:
    """How the references were merged, by method; of those only that have an atlas. ``answers_of`` tells of damage."""
    merged = _told(store.path(task.key, task.ending), "merged")
    return {method: Merging.from_dict(content) for method, content in merged.items()}


def _told(path: Path, name: str) -> dict[str, Any]:
    """What stands beside the beliefs."""
    metadata = json.loads(pq.read_schema(path).metadata[b"refseq"])
    found = json.loads(metadata[name])
    return dict(found)


def perform(task: Task, folder: Store) -> Outcome:
    """Carry a task out and tell how it ended; nothing is raised but what stops the process."""
    begin = time.perf_counter()
    try:
        if folder.has(task.key, task.ending):
            return Outcome(Verdict.PASSED, kept=True)
        task.carry_out(folder)
        return Outcome(Verdict.PASSED, seconds=time.perf_counter() - begin)
    except AbsentError as absent:
        return Outcome(Verdict.SKIPPED, str(absent))
    except MisbehavedError as failure:
        return Outcome(Verdict.FAILED, str(failure), traceback.format_exc(), time.perf_counter() - begin)
    except StuckError as failure:
        return Outcome(Verdict.FAILED, f"{task.title}: {failure}", seconds=time.perf_counter() - begin)
    except DamagedError as damaged:
        reason = f"{task.title}: {damaged}"
        return Outcome(Verdict.ERROR, reason, seconds=time.perf_counter() - begin, damaged=damaged.key)
    except (ScenarioError, SimError, WorldsError, RobotsError, RefseqError) as error:
        return Outcome(Verdict.ERROR, f"{task.title}: {error}", seconds=time.perf_counter() - begin)
    except Exception as error:
        details = "" if isinstance(error, OSError) else traceback.format_exc()  # a full disk is no fault of the code's
        reason = f"{task.title}: {one_line(error)}"
        return Outcome(Verdict.ERROR, reason, details, time.perf_counter() - begin)


def distinct(tasks: Sequence[Task]) -> list[Task]:
    """Tasks and what they need, each once, needs first."""
    found: dict[str, Task] = {}
    for task in tasks:
        for one in (*task.needs, task):
            found.setdefault(one.key, one)
    return list(found.values())
