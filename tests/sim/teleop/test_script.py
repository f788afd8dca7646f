"""Scripts of controls: what is printed is read as it was, and what is wrong is told with line and column."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq_bench.robots import Twist
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.teleop.commands import AFTER, Button, Commands, SessionPhase, SessionStatus, valid_in
from refseq_bench.sim.teleop.script import AWAY, CommandLog, ScriptSource, TimedCommand, parse, printed

WRITTEN = """# to the door
2.0 forward   # at the usual speed

5.5 left 0.3
6 sample
8 forward 0.2 right pause
30 resume stop"""

times = st.lists(st.floats(0, 1e4), min_size=1, max_size=12).map(sorted)
speeds = st.just(0.0) | st.floats(1e-6, 10) | st.floats(-10, -1e-6)
motions = st.none() | st.just(AWAY) | st.builds(Twist, speeds, speeds)


@st.composite
def scripts(draw: st.DrawFn) -> tuple[TimedCommand, ...]:
    """Any script that is valid: buttons that do something when they come, an end, and nothing empty."""
    starts = draw(st.booleans())
    phase, moments = SessionPhase.READY if starts else SessionPhase.SAMPLING, []
    *whens, last = draw(times)
    for when in whens:
        buttons = []
        while draw(st.booleans()):
            valid = [b for b in valid_in(phase) if not AFTER[phase, b].over]
            buttons.append(draw(st.sampled_from(valid)))
            phase = AFTER[phase, buttons[-1]]
        motion = draw(motions)
        if motion is not None or buttons:
            moments.append(TimedCommand(when, motion, tuple(buttons)))
    ending = [Button.START] if starts and phase is SessionPhase.READY else []
    return (*moments, TimedCommand(last, draw(motions), (*ending, draw(st.sampled_from([Button.STOP, Button.ABORT])))))


@given(scripts())
def test_what_is_printed_is_read_as_it_was(script: tuple[TimedCommand, ...]) -> None:
    assert parse(printed(script)) == script


@given(st.text(alphabet="0123456789.-+ \n#forwadbckletighspmu", max_size=80))
def test_any_text_is_read_or_refused_in_one_line(text: str) -> None:
    try:
        parse(text, "keys.txt")
    except SimError as error:
        told = str(error)
    else:
        return
    assert told.startswith("keys.txt")
    assert "\n" not in told
    assert "valid" in told or "it is over" in told


def test_a_script_as_a_person_writes_it() -> None:
    assert parse(WRITTEN) == (
        TimedCommand(2.0, Twist(0.4, 0.0)),
        TimedCommand(5.5, Twist(0.0, 0.3)),
        TimedCommand(6.0, None, (Button.SAMPLE,)),
        TimedCommand(8.0, Twist(0.2, -0.4), (Button.PAUSE,)),
        TimedCommand(30.0, None, (Button.RESUME, Button.STOP)),
    )


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("2 forwad\n3 stop", "keys.txt, line 1, column 3: 'forwad' is not valid; valid are forward, back, left, right"),
        ("1 halt\n\n  x stop", "keys.txt, line 3, column 3: 'x' is not valid; valid is a time"),
        ("5 halt\n4 stop", "keys.txt, line 2, column 1: '4' is not valid; valid is a time [s] from 5"),
        ("-1 stop", "keys.txt, line 1, column 1: '-1' is not valid"),
        ("1_5 stop", "keys.txt, line 1, column 1: '1_5' is not valid; valid is a time [s] from 0"),
        (
            "2000000 stop",
            "keys.txt, line 1, column 1: '2000000' is not valid; valid is a time [s] from 0, that of the line before, "
            "to 1000000",
        ),
        ("nan stop", "keys.txt, line 1, column 1: 'nan' is not valid"),
        ("1 forward 0\n2 stop", "keys.txt, line 1, column 11: '0' is not valid; valid is a number above 0, up to 10"),
        ("1 forward nan\n2 stop", "keys.txt, line 1, column 11: 'nan' is not valid; valid are forward"),
        ("1 halt 3\n2 stop", "keys.txt, line 1, column 8: '3' is not valid; valid is a number after forward"),
        ("1 forward 1 2\n2 stop", "keys.txt, line 1, column 13: '2' is not valid; valid is a number after"),
        ("1 forward back\n2 stop", "keys.txt, line 1, column 11: 'back' is the second motion along its axis"),
        ("1 left halt\n2 stop", "keys.txt, line 1, column 8: 'halt' does not go with"),
        ("1 away left\n2 stop", "keys.txt, line 1, column 8: 'left' does not go with"),
        ("1 halt away\n2 stop", "keys.txt, line 1, column 8: 'away' does not go with"),
        ("1\n2 stop", "keys.txt, line 1, column 1: '1' is alone on its line"),
        ("1 resume\n2 stop", "keys.txt, line 1, column 3: 'resume' does nothing while sampling; valid are pause"),
        ("1 sample\n2 start\n3 stop", "keys.txt, line 1, column 3: 'sample' does nothing while ready"),
        ("1 pause\n2 sample\n3 stop", "keys.txt, line 2, column 3: 'sample' does nothing while paused"),
        ("1 stop\n2 halt", "keys.txt, line 2, column 1: '2' comes after the end"),
        ("1 stop pause", "keys.txt, line 1, column 8: 'pause' does nothing while stopped; it is over"),
        ("1 forward", "keys.txt: it does not end; valid is a last line such as '30 stop'"),
        ("", "keys.txt: it does not end"),
    ],
)
def test_what_is_wrong_is_told_with_its_place(text: str, told: str) -> None:
    with pytest.raises(SimError) as caught:
        parse(text, "keys.txt")
    assert str(caught.value).startswith(told)


def test_motions_hold_and_buttons_do_not() -> None:
    source = ScriptSource(parse("1 forward pause\n2 away\n3 left\n4 stop"))
    asked = [source.commands(SessionStatus(time=time)) for time in (0.0, 0.96, 1.0, 1.04, 2.0, 3.5, 4.0)]
    assert asked == [
        Commands(Twist(), (Button.START,)),
        Commands(Twist()),
        Commands(Twist(0.4, 0.0), (Button.PAUSE,)),
        Commands(Twist(0.4, 0.0)),
        Commands(None),
        Commands(Twist(0.0, 0.4)),
        Commands(Twist(0.0, 0.4), (Button.STOP,)),
    ]


def test_what_is_noted_of_a_hand_asks_for_the_same() -> None:
    """Buttons that did nothing are not noted: in a script they would be mistakes."""
    asked = {
        0.0: Commands(buttons=(Button.SAMPLE,)),
        0.04: Commands(Twist(0.3, 0.1), (Button.START,)),
        0.08: Commands(Twist(0.3, 0.1)),
        0.12: Commands(None, (Button.PAUSE, Button.PAUSE)),
        0.16: Commands(Twist(), (Button.STOP,)),
    }

    class Person:
        def commands(self, status: SessionStatus) -> Commands:
            return asked[status.time]

    noting = CommandLog(Person())
    phases = (SessionPhase.READY, SessionPhase.READY, SessionPhase.SAMPLING, SessionPhase.SAMPLING, SessionPhase.PAUSED)
    for time, phase in zip(asked, phases, strict=True):
        assert noting.commands(SessionStatus(time=time, phase=phase)) == asked[time]
    assert parse(printed(noting.script)) == tuple(noting.script)
    again = ScriptSource(noting.script)
    kept = [again.commands(SessionStatus(time=time)) for time in asked]
    assert [one.twist for one in kept] == [one.twist for one in asked.values()]
    assert [one.buttons for one in kept] == [(), (Button.START,), (), (Button.PAUSE,), (Button.STOP,)]


def test_a_moment_comes_at_the_first_period_that_is_not_before_it() -> None:
    source = ScriptSource((TimedCommand(0.05, Twist(0.1, 0.0)), TimedCommand(9.0, None, (Button.STOP,))))
    moving = [time for time in (0.0, 0.04, 0.08) if source.commands(SessionStatus(time=time)).twist != Twist()]
    assert moving == [pytest.approx(0.08)]
