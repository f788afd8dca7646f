import string

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from refseq_bench.robots import Blocked, Cause, RobotsError
from refseq_bench.robots.robuter.protocol import (
    END,
    MAX_LINE,
    MAX_SPEED,
    NO_ECHO,
    Bumper,
    LineReader,
    Message,
    Motion,
    ProtocolError,
    ProtocolWord,
    Provision,
    Refusal,
    Report,
    Servo,
    bounded,
    format_line,
    legible,
    parse_line,
)

ASCII = [chr(code) for code in range(128) if chr(code).isprintable()]
numbers = st.integers(-(10**15 - 1), 10**15 - 1)
speeds = st.integers(-MAX_SPEED, MAX_SPEED)
texts = st.text(ASCII, min_size=1, max_size=200)
motions = st.builds(Motion, speeds, speeds)
provisions = st.builds(Provision, st.sampled_from(Cause), numbers, st.sampled_from(Blocked), texts)
reports = st.builds(
    Report,
    time=numbers,
    counters=st.tuples(numbers, numbers),
    speeds=st.tuples(numbers, numbers),
    servo=st.sampled_from(Servo),
    bumpers=st.sampled_from([(), (Bumper.FRONT,), (Bumper.REAR,), (Bumper.FRONT, Bumper.REAR)]),
    provisions=st.integers(0, len(Cause)),
    sonars=st.lists(st.integers(0, NO_ECHO), max_size=32).map(tuple),
)
messages = st.one_of(st.sampled_from(ProtocolWord), motions, st.builds(Refusal, texts), provisions, reports)

# Words of the protocol in any order come nearer to its lines than any bytes do.
WORDS = ["AM", "SERV", "ON", "OFF", "ST", "ack", "nak", "em", "st", "-", "0", "-0", "00", "7", "-12", "9999", "10000"]
WORDS += ["1e3", "٣", "front", "rear", "front,rear", "rear,front", "1,2", ",", "bumper", "emergency-stop", "all", ""]
nearly = st.lists(st.sampled_from(WORDS), max_size=11).map(lambda words: " ".join(words).encode("utf-8"))


@given(messages)
def test_a_message_comes_back_from_its_line(message: Message) -> None:
    line = format_line(message)
    assert line.count(END) == 1
    assert line.endswith(END)
    assert len(line) <= MAX_LINE + 1
    assert parse_line(line.removesuffix(END)) == message


@given(st.one_of(st.binary(max_size=600), nearly))
@example(b"AM 100 100 ")
@example(b"AM 100\xa0100")
@example("AM ٣ ٣".encode())
@example(b"AM -0 0")
@example(b"st 0 0 0 0 0 ON - 0 -")
def test_a_line_is_its_message_written_out_or_is_refused_in_one_line(line: bytes) -> None:
    try:
        message = parse_line(line)
    except ProtocolError as refused:
        error: RobotsError = refused
    else:
        assert format_line(message) == line + END
        return
    assert str(error)
    assert "\n" not in str(error)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (b"AM 500 500", Motion(500, 500)),  # mva
        (b"AM 200 300", Motion(200, 300)),  # mvb
        (b"AM -200 -200", Motion(-200, -200)),  # mvr
        (b"AM 0 0", Motion(0, 0)),  # stp
        (b"SERV OFF", ProtocolWord.SERVO_OFF),
        (b"SERV ON", ProtocolWord.SERVO_ON),
        (b"ST", ProtocolWord.STATE),
        (b"ack", ProtocolWord.ACK),
        (b"nak why not", Refusal("why not")),
        (b"em bumper 1500 forward front", Provision(Cause.BUMPER, 1500, Blocked.FORWARD, "front")),
        (
            b"st 1500 8024 -8024 94 -94 OFF front,rear 1 250,65535",
            Report(1500, (8024, -8024), (94, -94), Servo.OFF, (Bumper.FRONT, Bumper.REAR), 1, (250, NO_ECHO)),
        ),
    ],
)
def test_lines_of_the_table_and_their_answers(line: bytes, message: Message) -> None:
    assert parse_line(line) == message


@pytest.mark.parametrize(
    ("line", "why"),
    [
        (b"", "unknown line '': valid are SERV ON, SERV OFF, ST, ack, AM, nak, em, st"),
        (b"am 0 0", "unknown line 'am 0 0': valid are SERV ON, SERV OFF, ST, ack, AM, nak, em, st"),
        (b"SERV", "unknown line 'SERV': valid are SERV ON, SERV OFF, ST, ack, AM, nak, em, st"),
        (b"AM", "AM takes 2 values, not 0"),
        (b"AM 5", "AM takes 2 values, not 1"),
        (b"AM 5 5 5", "'5 5' is no whole number of up to 15 digits"),
        (b"AM  5 5", "'' is no whole number"),
        (b"AM 0.5 0", "'0.5' is no whole number of up to 15 digits"),
        (b"AM nan 0", "'nan' is no whole number of up to 15 digits"),
        (b"AM 10000 0", "wheel speed 10000 mm/s: valid is -9999 to 9999"),
        (b"ack \xb1", "a line is printable ASCII text"),
        (b"AM 1\r 1", "a line is printable ASCII text"),
        (b"em hunger 0 all x", "unknown cause 'hunger': valid are emergency-stop, no-command, no-answer, bumper,"),
        (b"em sonar 0 up x", "unknown direction 'up': valid are all, forward, backward"),
        (b"em sonar 0 all ", "a text is 1 to 200 printable ASCII characters"),
        (b"st 0 0 0 0 0 ON rear,front 0 -", "bumpers: valid are front and rear, in this order, once each"),
        (b"st 0 0 0 0 0 ON - 10 -", "10 provisions: valid is 0 to 9"),
        (b"st 0 0 0 0 0 ON - 0 65536", "sonar 65536 mm: valid is 0 to 65535"),
        (b"A" * 513, "line of more than 512 bytes"),
    ],
)
def test_what_is_refused_and_how(line: bytes, why: str) -> None:
    with pytest.raises(ProtocolError) as error:
        parse_line(line)
    assert why in str(error.value)


@given(st.lists(st.text(string.ascii_letters + " ", max_size=40)), st.lists(st.integers(1, 50), min_size=1))
def test_lines_are_the_same_however_the_stream_is_cut(texts: list[str], cuts: list[int]) -> None:
    stream = b"".join(text.encode() + (b"\r\n" if index % 2 else b"\n") for index, text in enumerate(texts))
    reader, read, cut = LineReader(), [], 0
    while stream:
        size = cuts[cut % len(cuts)]
        read += reader.feed(stream[:size])
        stream, cut = stream[size:], cut + 1
    assert [line.decode() for line in read] == texts


@given(st.integers(0, 5000), st.integers(1, 700))
def test_a_line_without_an_end_takes_no_more_room_than_one_that_is_too_long(length: int, size: int) -> None:
    reader = LineReader()
    for start in range(0, length, size):
        assert reader.feed(b"x" * min(size, length - start)) == []
        assert len(reader._held) <= MAX_LINE + 2
    (line,) = reader.feed(b"\n")
    assert len(line) == min(length, MAX_LINE + 1)
    assert reader.feed(b"ST\n") == [b"ST"], "the next one is whole again"


def test_the_beginning_of_a_line_can_be_forgotten() -> None:
    reader = LineReader()
    reader.feed(b"AM 500 5")
    reader.forget()
    assert reader.feed(b"ST\n") == [b"ST"]


def test_signs_are_spelt_so_that_any_program_can_read_them() -> None:
    assert legible("pitch −50°, 29 N·m → 漢") == "pitch -50 deg, 29 N m ? ?"


@given(st.text(min_size=1))
def test_any_text_can_be_made_legible(text: str) -> None:
    Refusal(legible(text))
    assert legible(legible(text)) == legible(text)


@given(st.floats())
def test_any_value_can_be_told(value: float) -> None:
    told = bounded(value)
    assert parse_line(f"em sonar {told} all x".encode()) == Provision(Cause.SONAR, told, Blocked.ALL, "x")
    if abs(value) < 1e15:
        assert abs(told - value) <= 0.5
