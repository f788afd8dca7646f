from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from refseq.belief import Belief, PoseBeside, Timings, belief_from
from refseq.view import Scan, View
from refseq_bench.scenarios.methods.guests.wire import (
    MOST_HEADER,
    GuestMessage,
    Incoming,
    Kind,
    WireError,
    belief_message,
    belief_of,
    packed,
    view_message,
    view_of,
)
from refseq_bench.scenarios.methods.plugin_answers import NoAnswerError, checked

STDOUT = " (words on standard output are taken for a message: they belong to standard error)"
FOUR_TIMES = "; valid is a list of 4 [s], for features, matching, mixture and chain"

numbers = st.floats(allow_nan=False, allow_infinity=False)
pictures = st.dictionaries(st.text(max_size=5), arrays(np.uint8, st.tuples(st.integers(1, 5), st.integers(1, 5))))
scans = st.builds(Scan, arrays(np.float32, st.integers(0, 9)), numbers, numbers, numbers)
views = st.builds(View, numbers, pictures, st.none() | scans, numbers, numbers, st.none(), st.text(), st.booleans())


def received(pieces: list[memoryview], most: int = 1 << 20, cut: int = 7) -> GuestMessage:
    """The message, which comes in small pieces."""
    data, incoming = b"".join(pieces), Incoming(most)
    while incoming.missing:
        taken = min(cut, incoming.missing)
        incoming.take(data[:taken])
        data = data[taken:]
    assert data == b""
    return incoming.message


@given(views)
def test_a_view_arrives_as_it_was_sent(view: View) -> None:
    found = view_of(received(view_message(Kind.LEARN, 3, view, None)))
    assert repr(replace(found, images={}, scan=None)) == repr(replace(view, images={}, scan=None))
    assert {name: image.tolist() for name, image in found.images.items()} == {
        name: image.tolist() for name, image in view.images.items()
    }
    assert (found.scan is None) == (view.scan is None)
    if view.scan is not None and found.scan is not None:
        assert found.scan.ranges.tobytes() == view.scan.ranges.tobytes()
        assert (found.scan.start, found.scan.step, found.scan.max_range) == (
            view.scan.start,
            view.scan.step,
            view.scan.max_range,
        )


def test_only_the_sensors_that_are_wanted_are_sent() -> None:
    view = View(0.0, {"left": np.ones((2, 3), np.uint8), "right": np.zeros((4, 5), np.uint8)}, Scan(np.ones(7, "<f4")))
    sizes = {("left",): 6, ("right",): 20, ("laser",): 28, ("left", "laser"): 34, (): 0, ("other",): 0, None: 54}
    for sensors, size in sizes.items():
        message = received(view_message(Kind.LOCALISE, 0, view, sensors))
        assert len(message.payload) == size
        assert view_of(message).sensors == {"left", "right", "laser"} & set(
            ("left", "right", "laser") if sensors is None else sensors
        )


def test_a_header_is_one_that_can_be_read_by_hand() -> None:
    """The page of the protocol promises it: the type first, no blanks, ASCII, the scan's ranges last."""
    view = View(0.5, {"vörn": np.zeros((1, 2), np.uint8)}, Scan(np.array([1.0, np.inf], "<f4"), -1.0, 0.5, 80.0))
    data = b"".join(view_message(Kind.LEARN, 0, view, None))
    header = (
        b'{"type":"learn","view":0,"time":0.5,"distance":0.0,"turn":0.0,"has_odometry":true,"behaviour":"",'
        b'"images":[{"name":"v\\u00f6rn","height":1,"width":2}],'
        b'"scan":{"beams":2,"start":-1.0,"step":0.5,"max_range":80.0}}'
    )
    assert data == (
        len(header).to_bytes(4, "little") + (10).to_bytes(4, "little") + header + bytes(2) + b"\0\0\x80?\0\0\x80\x7f"
    )


@given(arrays(np.float64, 5, elements=st.floats(1e-9, 1e9)), st.floats(0, 1), st.lists(st.integers(-1, 4), max_size=9))
def test_a_belief_arrives_bit_for_bit(weights: np.ndarray, lost: float, path: list[int]) -> None:
    told = belief_from(weights, lost, path=tuple(path), timings=Timings(1.5, 0.1, 1 / 3, 2e-9))
    true = replace(told, odometer_scale=1 / 1.3)
    found = belief_of(received(belief_message(true)), 5)
    assert found.places.tobytes() == true.places.tobytes()
    assert (found.lost, found.best, tuple(found.path)) == (true.lost, true.best, true.path)
    assert (found.entropy, found.timings, found.lost_after) == (true.entropy, true.timings, None)
    assert found.odometer_scale == checked(found, 5, 0.0).odometer_scale == 1 / 1.3


def test_where_it_got_lost_arrives_bit_for_bit() -> None:
    after = np.array([0.1, 1e-300, 1 / 3])
    found = belief_of(received(belief_message(belief_from([1, 2, 3], 0.7, lost_after=after)), most=48), 3)
    assert found.lost_after is not None
    assert found.lost_after.tobytes() == after.tobytes()
    assert (found.best, found.last_sure) == (2, 2)


def test_a_pose_beside_the_place_arrives_bit_for_bit() -> None:
    true = PoseBeside(0.3, -1e-300, 1 / 3, np.diag([0.04, 1 / 7, 1e-4]))
    found = belief_of(received(belief_message(replace(belief_from([1, 2, 3]), pose=true))), 3).pose
    assert found is not None
    assert found.motion == true.motion
    assert found.covariance.tobytes() == true.covariance.tobytes()


def test_what_is_no_pose_is_told() -> None:
    message = packed(Kind.BELIEF, {"places": "float32", "pose": [0.1, 0.2, 0.3]}, [np.ones(3, "<f4")])
    with pytest.raises(WireError, match=r"covariance of \(0,\); valid are"):
        belief_of(received(message), 3)


@pytest.mark.parametrize(
    ("key", "given", "told"),
    [
        ("lost", "0.2", "lost is '0.2'; valid is a number"),
        ("lost", True, "lost is True; valid is a number"),
        ("entropy", "3", "entropy is '3'; valid is a number"),
        ("entropy", None, "entropy is None; valid is a number"),
        ("odometer_scale", "1", "odometer_scale is '1'; valid is a number"),
        ("lost_after", "yes", "lost_after is 'yes'; valid are true and false"),
        ("lost_after", 1, "lost_after is 1; valid are true and false"),
        ("timings", {"matching": 0.1}, f"timings are {{'matching': 0.1}}{FOUR_TIMES}"),
        ("timings", [1, 1, 1], f"timings are [1, 1, 1]{FOUR_TIMES}"),
        ("timings", 3, f"timings are 3{FOUR_TIMES}"),
        ("timings", [0, 1e30, 0, 0], "timings is 1e+30; valid is 0 to 86400"),
        ("timings", [0, "1", 0, 0], "timings is '1'; valid is a number"),
        ("covariance", [0.0] * 9, "told a covariance without a pose; valid are both, or neither"),
        ("pose", ["0", "0", "0"], "pose ['0', '0', '0'] ± () is no numbers; valid are 3 and 9"),
        ("pose", [True, False, True], "pose [True, False, True] ± () is no numbers; valid are 3 and 9"),
        ("pose", [0, [0], 0], "pose [0, [0], 0] ± () is no numbers; valid are 3 and 9"),
    ],
)
def test_a_key_of_another_type_is_refused(key: str, given: object, told: str) -> None:
    message = received(packed(Kind.BELIEF, {"places": "float32", key: given}, [np.full(3, 1 / 3, "<f4")]))
    with pytest.raises((WireError, NoAnswerError)) as caught:
        checked(belief_of(message, 3), 3, 0.1)
    assert str(caught.value) == told


def test_what_a_belief_leaves_out_follows_from_its_places() -> None:
    given = np.array([0.25, 0.5, 0.25], "<f4")
    found = belief_of(received(packed(Kind.BELIEF, {"places": "float32"}, [given])), 3)
    true = belief_from(given)
    assert repr(found) == repr(Belief(given.astype(np.float64), 0.0, 1, (1,), true.entropy))


@pytest.mark.parametrize(
    ("data", "told"),
    [
        (b"\xff" * 8, "announced 4294967295 bytes of header and 4294967295 of payload; valid are up to 1048576 and 24"),
        (b"\1\0\0\0\x19\0\0\0", "announced 1 bytes of header and 25 of payload; valid are up to 1048576 and 24"),
        (b"\3\0\0\0\0\0\0\0abc", "sent b'abc' as a header; valid is a JSON object"),
        (b"\2\0\0\0\0\0\0\0[]", "sent b'[]' as a header; valid is a JSON object"),
        (b"\xa0\x0f\0\0\0\0\0\0" + b"[" * 4000, f"sent {b'[' * 40!r} as a header; valid is a JSON object"),
    ],
)
def test_what_is_no_message_is_told(data: bytes, told: str) -> None:
    with pytest.raises(WireError) as caught:
        received([memoryview(data)], most=24)
    assert str(caught.value).removesuffix(STDOUT) == told
    assert MOST_HEADER == 1048576


@pytest.mark.parametrize(
    ("header", "size", "told"),
    [
        (
            {"places": "float32"},
            8,
            "answered 8 bytes of float32; valid is 12, one number for each of 3 reference views",
        ),
        (
            {"places": "float64"},
            0,
            "answered 0 bytes of float64; valid is 24, one number for each of 3 reference views",
        ),
        (
            {"places": "float32", "lost_after": True},
            12,
            "answered 12 bytes of float32; valid is 24, two numbers, of places and lost_after, for each of 3 reference "
            "views",
        ),
        ({"places": "int8"}, 3, "places are 'int8'; valid are float32 and float64"),
        ({}, 12, "places are None; valid are float32 and float64"),
    ],
)
def test_places_of_another_length_are_refused(header: dict[str, object], size: int, told: str) -> None:
    with pytest.raises(WireError) as caught:
        belief_of(GuestMessage(header, bytes(size)), 3)
    assert str(caught.value) == told


@pytest.mark.parametrize("said", [b"Loading model...", b"epoch 1\nloss 2"])
def test_words_on_standard_output_are_no_message(said: bytes) -> None:
    """A header of so many letters would be beyond all memory."""
    with pytest.raises(WireError) as caught:
        Incoming(100).take(said[:8])
    assert str(caught.value) == (
        f"wrote {said[:8].decode()!r} to standard output; valid are messages only: what it says belongs to standard "
        "error"
    )
