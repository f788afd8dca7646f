"""Tasks of a campaign: record a drive, or ask methods about it. Each leaves a file in the store.

Missions, which ask methods while the robot goes by their answers, are in
``refseq_bench.scenarios.campaign.run.mission_task``. A task is a value, so that it can be sent to another process or
machine; keys name what it needs and what it makes.
"""

import time
import traceback
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path

import pyarrow as pa

from refseq.errors import LogError, MapError
from refseq.logs import Recording
from refseq.map.profile import PROFILES, profile_named
from refseq_bench.scenarios.campaign.declare import sources as declared_sources
from refseq_bench.scenarios.campaign.declare.outcomes import TaskOutcome, Verdict, one_line
from refseq_bench.scenarios.campaign.declare.real_recordings import AbsentError
from refseq_bench.scenarios.campaign.declare.sources import Source, names_of
from refseq_bench.scenarios.campaign.run import learning
from refseq_bench.scenarios.campaign.run.answering import MEMORY, AnswerRequest, answered
from refseq_bench.scenarios.campaign.run.answering_code import READER, answering_code
from refseq_bench.scenarios.campaign.run.learning import kept_maps, selected
from refseq_bench.scenarios.campaign.store import keys
from refseq_bench.scenarios.campaign.store import views as stored_views
from refseq_bench.scenarios.campaign.store.answers import KeptAnswers, read_answers, write_answers
from refseq_bench.scenarios.campaign.store.cache import ANSWERS, RECORDING, DamagedError, Store
from refseq_bench.scenarios.campaign.store.keys import code_digest, key_of
from refseq_bench.scenarios.campaign.store.views import read_views, recording_key, source_key
from refseq_bench.scenarios.drives.drive import Drive
from refseq_bench.scenarios.drives.record import record
from refseq_bench.scenarios.errors import ScenarioError, input_errors
from refseq_bench.scenarios.methods import networks
from refseq_bench.scenarios.methods.names import profile_of
from refseq_bench.scenarios.methods.networks import network_of
from refseq_bench.scenarios.methods.plugins import MisbehavedError, is_plugin, plugin_digest
from refseq_bench.scenarios.methods.reference import Reference
from refseq_bench.scenarios.methods.shelf import WHOLE, Learning
from refseq_bench.sim.drives import signal_faults
from refseq_bench.sim.drives.signal_faults import SignalFault, with_signal_faults
from refseq_bench.sim.errors import StuckError

HANDS = (__name__, declared_sources.__name__, stored_views.__name__, keys.__name__, networks.__name__)
"""Modules that hand views to those that learn and answer: their own text counts in a key, not all that they import."""


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
        """Name for tasks that take about as long as this one."""
        return f"drive, {self.drive.renderer.value}"

    @property
    def title(self) -> str:
        """The task in words."""
        drive = self.drive
        change = "" if drive.change == "none" else f" {drive.change}"
        return f"drive {Path(drive.world).stem} {drive.light}{change} by {drive.robot}, seed {drive.seed}"

    def with_files(self, moved: Mapping[str, str]) -> "RecordTask":
        """The task with the files that its drive names where they lie on another machine."""
        return replace(self, drive=drive_with_files(self.drive, moved))

    def carry_out(self, store: Store) -> None:
        """Simulate."""
        store.make(self.key, self.ending, lambda path: record(self.drive, path, whole=False))


@dataclass(frozen=True)
class Question(ABC):
    """Something is asked of ``methods``, which learn the reference drive; ``query`` says where and when.

    Only ``places`` FROM:TO of the reference are learnt, only ``sensors`` are looked at (None: all). ``seed`` is that of
    the methods' own draws. Where there are ``further`` references, all are learnt, as an atlas by our own localiser,
    with ``merge`` after what they share was taken out. Its maps are made by ``made_by``.
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
    made_by: Learning = WHOLE
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
        """Name for tasks that take about as long as this one."""

    @property
    @abstractmethod
    def title(self) -> str:
        """The task in words."""

    @abstractmethod
    def carry_out(self, store: Store) -> None:
        """Learn and ask."""

    @property
    def drive(self) -> Drive | None:
        """The drive that it simulates itself, None: none."""
        return None

    def with_files(self, moved: Mapping[str, str]) -> "Question":
        """The task with the files that it names itself where they lie on another machine; its keys stay."""
        return self

    @property
    def plugins(self) -> Mapping[str, str]:
        """Digests of users' localisers among the methods."""
        return {name: plugin_digest(name) for name in self.methods if is_plugin(name)}

    @cached_property
    def network(self) -> str | None:
        """SHA-256 of the neural network that the methods ask, None: none. Raises ``AbsentError`` where it is missing.

        As ``sources``, it is reckoned where the campaign is run.
        """
        try:
            return self._network_here()
        except MapError as error:
            raise AbsentError(str(error)) from None

    def _network_here(self) -> str | None:
        return network_of(self.methods, self.made_by.features, self.sensors)

    def check_network(self) -> None:
        """Raise ``ScenarioError`` where the network at hand is another one."""
        if self.network is not None and (here := self._network_here()) != self.network:
            raise ScenarioError(f"the neural network here is sha256 {here:.12}…; valid is {self.network:.12}…")

    def learnt(self, store: Store) -> dict[str, Reference]:
        """The references by name, with the maps of them that are kept: many queries are compared with the same one."""
        self.check_network()
        drives = zip(names_of(self.references), learnt_drives(self, store), self.sources, strict=False)
        return {
            name: Reference(drive.views, kept_maps(store, self.made_by, partial(self._map_key, source)))
            for name, drive, source in drives
        }

    @property
    def maps(self) -> tuple[str, ...]:
        """Keys of the maps that it may learn, or find in the store."""
        sources = self.sources[: len(self.references)]
        profiles = dict.fromkeys((*PROFILES, *filter(None, map(profile_of, self.methods))))
        return tuple(self._map_key(source, profile) for profile in profiles for source in sources)

    def _map_key(self, source: str, profile: str) -> str:
        code = code_digest(learning.__name__, READER, alone=HANDS)
        network = self.network if profile_named(profile).asks_network(self.made_by.features) else None
        return key_of(
            "map", profile, *filter(None, [network]), source, self.places, self.sensors, self.made_by.features, code
        )


@dataclass(frozen=True)
class AnswerTask(Question):
    """Ask methods, which share what is dear, where the robot was at each view of the query drive.

    The views that methods are given have ``signal_faults``.
    """

    signal_faults: tuple[SignalFault, ...] = ()

    @cached_property
    def key(self) -> str:
        """Key of the answers: views, methods, and the code and packages that answer."""
        return key_of(
            "answers",
            self.methods,
            self.plugins,
            *filter(None, [self.network]),
            *self.sources,
            names_of(self.references),
            self.places,
            self.sensors,
            self.seed,
            self.merge if self.further else None,
            self.made_by,
            answering_code(self.methods, HANDS),
            *((self.signal_faults, code_digest(signal_faults.__name__)) if self.signal_faults else ()),
        )

    @property
    def read(self) -> tuple[Source, ...]:
        """All of them."""
        return (*self.references, self.query)

    @property
    def kind(self) -> str:
        """Name for tasks that take about as long as this one."""
        return f"ask {', '.join(self.methods)}"

    @property
    def title(self) -> str:
        """The task in words."""
        return f"ask {', '.join(self.methods)}, seed {self.seed}"

    def carry_out(self, store: Store) -> None:
        """Learn and ask."""
        references, query = self.learnt(store), asked_views(self, store)
        given = query.views
        if self.signal_faults:
            given = tuple(with_signal_faults(given, self.signal_faults, self.seed))
        MEMORY.keep_in(store.folder)
        kept = answered(AnswerRequest(self.methods, self.seed, self.merge), references, given)
        store.make(self.key, self.ending, lambda path: write_answers(path, query, kept))


def drive_with_files(drive: Drive, moved: Mapping[str, str]) -> Drive:
    """A drive with the files that it names where they lie now."""
    cameras = {camera: moved.get(model, model) for camera, model in drive.cameras.items()}
    return replace(drive, world=moved.get(drive.world, drive.world), cameras=cameras)


Task = RecordTask | Question


def learnt_drives(task: Question, store: Store) -> list[Recording]:
    """The views of each reference that are learnt."""
    return [
        selected(read_views(source, key, store), task.places, task.sensors)
        for source, key in zip(task.references, task.sources, strict=False)
    ]


def asked_views(task: AnswerTask, store: Store) -> Recording:
    """The views of the query that are asked about."""
    return selected(read_views(task.query, task.sources[-1], store), None, task.sensors)


def answers_of(task: AnswerTask, store: Store) -> KeptAnswers:
    """Read what a task that is done left in the store. Raises ``DamagedError``."""
    path = store.path(task.key, task.ending)
    try:
        return read_answers(path)
    except (LogError, OSError, pa.ArrowException, ValueError, KeyError, TypeError) as error:
        raise DamagedError(task.key, f"{path}: are no answers: {one_line(error)}") from error


def perform(task: Task, folder: Store) -> TaskOutcome:
    """Carry a task out and tell how it ended; nothing is raised but what stops the process."""
    begin = time.perf_counter()
    try:
        if folder.has(task.key, task.ending):
            return TaskOutcome(Verdict.PASSED, kept=True)
        task.carry_out(folder)
        return TaskOutcome(Verdict.PASSED, seconds=time.perf_counter() - begin)
    except AbsentError as absent:
        return TaskOutcome(Verdict.SKIPPED, str(absent))
    except MisbehavedError as failure:
        return TaskOutcome(Verdict.ERROR, str(failure), failure.said, time.perf_counter() - begin)
    except StuckError as failure:
        return TaskOutcome(Verdict.FAILED, f"{task.title}: {failure}", seconds=time.perf_counter() - begin)
    except DamagedError as damaged:
        reason = f"{task.title}: {damaged}"
        return TaskOutcome(Verdict.ERROR, reason, seconds=time.perf_counter() - begin, damaged=damaged.key)
    except input_errors() as error:
        return TaskOutcome(Verdict.ERROR, f"{task.title}: {error}", seconds=time.perf_counter() - begin)
    except Exception as error:
        details = "" if isinstance(error, OSError) else traceback.format_exc()  # a full disk is no fault of the code's
        reason = f"{task.title}: {one_line(error)}"
        return TaskOutcome(Verdict.ERROR, reason, details, time.perf_counter() - begin)


def distinct(tasks: Sequence[Task]) -> list[Task]:
    """Tasks and what they need, each once, needs first; one that several want has the greatest of their limits."""
    found: dict[str, Task] = {}
    for task in tasks:
        for one in (*task.needs, task):
            held = found.setdefault(one.key, one)
            if one.limit > held.limit:
                found[one.key] = one
    return list(found.values())
