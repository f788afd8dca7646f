import errno
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from refseq.belief import Belief
from refseq.errors import LogError, MapError
from refseq.map.map import Map
from refseq.view import LASER, View
from refseq_bench.robots.errors import RobotsError
from refseq_bench.scenarios.campaign.declare.outcomes import Verdict
from refseq_bench.scenarios.campaign.declare.real_recordings import DATA, AbsentError
from refseq_bench.scenarios.campaign.declare.sources import Log
from refseq_bench.scenarios.campaign.run import answering, tasks
from refseq_bench.scenarios.campaign.run.learning import kept_maps
from refseq_bench.scenarios.campaign.run.tasks import AnswerTask, RecordTask, answers_of, distinct, perform
from refseq_bench.scenarios.campaign.store.cache import DamagedError, Store
from refseq_bench.scenarios.drives.drive import Drive
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.methods.plugins import MisbehavedError
from refseq_bench.scenarios.methods.reference import Reference
from refseq_bench.scenarios.methods.shelf import Learning
from refseq_bench.sim.drives.signal_faults import SignalFault, SignalFaultKind
from refseq_bench.sim.errors import SimError, StuckError
from refseq_bench.worlds.errors import WorldsError
from tests.scenarios.campaign.chores import Chore
from tests.scenarios.campaign.made import write_logs
from tests.support import certain

REFERENCE, QUERY = Log("reference.mcap"), Log("query.mcap")


@pytest.fixture
def asks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> AnswerTask:
    write_logs(tmp_path)
    monkeypatch.setenv(DATA, str(tmp_path))
    return AnswerTask(("thesis/chain", "thesis/hmm"), REFERENCE, QUERY, "2:8", None, 1, 60.0)


@pytest.mark.parametrize(
    ("error", "verdict", "reason", "traced"),
    [
        (AbsentError("a.log: is not there"), "skipped", "a.log: is not there", False),
        (MisbehavedError("mine:Own, view 3: raised", "in make"), "error", "mine:Own, view 3: raised", True),
        (StuckError("the robot is stuck"), "failed", "write it: the robot is stuck", False),
        *(
            (kind("what, where"), "error", "write it: what, where", False)
            for kind in (ScenarioError, SimError, WorldsError, RobotsError, LogError)
        ),
        (DamagedError("other", "other.mcap: is damaged"), "error", "write it: other.mcap: is damaged", False),
        (OSError(errno.EIO, "Input/output error", "it"), "error", "write it: it: Input/output error", False),
        (ZeroDivisionError("by\nnought"), "error", "write it: ZeroDivisionError: by nought", True),
    ],
)
def test_whatever_is_raised_is_an_outcome(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: Exception, verdict: str, reason: str, traced: bool
) -> None:
    def make(_chore: Chore, _path: Path) -> None:
        raise error

    monkeypatch.setattr(Chore, "_make", make)
    outcome = perform(Chore("it"), Store(tmp_path))
    assert (outcome.verdict.value, outcome.reason) == (verdict, reason)
    assert ("in make" in outcome.details) is traced
    assert outcome.damaged == ("other" if isinstance(error, DamagedError) else "")
    assert not outcome.kept


def test_what_is_there_is_not_made_again(tmp_path: Path) -> None:
    store = Store(tmp_path)
    assert [perform(Chore("it"), store).kept for _ in range(2)] == [False, True]


def test_a_drive_tells_what_sets_it_apart() -> None:
    drive = Drive(world="annex", light="20:00", seed=3)
    titles = {
        RecordTask(each, 1.0).title: each
        for each in (drive, replace(drive, robot="rmp"), replace(drive, change="people=1"), replace(drive, seed=4))
    }
    assert len(titles) == 4
    assert RecordTask(replace(drive, change="people=1"), 1.0).title == "drive annex 20:00 people=1 by robuter, seed 3"
    assert RecordTask(replace(drive, world="my/hall.toml"), 1.0).title == "drive hall 20:00 by robuter, seed 3"


def test_answers_have_another_key_as_soon_as_anything_differs_that_has_a_part_in_them(asks: AnswerTask) -> None:
    others = [
        replace(asks, methods=("thesis/hmm",)),
        replace(asks, methods=("vlad",)),
        replace(asks, reference=QUERY),
        replace(asks, query=REFERENCE),
        replace(asks, places="2:7"),
        replace(asks, sensors=(LASER,)),
        replace(asks, seed=2),
    ]
    assert len({one.key for one in (asks, *others)}) == 1 + len(others)
    assert replace(asks, limit=1.0).key == asks.key


def test_methods_are_given_the_query_with_its_signal_faults(
    asks: AnswerTask, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given: dict[str, list[View]] = {}

    class SeenError(Exception):
        """Known: all that is given."""

    def see(_request: object, references: Mapping[str, Reference], views: Sequence[View]) -> None:
        given["query"], given["reference"] = list(views), [view for one in references.values() for view in one.views]
        raise SeenError

    monkeypatch.setattr(tasks, "answered", see)
    lost = SignalFault(SignalFaultKind.ODOMETRY_LOST, at=1.5)
    for task in (asks, replace(asks, signal_faults=(lost,))):
        with pytest.raises(SeenError):
            task.carry_out(Store(tmp_path))
        assert all(view.has_odometry for view in given["reference"])
        assert all(view.has_odometry for view in given["query"]) is (task is asks)
    assert given["query"][0].has_odometry


def test_a_map_is_shared_by_all_who_learn_the_same(asks: AnswerTask) -> None:
    alike = [replace(asks, methods=("vlad",)), replace(asks, query=REFERENCE), replace(asks, seed=2)]
    assert all(one.maps == asks.maps for one in alike)
    smaller = replace(asks, made_by=Learning(words=0.5, alike=0.2))  # the whole one is kept
    assert (smaller.maps, smaller.key == asks.key) == (asks.maps, False)
    others = [
        replace(asks, reference=QUERY),
        replace(asks, places="2:7"),
        replace(asks, sensors=(LASER,)),
        replace(asks, made_by=Learning(features=("sift",))),
    ]
    maps = [name for one in (asks, *others) for name in one.maps]
    assert len(set(maps)) == len(maps)


def test_learning_that_fails_is_not_tried_again(tmp_path: Path) -> None:
    tried = list[str]()

    class Failing:
        def learnt(self, profile: str, _views: Sequence[View]) -> Map:
            tried.append(profile)
            raise MapError("no view has a feature")

    shelf = kept_maps(Store(tmp_path), Failing(), lambda profile: profile)  # type: ignore[arg-type]
    with pytest.raises(MapError, match="no view has a feature"):
        shelf("thesis", [])
    assert tried == ["thesis"]


def test_methods_learn_the_places_asked_for_and_never_see_where_they_are(
    asks: AnswerTask, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Learnt:
        ours, localisers, mergings = dict[str, object](), dict[str, object](), dict[str, object]()
        guests = ()

        def __init__(
            self, methods: Sequence[str], drives: Mapping[str, Reference], *, seed: int, merging: bool
        ) -> None:
            assert (methods, seed, merging) == (asks.methods, 1, True)
            self._places = sum(len(drive.views) for drive in drives.values())

        def __enter__(self) -> "Learnt":
            return self

        def __exit__(self, *error: object) -> None: ...

        def answers(self, views: Sequence[View]) -> dict[str, list[Belief]]:
            assert all(view.truth is None and view.scan is None and view.images for view in views)
            return {name: [certain(self._places, 0) for _ in views] for name in asks.methods}

    monkeypatch.setattr(answering, "Learnt", Learnt)
    store, task = Store(tmp_path / "store"), replace(asks, sensors=("forward",))
    outcome = perform(task, store)
    assert outcome.verdict is Verdict.PASSED, outcome.reason
    kept = answers_of(task, store)
    assert kept.cost.places == 6
    assert {name: (len(each), len(each[0].places)) for name, each in kept.beliefs.items()} == dict.fromkeys(
        asks.methods, (12, 6)
    )


def test_what_is_no_answer_is_damaged(asks: AnswerTask, tmp_path: Path) -> None:
    store = Store(tmp_path / "store")
    for content in (None, b"", b"PAR1 PAR1"):
        if content is not None:
            store.path(asks.key, asks.ending).write_bytes(content)
        with pytest.raises(DamagedError, match="are no answers") as damaged:
            answers_of(asks, store)
        assert damaged.value.key == asks.key


def test_each_task_is_listed_once_after_what_it_needs() -> None:
    drives = [Chore("a"), Chore("b")]
    asked = [Chore("x", needs=(drives[0], drives[1])), Chore("y", needs=(drives[1],)), Chore("x", needs=(drives[0],))]
    assert [task.key for task in distinct(asked)] == ["a", "b", "x", "y"]


def test_a_task_that_several_want_has_the_greatest_limit() -> None:
    drive, other = Drive(), Drive(seed=4)
    asked = [RecordTask(drive, 5.0), RecordTask(other, 1.0), RecordTask(drive, 3600.0), RecordTask(drive, 60.0)]
    assert [(task.drive, task.limit) for task in distinct(asked)] == [(drive, 3600.0), (other, 1.0)]
