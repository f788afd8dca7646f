"""Views of a stream against those of a log of the same samples."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from refseq.errors import LogError
from refseq.logs.decoding.picture import CompressedPicture
from refseq.logs.pairing import stream as module
from refseq.logs.pairing.options import PairingOptions
from refseq.logs.pairing.plan import plan_views
from refseq.logs.pairing.stream import ClockSetBackError, StreamTopics, ViewStream, topics_for
from refseq.logs.source import Channel, Content, Role, Sample
from refseq.logs.transforms import Transform
from refseq.logs.unreadable import Unreadable
from refseq.planar import Pose, wrap
from refseq.view import Scan, View

SENSORS = {"/cam0/image_raw": "cam0", "/cam1/image_raw": "cam1", "/scan": "laser"}
TOPICS = StreamTopics(SENSORS, "/odom")
ROLES = {"/cam0/image_raw": Role.CAMERA, "/cam1/image_raw": Role.CAMERA, "/scan": Role.LASER, "/odom": Role.ODOMETRY}
RATES = {"/cam0/image_raw": 10.0, "/cam1/image_raw": 15.0, "/scan": 12.5, "/odom": 20.0}


@dataclass
class MadeSource:
    """Samples in memory as a log."""

    given: Sequence[Sample]
    path: Path = Path("made")
    kind: str = "made"
    metadata: dict[str, str] = field(default_factory=dict)
    complete: bool = True
    damage: str = ""
    skipped: dict[str, int] = field(default_factory=dict)
    unreadable: Mapping[str, Unreadable] = field(default_factory=dict)
    has_moments: bool = False

    @property
    def channels(self) -> tuple[Channel, ...]:
        return tuple(Channel(topic, "made", "none", 1, role) for topic, role in sorted(ROLES.items()))

    def samples(self, topics: Collection[str] | None = None) -> Iterator[Sample]:
        return (one for one in self.given if topics is None or one.topic in topics)


def picture(number: int) -> CompressedPicture:
    pixels = np.full((2, 2), number % 256, np.uint8)
    return CompressedPicture(cv2.imencode(".png", pixels)[1].tobytes(), "png")


def sample(topic: str, time: float, content: Content) -> Sample:
    return Sample(topic, time, time, "", content)


def drive(seed: int, seconds: float, jitter: float = 0.0, late: float = 0.0) -> list[Sample]:
    """An asynchronous robot on a curve; the messages of each topic come up to ``late`` seconds after their stamps."""
    rng = np.random.default_rng(seed)
    samples = []
    delays = {topic: rng.uniform(0, late) for topic in RATES}
    for topic, rate in RATES.items():
        # The leading camera begins and ends: elsewhere another would stand in for it, by rates that are not known yet.
        first, last = (0.0, seconds + 0.05) if "cam0" in topic else (rng.uniform(0.3, 0.9) / rate, seconds - 0.05)
        if topic == "/odom":  # within the tolerance: a view before that is kept of a log, but a stream leaves it out
            first, last = min(first, 0.04), seconds + 0.2
        times = np.arange(first, last, 1 / rate)
        times[1:-1] += rng.uniform(-jitter, jitter, len(times) - 2) / rate
        for number, time in enumerate(times.tolist()):
            content: Content = picture(number)
            if topic == "/scan":
                content = Scan(np.full(3, 1.0 + number, np.float32))
            elif topic == "/odom":
                content = Pose(time, np.sin(time / 3), np.cos(time / 3) / 3)
            samples.append(sample(topic, time, content))
    return sorted(samples, key=lambda one: one.time + delays[one.topic])


def with_damage(samples: Sequence[Sample], share: float, seed: int) -> list[Sample]:
    """The samples, a share of the pictures with a byte of their pixels changed."""
    rng = np.random.default_rng(seed)
    return [
        replace(one, content=damaged(one.content))
        if isinstance(one.content, CompressedPicture) and rng.random() < share
        else one
        for one in samples
    ]


def damaged(picture: CompressedPicture) -> CompressedPicture:
    data = bytearray(picture.data)
    data[picture.data.index(b"IDAT") + 6] ^= 0xFF
    return replace(picture, data=bytes(data))


def streamed(samples: Sequence[Sample], distance: float, **options: Any) -> list[View]:
    stream = ViewStream(TOPICS, distance, **options)
    views = [view for one in samples for view in stream.take(one)]
    return views + stream.end()


def shown(view: View) -> tuple[object, ...]:
    """All that a view holds, to be compared bit for bit."""
    scan = None if view.scan is None else view.scan.ranges.tolist()
    return view.time, view.distance, view.turn, {name: one.tolist() for name, one in view.images.items()}, scan


@settings(max_examples=12)
@given(
    st.integers(0, 10_000),
    st.sampled_from([0.0, 0.3]),
    st.sampled_from([0.0, 0.4]),
    st.sampled_from([0.0, 0.25]),
    st.sampled_from([0.0, 0.4]),
)
def test_a_stream_gives_the_views_of_a_log(
    seed: int, jitter: float, late: float, distance: float, damage: float
) -> None:
    samples = with_damage(drive(seed, 3.0, jitter, late), damage, seed)
    plan = plan_views(MadeSource(samples), PairingOptions(tolerance=0.04, leading="cam0"))
    logged = list((plan.thinned(distance) if distance else plan).read())
    views = streamed(samples, distance, leading="cam0", tolerance=0.04)
    assert [shown(view) for view in views] == [shown(view) for view in logged]
    assert len(logged) > 8


def test_steady_clocks_need_no_tolerance_told() -> None:
    """The rates of the first samples are those of all."""
    samples = drive(3, 4.0)
    logged = list(plan_views(MadeSource(samples)).read())
    assert [shown(view) for view in streamed(samples, 0.0)] == [shown(view) for view in logged]


def test_a_view_is_given_as_soon_as_all_sensors_are_past_it() -> None:
    samples = drive(1, 6.0, 0.1)
    stream = ViewStream(TOPICS, 0.0)
    delays = [one.time - view.time for one in samples for view in stream.take(one) if view.time > 1]
    assert max(delays) < 0.3
    assert np.median(delays) < 0.15
    assert len(delays) > 40


def test_a_camera_that_dies_is_waited_for_no_longer_than_a_second() -> None:
    samples = [one for one in drive(2, 8.0, 0.1) if one.time < 3 or "cam1" not in one.topic]
    stream = ViewStream(TOPICS, 0.0)
    given = [(one.time, view) for one in samples for view in stream.take(one)]
    assert max(now - view.time for now, view in given) < 1.2
    assert all("cam1" not in view.images for _, view in given if view.time > 3.1)
    assert len([view for _, view in given if view.time > 3.1]) > 30


def test_a_camera_that_dies_is_given_up_until_it_sends_again() -> None:
    samples = [one for one in drive(2, 12.0, 0.1) if not 3 < one.time < 8 or "cam1" not in one.topic]
    stream, silences = ViewStream(TOPICS, 0.0), {}
    given = []
    for one in samples:
        given += [(one.time, view) for view in stream.take(one)]
        silences |= {one.time: dict(stream.silent)}
    heard = [time for time, silent in silences.items() if silent]
    assert 4.9 < min(heard) < 5.3
    assert 7.9 < max(heard) < 8.1
    assert all(list(silent) == ["/cam1/image_raw"] for silent in silences.values() if silent)
    assert max(now - view.time for now, view in given if 5.3 < now < 8) < 0.3
    assert sum("cam1" in view.images for _, view in given if view.time > 8.2) > 30


def test_a_sensor_that_comes_just_within_the_patience_is_never_given_up() -> None:
    late = sorted(drive(2, 8.0), key=lambda one: one.time + 0.9 * ("cam1" in one.topic))
    stream = ViewStream(TOPICS, 0.0)
    views = [view for one in late for view in stream.take(one)]
    assert not stream.silent
    assert all("cam1" in view.images for view in views[3:])
    assert len(views) > 60


def test_a_clock_that_stands_still_is_told_and_a_stamp_sent_twice_is_not() -> None:
    stream = ViewStream(TOPICS, 0.0)
    for one in drive(5, 3.0):
        stream.take(one)
        stream.take(one)
    assert not stream.standing
    for _ in range(5):
        stream.take(sample("/scan", 9.0, Scan(np.ones(3, np.float32))))
    assert stream.standing == {"/scan": 9.0}


def test_a_moment_of_which_nothing_else_was_seen_than_a_damaged_picture_is_no_view() -> None:
    cameras = StreamTopics({"/cam0/image_raw": "cam0"}, "/odom")
    samples = [one for one in drive(4, 3.0) if one.topic in ("/cam0/image_raw", "/odom")]
    whole = ViewStream(cameras, 0.0)
    views = [view for one in samples for view in whole.take(one)] + whole.end()
    hurt = ViewStream(cameras, 0.0)
    found = [view for one in with_damage(samples, 0.4, 4) for view in hurt.take(one)] + hurt.end()
    assert 8 < len(found) < len(views) - 4
    assert list(hurt.damaged) == ["/cam0/image_raw"]
    assert {view.time for view in found} < {view.time for view in views}
    assert sum(view.distance for view in found) <= sum(view.distance for view in views)
    assert all(view.images for view in found)


def test_without_odometry_every_moment_is_a_view() -> None:
    samples = [one for one in drive(4, 3.0) if one.topic != "/odom"]
    stream = ViewStream(StreamTopics(SENSORS), 0.85)
    views = [view for one in samples for view in stream.take(one)] + stream.end()
    assert len(views) >= 29
    assert {view.distance for view in views} == {0.0}


def test_a_clock_that_goes_back_is_told() -> None:
    stream = ViewStream(TOPICS, 0.0)
    for one in drive(5, 3.0):
        stream.take(one)
    with pytest.raises(ClockSetBackError, match=r"topic /odom: the stamp went back from 3\.1\d+ to 0\.500 s"):
        stream.take(sample("/odom", 0.5, Pose(0, 0, 0)))


def test_what_comes_too_late_is_counted_and_changes_nothing() -> None:
    stream = ViewStream(TOPICS, 0.0)
    for one in drive(5, 3.0):
        stream.take(one)
    assert stream.take(sample("/scan", 2.2, Scan(np.ones(3, np.float32)))) == []
    assert stream.late == 1


def test_stamps_that_stand_still_fill_no_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST_WAITING", 50)
    stream = ViewStream(TOPICS, 0.0)
    for _ in range(50):
        stream.take(sample("/odom", 1.0, Pose(0, 0, 0)))
    with pytest.raises(LogError, match="51 samples of 0 MiB wait for their moment; valid are at most 50 of 256 MiB"):
        stream.take(sample("/odom", 1.0, Pose(0, 0, 0)))


def test_scans_that_wait_are_counted_by_their_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST_BYTES", 1 << 20)
    stream, ranges = ViewStream(TOPICS, 0.0), np.ones(1 << 16, np.float32)  # a quarter of it
    for number in range(4):
        stream.take(sample("/scan", 1.0 + number / 100, Scan(ranges, step=1e-5)))
    with pytest.raises(LogError, match="5 samples of 1 MiB wait for their moment"):
        stream.take(sample("/scan", 1.1, Scan(ranges, step=1e-5)))


def test_a_long_drive_keeps_a_window_only() -> None:
    stream = ViewStream(TOPICS, 0.0)
    held = []
    for one in drive(6, 30.0, 0.1):
        stream.take(one)
        held.append(sum(map(len, stream._window.samples.values())))
    assert max(held) < 150


def test_topics_are_named_as_in_a_log_or_as_told() -> None:
    roles = {**ROLES, "/imu": Role.IMU}
    found = topics_for(roles, {"cam0", "laser", "front"}, {"/cam1/image_raw": "front"})
    assert found == StreamTopics({"/cam0/image_raw": "cam0", "/cam1/image_raw": "front", "/scan": "laser"}, "/odom")
    with pytest.raises(LogError, match=r"no topic is a sensor of the map \(topics: /cam0/image_raw \(camera\), .*\)"):
        topics_for(roles, {"camera-1"}, {})
    with pytest.raises(LogError, match="topic /cam1/image_raw: is sensor 'cam0', as another topic is"):
        topics_for(roles, {"cam0"}, {"/cam1/image_raw": "cam0"})
    with pytest.raises(LogError, match="odometry topic '/wheels' is not told of; valid are /odom"):
        topics_for(roles, {"cam0"}, {}, "/wheels")


@pytest.mark.parametrize("time", [float("nan"), float("inf")])
def test_a_stamp_that_is_no_number_is_told(time: float) -> None:
    stream = ViewStream(TOPICS, 0.0)
    with pytest.raises(LogError, match=f"topic /scan: a stamp is {time} s; valid is a finite number"):
        stream.take(sample("/scan", time, Scan(np.ones(3, np.float32))))


def test_topics_that_are_not_taken_change_nothing() -> None:
    samples = drive(7, 3.0)
    others = [sample("/cam9/image_raw", one.time, picture(9)) for one in samples]
    mixed = [one for pair in zip(others, samples, strict=True) for one in pair]
    assert list(map(shown, streamed(mixed, 0.3))) == list(map(shown, streamed(samples, 0.3)))


def test_samples_of_a_topic_in_a_wrong_order_are_put_in_theirs() -> None:
    samples = drive(8, 4.0)
    odometry = [number for number, one in enumerate(samples) if one.topic == "/odom"]
    swapped = list(samples)
    for one, other in zip(odometry[1::2], odometry[2::2], strict=False):
        swapped[one], swapped[other] = samples[other], samples[one]
    assert swapped != samples
    assert list(map(shown, streamed(swapped, 0.0)))[5:] == list(map(shown, streamed(samples, 0.0)))[5:]


def test_a_camera_whose_pictures_are_broken_is_told_and_others_are_used() -> None:
    stream, views = ViewStream(TOPICS, 0.0), []
    for one in drive(9, 3.0):
        broken = replace(one, content=CompressedPicture(b"no picture", "png")) if "cam1" in one.topic else one
        views += stream.take(broken)
    assert stream.damaged == {"/cam1/image_raw": "an image cannot be decoded; valid are PNG, JPEG, WebP and BMP"}
    assert {camera for view in views for camera in view.images} == {"cam0"}
    assert len(views) > 20


UPSIDE_DOWN = Transform("base_link", "laser", (0.2, 0.0, 0.3), (1.0, 0.0, 0.0, 0.0), static=True)


def hanging_laser() -> list[Sample]:
    """A drive with a laser whose scans are all the same, and in a frame of its own."""
    scan = Scan(np.array([1.0, 2.0, 3.0], np.float32))
    return [replace(one, frame="laser", content=scan) if one.topic == "/scan" else one for one in drive(10, 3.0)]


def test_a_laser_is_turned_as_it_hangs() -> None:
    """On its head, as a transform that came before tells: its beams come from the other side."""
    for hung, ranges in (([], [1.0, 2.0, 3.0]), ([sample("/tf_static", 0.0, (UPSIDE_DOWN,))], [3.0, 2.0, 1.0])):
        views = streamed([*hung, *hanging_laser()], 0.0)
        seen = [view.scan.ranges.tolist() for view in views if view.scan is not None]
        assert len(seen) > 10
        assert all(one == ranges for one in seen)


def test_a_laser_hangs_on_the_next_drive_as_on_the_one_before() -> None:
    """A robot tells it once: of the next drive no message says so."""
    before, stream = ViewStream(TOPICS, 0.0), ViewStream(TOPICS, 0.0)
    before.take(sample("/tf_static", 0.0, (UPSIDE_DOWN,)))
    stream.mount_as(before)
    views = [view for one in hanging_laser() for view in stream.take(one)]
    seen = [view.scan.ranges.tolist() for view in views if view.scan is not None]
    assert len(seen) > 10
    assert all(one == [3.0, 2.0, 1.0] for one in seen)


def test_a_laser_is_turned_by_transforms_that_come_one_by_one() -> None:
    """The last of them joins two frames that both are known."""
    turned = Transform("mast", "laser", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), static=True)
    told = [Transform("odom", "base_link"), turned, Transform("base_link", "mast", static=True)]
    samples = [replace(one, frame="laser") if one.topic == "/scan" else one for one in drive(10, 3.0)]
    views = streamed([*(sample("/tf_static", 0.0, (one,)) for one in told), *samples], 0.0)
    starts = {view.scan.start for view in views if view.scan is not None}
    assert [abs(wrap(start - Scan(np.ones(3, np.float32)).start)) for start in starts] == [pytest.approx(np.pi)]
