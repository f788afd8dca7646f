import os
import sys
from pathlib import Path

import numpy as np
import pytest

from refseq.belief import Belief, Timings, belief_from
from refseq.view import View
from refseq_bench.scenarios.methods.guests.host import _Host, serve
from refseq_bench.scenarios.methods.guests.wire import GuestMessage, Kind, belief_of, packed, parsed, view_message
from refseq_bench.scenarios.methods.plugins import check_plugin
from tests.forked import in_child
from tests.scenarios.methods.folder import GOOD, written


def sent(pieces: list[memoryview]) -> GuestMessage:
    data = b"".join(pieces)
    header, payload = np.frombuffer(data, "<u4", 2)
    assert len(data) == 8 + header + payload
    return parsed(data[8 : 8 + header], data[8 + header :])


class Asked:
    """A host in this process, asked as the bench would ask it."""

    def __init__(self, here: Path, text: str) -> None:
        written(here, text)
        sys.path.append(str(here))
        self.host, self.places = _Host("mine:Mine", 1), 0

    def ask(self, kind: Kind, **header: object) -> GuestMessage:
        return sent(self.host.reply(sent(packed(kind, header))))

    def learn(self, views: list[View]) -> GuestMessage:
        if (answer := self.ask(Kind.HELLO, seed=1)).kind == Kind.ERROR:
            return answer
        for number, view in enumerate(views):
            assert self.host.reply(sent(view_message(Kind.LEARN, number, view, None))) == []
        self.places = len(views)
        return self.ask(Kind.LEARNT)

    def update(self, number: int, view: View) -> GuestMessage:
        return sent(self.host.reply(sent(view_message(Kind.LOCALISE, number, view, None))))

    def belief(self, view: View) -> Belief:
        return belief_of(self.update(0, view), self.places)


def test_it_sees_no_truth_and_views_that_cannot_be_written_to(here: Path, views: list[View]) -> None:
    asked = Asked(here, GOOD.format(answer="belief_from(np.ones(5))"))
    assert asked.learn(views).kind == Kind.OK
    assert asked.ask(Kind.RESET).kind == Kind.OK
    asked.update(0, views[1])
    mine = asked.host._inner
    seen = [*mine.views, *mine.seen]  # type: ignore[union-attr]
    assert len(seen) == 6
    for one, shown in zip(seen, [*views, views[1]], strict=True):
        assert one.truth is None
        assert shown.truth is not None
        assert (one.time, one.distance, one.turn) == (shown.time, shown.distance, shown.turn)
        assert one.sensors == shown.sensors
        for array, original in [
            (one.scan.ranges, shown.scan.ranges),
            *((one.images[name], shown.images[name]) for name in shown.images),
        ]:
            assert np.array_equal(array, original)
            assert array.dtype == original.dtype
            with pytest.raises(ValueError, match="read-only"):
                array[...] = 0
        with pytest.raises(TypeError):
            one.images["camera-9"] = np.zeros(3)


def test_answers_come_through_bit_for_bit_and_are_timed(here: Path, views: list[View]) -> None:
    asked = Asked(here, GOOD.format(answer="belief_from(np.arange(1, 6) ** 0.5, 1 / 3, path=(-1, 2))"))
    asked.learn(views)
    asked.ask(Kind.RESET)
    found, true = asked.belief(views[0]), belief_from(np.arange(1, 6) ** 0.5, 1 / 3, path=(-1, 2))
    assert found.places.tobytes() == true.places.tobytes()
    assert (found.lost, found.best, tuple(found.path), found.entropy) == (1 / 3, 4, (-1, 2), true.entropy)
    assert found.timings.matching > 0
    assert found.timings.features == 0


def test_its_own_times_are_kept(here: Path, views: list[View]) -> None:
    asked = Asked(here, GOOD.format(answer="belief_from(np.ones(5), timings=Timings(features=2.0))"))
    asked.learn(views)
    asked.ask(Kind.RESET)
    assert asked.belief(views[0]).timings == Timings(features=2.0)


BAD_ANSWERS = [
    ("None", "answered NoneType; valid is refseq.belief.Belief"),
    ("np.ones(5) / 5", "answered ndarray; valid is refseq.belief.Belief"),
    ("Belief(np.ones(4) / 4, 0, 0, (0,), 0)", "places has shape (4,); valid is (5,), one a reference view"),
    ("Belief(np.eye(5), 0, 0, (0,), 0)", "places has shape (5, 5); valid is (5,), one a reference view"),
    ("Belief(0.2, 0, 0, (0,), 0)", "places has shape (); valid is (5,), one a reference view"),
    ("Belief('abc', 0, 0, (0,), 0)", "places is str; valid is an array (5,) of numbers"),
    ("Belief(None, 0, 0, (0,), 0)", "places has shape (); valid is (5,), one a reference view"),
    ("Belief(np.full(5, np.nan), 0, 0, (0,), 0)", "places holds what is no probability (nan, infinite or negative)"),
    ("Belief([2, -1, 0, 0, 0], 0, 0, (0,), 0)", "places holds what is no probability (nan, infinite or negative)"),
    ("Belief(np.ones(5), 0, 0, (0,), 0)", "places sums to 5; valid is 1"),
    ("belief_from(np.ones(5), 0.5, lost_after=np.ones(4) / 9)", "lost_after has shape (4,); valid is (5,), one a "),
    ("belief_from(np.ones(5), 0.5, lost_after=np.eye(5)[0] * np.nan)", "lost_after holds what is no probability"),
    ("belief_from(np.ones(5), 0.5, lost_after=np.ones(5) / 5)", "lost_after sums to 1; valid is at most lost, 0.5"),
    ("Belief(np.ones(5) / 5, 0, 0, (0,), 0, odometer_scale=-1.0)", "odometer_scale is -1.0; valid is 1e-06 to 1e+06"),
    ("belief_from(np.ones(5), 0.5, lost_after='hall')", "lost_after is str; valid is an array (5,) of numbers"),
    ("Belief(np.ones(5) / 5, np.nan, 0, (0,), 0)", "lost is nan; valid is 0 to 1"),
    ("Belief(np.ones(5) / 5, 1.5, 0, (0,), 0)", "lost is 1.5; valid is 0 to 1"),
    ("Belief(np.ones(5) / 5, None, 0, (0,), 0)", "lost is None; valid is a number"),
    ("Belief(np.ones(5) / 5, 0, 5, (0,), 0)", "best is 5; valid is a whole number from 0 to 4"),
    ("Belief(np.ones(5) / 5, 0, 1.5, (0,), 0)", "best is 1.5; valid is a whole number from 0 to 4"),
    ("Belief(np.ones(5) / 5, 0, -1, (0,), 0)", "best is -1; valid is a whole number from 0 to 4"),
    ("Belief(np.ones(5) / 5, 0, 0, None, 0)", "path is None; valid is a tuple of places"),
    ("Belief(np.ones(5) / 5, 0, 0, (9,), 0)", "path is 9; valid is a whole number from 0 to 4, or -1 where it is lost"),
    ("Belief(np.ones(5) / 5, 0, 0, (0,), np.nan)", "entropy is nan; valid is 0 or more"),
    ("Belief(np.ones(5) / 5, 0, 0, (0,), np.inf)", "entropy is inf; valid is 0 or more"),
    ("Belief(np.ones(5) / 5, '0.2', 0, (0,), 0)", "lost is '0.2'; valid is a number"),
    ("Belief(np.ones(5) / 5, True, 0, (0,), 0)", "lost is True; valid is a number"),
    ("Belief(np.ones(5) / 5, 0, 0, (0,), 0, 3)", "timings is int; valid is refseq.belief.Timings"),
    ("Belief([10**400] * 5, 0, 0, (0,), 0)", "places is list; valid is an array (5,) of numbers"),
    (
        "Belief(np.ones(5) / 5, 10**400, 0, (0,), 0)",
        "lost is 1000000000000000000000000000000000000000; valid is a number",
    ),
    ("Sly(np.ones(5) / 5, 0, 0, (0,), 0)", "raised KeyError: 'no' (mine.py, line 6)"),
    ("1 / 0", "raised ZeroDivisionError: division by zero (mine.py, line 13)"),
    ("view.truth.x", "raised AttributeError: 'NoneType' object has no attribute 'x' (mine.py, line 13)"),
    ("exit(3)", "raised SystemExit: 3 (mine.py, line 13)"),
    ("belief_from(np.zeros(5))", "raised RefseqError: belief: weights of shape (5,), 0 to 0, make no probabilities"),
]


@pytest.mark.parametrize(("answer", "told"), BAD_ANSWERS)
def test_what_is_no_answer_is_told(here: Path, views: list[View], answer: str, told: str) -> None:
    asked = Asked(here, GOOD.format(answer=answer))
    asked.learn(views)
    asked.ask(Kind.RESET)
    found = asked.update(0, views[0])
    assert found.kind == Kind.ERROR
    assert found.header["reason"].startswith(told)
    assert "\n" not in found.header["reason"]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("raise OSError('no\\nweights')\nMine = 1", "raised OSError: no weights (mine.py, line 1)"),
        ("import not_there_at_all\nMine = 1", "raised ModuleNotFoundError: No module named"),
        ("def Mine(:", "raised SyntaxError: invalid syntax"),
        ("Mine = 1", "raised TypeError: mine:Mine is no class but int"),
        ("class Mine: pass", "raised TypeError: Mine() takes no arguments"),
        (
            "class Mine:\n    def __init__(self, views): self.x = views[99]",
            "raised Index",
        ),
        ("class Mine:\n    def __init__(self, views): pass", "has no reset(); valid is what fits"),
        ("class Mine:\n    reset = len\n    def __init__(self, views): pass", "has no update(); valid is what fits"),
    ],
)
def test_what_breaks_before_the_first_view_is_its_own_failure(
    here: Path, views: list[View], text: str, told: str
) -> None:
    asked = Asked(here, text)
    check_plugin("mine:Mine")  # the name is good: nothing more can be told without running it
    found = asked.learn(views)
    assert found.kind == Kind.ERROR
    assert found.header["reason"].startswith(told)
    assert "\n" not in found.header["reason"]
    assert asked.ask(Kind.RESET).header == found.header  # it is no use any more


def test_global_generators_are_seeded(here: Path, views: list[View]) -> None:
    draw = "belief_from(np.random.rand(5))"
    drawn = []
    for _ in range(2):
        asked = Asked(here, GOOD.format(answer=draw))
        asked.learn(views)
        asked.ask(Kind.RESET)
        drawn.append(asked.belief(views[0]).places)
    assert drawn[0].tobytes() == drawn[1].tobytes()


def test_it_serves_over_the_standard_streams_and_what_the_user_prints_does_not_get_in_between(
    here: Path, views: list[View]
) -> None:
    written(
        here,
        "print('a word on import')\n" + GOOD.format(answer="print('and one each view') or belief_from(np.ones(5))"),
    )
    asked = [packed(Kind.HELLO, {"seed": 1})]
    asked += [view_message(Kind.LEARN, number, view, None) for number, view in enumerate(views)]
    asked += [packed(Kind.LEARNT, {}), packed(Kind.RESET, {}), view_message(Kind.LOCALISE, 0, views[1], None)]
    (here / "asked").write_bytes(b"".join(bytes(piece) for pieces in asked for piece in pieces))

    def guest() -> None:
        sys.path.append(str(here))
        for number, name, mode in ((0, "asked", os.O_RDONLY), (1, "told", os.O_WRONLY), (2, "printed", os.O_WRONLY)):
            os.dup2(os.open(here / name, mode | os.O_CREAT), number)
        serve("mine:Mine", 1)
        os.write(1, b"behind it\n")

    in_child(guest, here)
    data, answers = (here / "told").read_bytes(), []
    while data:
        header, payload = np.frombuffer(data, "<u4", 2).tolist()
        answers.append(parsed(data[8 : 8 + header], data[8 + header : 8 + header + payload]))
        data = data[8 + header + payload :]
    assert [one.kind for one in answers] == [Kind.HELLO, Kind.OK, Kind.OK, Kind.BELIEF]
    assert belief_of(answers[-1], len(views)).places == pytest.approx([0.2] * 5)
    assert (here / "printed").read_text().splitlines()[-1] == "behind it"
