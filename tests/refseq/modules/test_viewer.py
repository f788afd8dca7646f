"""The viewer as a module, on a link in this thread: what it heard is read back from the recording that it wrote."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest

from refseq.belief import Belief
from refseq.errors import RefseqError
from refseq.map.learning import learn
from refseq.map.map import Map
from refseq.modules.heads import Parts, head_bytes
from refseq.modules.messages import (
    BELIEF,
    CAMERA,
    HEAD,
    ORDERS,
    STEPS,
    VIEWS,
    OrderHead,
    Step,
    ViewHead,
    view_parts,
)
from refseq.modules.viewer import LAYER, ViewerModule, WatchTab
from refseq.planar import Pose
from refseq.serve.answers import answer_to
from refseq.view import View
from refseq.viewer.belief_log import LocaliserLayer
from refseq.viewer.places import Places
from refseq.viewer.recording import saved
from tests.refseq.viewer.readback import empty_views, rows, values
from tests.sim.modules.local_link import LocalLink
from tests.support import corridor_drive, peaked

pytestmark = pytest.mark.filterwarnings("error")  # Rerun only warns about data that it cannot take
COUNT = 6
LOST = f"/lost/{LAYER}/chain"
BARS = f"/posterior/{LAYER}/chain"
LOG = "/mission/log"


@pytest.fixture(scope="module")
def drive() -> list[View]:
    """A few laser views along a corridor."""
    return [replace(view, images={}) for view in corridor_drive(np.random.default_rng(1), COUNT, size=24)]


@pytest.fixture(scope="module")
def map_(drive: list[View]) -> Map:
    return learn(drive)


@dataclass
class Told:
    """The robot and the executor as far as a viewer hears them, each message kept for those who come late."""

    map_: Map
    link: LocalLink = field(default_factory=LocalLink)

    def say(self, topic: str, parts: Parts) -> None:
        self.link.publisher(topic, keep=1000)(parts)

    def view(self, number: int, view: View, drive: str = "first") -> None:
        self.say(VIEWS, view_parts(drive, number, view))

    def step(
        self, *beliefs: tuple[int, Belief], view: int | None = None, at: Pose | None = None, drive: str = "first"
    ) -> None:
        truth = () if at is None else (at.x, at.y, at.heading)
        head = Step(drive, 0, 0.0, 0.0, 0.0, "robuter", view=view, truth=truth)
        told = [(BELIEF, answer_to(self.map_, number, View(0.0), belief).json) for number, belief in beliefs]
        self.say(STEPS, [(HEAD, head_bytes(head)), *told])

    def order(self, *log: str, drive: str = "first") -> None:
        head = OrderHead(drive, 0, 1, "MN:12", False, "", "", "under way", 0, 0.0, (), log)
        self.say(ORDERS, [(HEAD, head_bytes(head))])


@pytest.fixture
def told(map_: Map) -> Told:
    return Told(map_)


@contextmanager
def watching(told: Told, path: Path) -> Iterator[ViewerModule]:
    """A viewer that hears all that is said within the block, and what was kept of before, and writes it to a file."""
    with saved(path, "watched") as stream:
        module = ViewerModule(told.map_, stream, "watched")
        end: Callable[[], None] = told.link.run(module)
        yield module
        end()


def at(place: float, lost: float) -> Belief:
    return peaked(COUNT, place, 0.5, lost)


def shown(path: Path) -> list[tuple[int, float]]:
    """P(lost) in the recording, with the numbers of its views."""
    return [(number, lost) for number, (lost,) in rows(path, LOST, "Scalars:scalars", "view")]


def test_each_view_is_shown_with_its_own_belief_time_and_truth(told: Told, drive: list[View], tmp_path: Path) -> None:
    """The second belief comes late, in a step beside that of the third."""
    path = tmp_path / "a.rrd"
    beliefs = [at(0, 0.1), at(1, 0.2), at(2, 0.3)]
    order = (3, 1, 5)  # of views along the corridor, so that no number is right by chance
    with watching(told, path) as module:
        for number, place in enumerate(order):
            told.view(number, drive[place])
            told.step(*[(0, beliefs[0])] * (number == 0), view=number, at=drive[place].truth)
        assert module.shown == 1
        told.step((1, beliefs[1]), (2, beliefs[2]))
        assert module.shown == 3
    assert shown(path) == [(0, 0.1), (1, 0.2), (2, 0.3)]
    bars = values(path, f"{BARS}/belief", "BarChart:values", "view")
    assert [bar[0]["buffer"] for bar in bars] == [belief.places.tolist() for belief in beliefs]
    times = [(time.total_seconds(), lost) for time, (lost,) in rows(path, LOST, "Scalars:scalars", "time")]
    assert times == sorted((drive[place].time, belief.lost) for place, belief in zip(order, beliefs, strict=True))
    marks = values(path, f"{BARS}/truth", "BarChart:abscissa", "view")
    assert [mark[0]["buffer"] for mark in marks] == [[place] for place in order]


def test_nothing_is_shown_of_which_one_half_never_came(told: Told, drive: list[View], tmp_path: Path) -> None:
    """A view that nobody answered, a belief on a view that was not heard, and an answer that comes twice."""
    path = tmp_path / "a.rrd"
    with watching(told, path) as module:
        told.view(0, drive[0])
        told.view(1, drive[1])
        told.step((7, at(0, 0.7)))
        assert module.shown == 0
        told.step((1, at(1, 0.1)))
        told.step((1, at(2, 0.9)))
        assert module.shown == 1
    assert shown(path) == [(0, 0.1)]
    assert not [mark for mark in values(path, f"{BARS}/truth", "BarChart:abscissa", "view") if mark], "no pose was told"


def test_one_that_comes_late_shows_the_drive_from_its_begin(told: Told, drive: list[View], tmp_path: Path) -> None:
    with watching(told, tmp_path / "early.rrd"):
        for number, view in enumerate(drive):
            told.view(number, view)
            told.step((number, at(number, 0.1 * number)), view=number, at=view.truth)
            told.order(*(f"line {one}" for one in range(number)))
    with watching(told, tmp_path / "late.rrd") as late:
        assert late.shown == COUNT
    early, again = (
        [shown(path), values(path, f"{BARS}/truth", "BarChart:abscissa", "view"), lines(path)]
        for path in (tmp_path / "early.rrd", tmp_path / "late.rrd")
    )
    assert early == again
    assert len(early[0]) == len(early[1]) == COUNT


def test_beliefs_may_come_before_their_views(told: Told, drive: list[View], tmp_path: Path) -> None:
    """To one that comes late the kept steps and the kept views come in either order."""
    path = tmp_path / "a.rrd"
    with watching(told, path) as module:
        for number, view in enumerate(drive):
            told.step((number, at(number, 0.1 * number)), view=number, at=view.truth)
        assert module.shown == 0
        for number, view in enumerate(drive):
            told.view(number, view)
        assert module.shown == COUNT
    assert shown(path) == [(number, 0.1 * number) for number in range(COUNT)]
    assert len(values(path, f"{BARS}/truth", "BarChart:abscissa", "view")) == COUNT


def lines(path: Path) -> list[str]:
    """The mission's log, in the order in which it was written."""
    found = rows(path, LOG, "TextLog:text", "view")
    return [line for _, (line,) in found]


def test_a_line_of_the_log_is_told_once_though_each_order_has_all(
    told: Told, drive: list[View], tmp_path: Path
) -> None:
    path = tmp_path / "a.rrd"
    with watching(told, path):
        told.view(0, drive[0])
        told.step((0, at(0, 0.1)))
        for log in (["a"], ["a"], ["a", "b", "c"], ["a", "b"], ["a", "b", "c", "d"]):
            told.order(*log)
    assert lines(path) == ["a", "b", "c", "d"]


def test_another_drive_begins_anew(told: Told, drive: list[View], tmp_path: Path) -> None:
    """Neither views, poses nor the log of the drive before go on into it."""
    path = tmp_path / "a.rrd"
    with watching(told, path) as module:
        for number in (0, 1):
            told.view(number, drive[number])
            told.step((number, at(number, 0.1)), view=number, at=drive[number].truth)
        told.order("a", "b")
        told.view(2, drive[2])
        told.step(view=2, at=drive[2].truth)  # waits for its belief
        told.order("c", drive="second")
        assert module.shown == 0
        told.step((2, at(2, 0.9)), drive="second")
        assert module.shown == 0, "that view was the other drive's"
        told.view(0, drive[4], drive="second")
        told.step((0, at(4, 0.4)), drive="second")
        assert module.shown == 1
    assert sorted(shown(path)) == [(0, 0.1), (0, 0.4), (1, 0.1)]
    assert sorted(lines(path)) == ["a", "b", "c"]


def test_no_panel_stays_empty_and_the_log_is_one(told: Told, drive: list[View], tmp_path: Path) -> None:
    path = tmp_path / "a.rrd"
    with watching(told, path):
        for number, view in enumerate(drive[:2]):
            told.view(number, view)
            told.step((number, at(number, 0.1)), view=number, at=view.truth)
    tab = WatchTab(told.map_, LocaliserLayer(LAYER, ("chain",), Places.of(told.map_)))
    assert empty_views(tab.layout(), path) == ["the executor's log"], "nobody gave an order"
    with watching(told, path):
        told.order("a")
    assert empty_views(tab.layout(), path) == []


VIEW = (HEAD, head_bytes(ViewHead("first", 1, 0.0, 0.0, 0.0, True)))
STEP = (HEAD, head_bytes(Step("first", 0, 0.0, 0.0, 0.0, "robuter")))


@pytest.mark.parametrize(
    ("topic", "parts", "why"),
    [
        (VIEWS, [], "no ViewHead"),
        (VIEWS, [STEP], "no ViewHead"),
        (VIEWS, [VIEW, (f"{CAMERA}front", b"\xff\xff")], "no foxglove.CompressedImage"),
        (STEPS, [(HEAD, b"{")], "no Step"),
        (STEPS, [STEP, (BELIEF, b"{}")], "no belief"),
        (ORDERS, [STEP], "no OrderHead"),
    ],
)
def test_what_is_no_message_is_refused_and_shows_nothing(
    told: Told, drive: list[View], tmp_path: Path, topic: str, parts: Parts, why: str
) -> None:
    path = tmp_path / "a.rrd"
    with watching(told, path) as module:
        told.view(0, drive[0])
        with pytest.raises(RefseqError, match=why):
            module.hear(topic, parts)
        assert module.shown == 0
        told.step((0, at(0, 0.5)))
    assert shown(path) == [(0, 0.5)], "the next one is shown"


def test_a_belief_on_another_map_is_refused(told: Told, drive: list[View], tmp_path: Path) -> None:
    with watching(told, tmp_path / "a.rrd"):
        told.view(0, drive[0])
        with pytest.raises(RefseqError, match=f"an answer over 9 places; valid is one over {COUNT}"):
            told.step((0, Belief(np.full(9, 1 / 9), 0.0, 0, (0,), 2.0)))


def test_of_views_that_nobody_answers_a_few_wait(
    told: Told, drive: list[View], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("refseq.modules.viewer.MOST_WAITING", 3)
    with watching(told, tmp_path / "a.rrd") as module:
        for number in range(6):
            told.view(number, drive[number % len(drive)])
        assert sorted(module._views) == [3, 4, 5]
        told.step((5, at(1, 0.1)))
        assert module.shown == 1
