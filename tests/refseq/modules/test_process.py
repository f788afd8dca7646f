"""The loop of a module on a link in this thread: it hears what it asked for, answers, and ends with the drive."""

import queue
from collections.abc import Callable
from typing import Any

import pytest

from refseq.modules.heads import MessageError, MissingError, Parts, head_bytes
from refseq.modules.messages import HEAD, STEPS, VIEWS, Step, head_of
from refseq.modules.process import TRIES, Role, run_module
from tests.sim.modules.local_link import LocalLink

ANSWERS = "answers"


class Counting:
    """A module that answers every other message with its number, and keeps what it heard."""

    role, says = Role.LOCALISER, ANSWERS

    def __init__(self, *hears: str) -> None:
        self.hears = hears
        self.heard: list[tuple[str, Parts]] = []

    def hear(self, topic: str, parts: Parts) -> Parts | None:
        self.heard.append((topic, parts))
        number = len(self.heard)
        return [("number", str(number).encode())] if number % 2 else None


class Silent(Counting):
    """One that is not to answer, but does."""

    says = ""


@pytest.fixture
def link() -> LocalLink:
    return LocalLink()


def step(number: int, over: str = "") -> Parts:
    return [(HEAD, head_bytes(Step("a drive", number, 0.0, 0.0, 0.0, "robuter", over=over)))]


def keep(link: LocalLink, topic: str, *messages: Parts) -> None:
    for parts in messages:
        link.publisher(topic, keep=100)(parts)


def answers(link: LocalLink) -> list[Parts]:
    found: list[Parts] = []
    link.subscribe(ANSWERS, found.append)
    return found


def test_it_hears_in_order_answers_and_ends_with_the_drive(link: LocalLink) -> None:
    """Not the step behind the last, which is another drive's; and no message is answered where nothing is said."""
    said, module = answers(link), Counting(STEPS)
    drive = [step(0), step(1), step(2, over="completed")]
    keep(link, STEPS, *drive, step(3))
    run_module(link, module, pytest.fail)
    assert module.heard == [(STEPS, parts) for parts in drive]
    assert said == [[("number", b"1")], [("number", b"3")]]
    assert link.roles == {Role.LOCALISER}


def test_one_that_hears_no_steps_is_given_none_and_ends_all_the_same(link: LocalLink) -> None:
    module = Counting(VIEWS)

    def view_then_end(parts: Parts) -> None:
        if parts == [("number", b"1")]:
            keep(link, STEPS, step(0), step(1, over="failed"))

    link.subscribe(ANSWERS, view_then_end)
    keep(link, VIEWS, [("view", b"0")])
    run_module(link, module, pytest.fail)
    assert module.heard == [(VIEWS, [("view", b"0")])]


def test_one_without_a_topic_to_answer_on_says_nothing(link: LocalLink) -> None:
    module = Silent(STEPS)
    keep(link, STEPS, step(0), step(1, over="completed"))
    run_module(link, module, pytest.fail)
    assert len(module.heard) == 2
    assert set(link.kept) == {STEPS}
    assert set(link.takers) == {STEPS}, "nobody published, nobody subscribed to an empty topic"


def test_others_that_come_and_go_are_told_of_and_it_itself_is_not(link: LocalLink) -> None:
    told: list[str] = []

    class Meeting(Counting):
        def hear(self, topic: str, parts: Parts) -> None:
            link.join(Role.CONTROL)
            link.leave(Role.CONTROL)

    link.join(Role.ROBOT)
    keep(link, STEPS, step(0, over="completed"))
    run_module(link, Meeting(STEPS), told.append)
    assert told == ["robot: is there", "control: is there", "control: is gone"]


def test_a_pause_is_no_end(link: LocalLink, monkeypatch: pytest.MonkeyPatch) -> None:
    """Between two looks for a message, each of a second, nothing came."""

    class Pausing:
        def __init__(self) -> None:
            self.inside: list[Any] = []
            self.pauses = 3

        def put(self, item: Any) -> None:
            self.inside.append(item)

        def get(self, timeout: float) -> Any:
            assert 0 < timeout <= 1.0, "Ctrl-C would not be heard"
            if self.pauses:
                self.pauses -= 1
                raise queue.Empty
            return self.inside.pop(0)

    monkeypatch.setattr("refseq.modules.process.queue.SimpleQueue", Pausing)
    module = Counting(STEPS)
    keep(link, STEPS, step(0), step(1, over="completed"))
    run_module(link, module, pytest.fail)
    assert [parts for _, parts in module.heard] == [step(0), step(1, over="completed")]


@pytest.mark.parametrize("hears", [STEPS, VIEWS])
def test_a_step_that_is_none_ends_it(link: LocalLink, hears: str) -> None:
    keep(link, STEPS, [(HEAD, b'{"drive": 3}')], step(1, over="completed"))
    with pytest.raises(MessageError, match=r"a message is no Step: drive: "):
        run_module(link, Counting(hears), pytest.fail)


class InOrder(Counting):
    """A module that takes steps from the first on, each once, and misses those before one that comes."""

    def hear(self, topic: str, parts: Parts) -> Parts | None:
        number = head_of(Step, parts).number
        if number > len(self.heard):
            raise MissingError(f"step {len(self.heard)} is missing: {number} came")
        if number < len(self.heard):
            return None
        self.heard.append((topic, parts))
        return [("number", str(number).encode())]


class Hasty(LocalLink):
    """A link that is asked so often before it remembers what it kept: until then the newest message comes alone."""

    def __init__(self, asked: int) -> None:
        super().__init__()
        self.asked = asked

    def subscribe(self, topic: str, take: Callable[[Parts], None]) -> Callable[[], None]:
        self.asked -= 1
        if self.asked < 0:
            return super().subscribe(topic, take)
        take(self.kept[topic][-1])
        return lambda: None


@pytest.mark.parametrize("asked", [0, 1, TRIES - 1])
def test_a_step_that_comes_before_older_ones_makes_it_ask_again(asked: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("refseq.modules.process.AGAIN", 0.0)
    link, module = Hasty(asked), InOrder(STEPS)
    drive = [step(0), step(1), step(2, over="completed")]
    keep(link, STEPS, *drive)
    run_module(link, module, pytest.fail)
    assert [parts for _, parts in module.heard] == drive


class Leaking(LocalLink):
    """A link that loses a message each time that it is asked, behind one that had not come before."""

    asked = 0

    def subscribe(self, topic: str, take: Callable[[Parts], None]) -> Callable[[], None]:
        self.asked += 1
        *older, last = self.kept[topic]
        for parts in [*older[: self.asked], *older[self.asked + 1 :], last]:
            take(parts)
        return lambda: None


def test_gaps_that_are_mended_one_after_the_other_do_not_end_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("refseq.modules.process.AGAIN", 0.0)
    link, module = Leaking(), InOrder(STEPS)
    drive = [*map(step, range(3 * TRIES)), step(3 * TRIES, over="completed")]
    keep(link, STEPS, *drive)
    run_module(link, module, pytest.fail)
    assert [parts for _, parts in module.heard] == drive
    assert link.asked > 2 * TRIES


def test_what_came_in_between_is_kept_no_more_and_ends_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Steps that it has taken are heard again with each asking, and mend nothing."""
    monkeypatch.setattr("refseq.modules.process.AGAIN", 0.0)
    link, module = LocalLink(), InOrder(STEPS)
    keep(link, STEPS, step(0), step(1), step(3), step(4, over="completed"))
    with pytest.raises(MissingError, match="step 2 is missing: 3 came"):
        run_module(link, module, pytest.fail)


def test_steps_that_nobody_has_any_more_end_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("refseq.modules.process.AGAIN", 0.0)
    link = LocalLink()
    keep(link, STEPS, step(1), step(2, over="completed"))
    with pytest.raises(MissingError, match="step 0 is missing: 1 came"):
        run_module(link, InOrder(STEPS), pytest.fail)
    assert not link.takers[STEPS]
