import math

import numpy as np
import pytest

from refseq_bench.sim.drives.signal_faults import SignalFault, SignalFaultKind, with_signal_fault, with_signal_faults
from refseq_bench.sim.errors import SimError
from tests.refseq.health.drives import STEP, drive

VIEWS = drive(12)
AT, UNTIL = 3.9 * STEP, 6.9 * STEP
ILL = range(4, 7)


def faulty(kind, **options):
    return list(with_signal_fault(VIEWS, SignalFault(kind, AT, UNTIL, **options)))


@pytest.mark.parametrize("kind", SignalFaultKind)
def test_only_views_on_the_stretch_are_touched(kind):
    views = faulty(kind, camera="camera-1", other="camera-2")
    assert [k for k, (one, other) in enumerate(zip(views, VIEWS, strict=True)) if one is not other] == list(ILL)


@pytest.mark.parametrize("kind", [kind for kind in SignalFaultKind if kind.startswith("odometry")])
@pytest.mark.parametrize("odometry_first", [True, False])
def test_faults_begin_and_end_by_the_way_that_was_told_before_any(kind, odometry_first):
    faults = [SignalFault(kind, factor=0.5), SignalFault(SignalFaultKind.CAMERA_BLANK, AT, UNTIL, camera="camera-1")]
    views = list(with_signal_faults(VIEWS, faults if odometry_first else faults[::-1]))
    assert [k for k, view in enumerate(views) if view.images["camera-1"].max() < 5] == list(ILL)
    plain = list(with_signal_fault(VIEWS, faults[0]))
    assert [(view.distance, view.turn) for view in views] == [(view.distance, view.turn) for view in plain]


@pytest.mark.parametrize(("at", "until"), [(1000.0, math.inf), (4.1 * STEP, 4.9 * STEP)])
def test_a_fault_that_no_view_had_is_told(at, until):
    faults = [SignalFault(SignalFaultKind.ODOMETRY_LOST), SignalFault(SignalFaultKind.LASER_BLIND, at, until)]
    with pytest.raises(SimError, match=f"laser-blind: no view was taken from {at:g} to {until:g} m; valid is"):
        list(with_signal_faults(VIEWS, faults))


@pytest.mark.parametrize("kind", SignalFaultKind)
def test_the_sensors_that_a_fault_is_about_are_those_that_it_touches(kind):
    fault = SignalFault(kind, AT, UNTIL, camera="camera-1", other="camera-2")
    view, well = faulty(kind, camera="camera-1", other="camera-2")[5], VIEWS[5]
    touched = [camera for camera in view.images if view.images[camera] is not well.images[camera]]
    assert list(fault.sensors) == touched + (["laser"] if view.scan is not well.scan else [])


def test_a_black_camera_is_dark_and_the_other_is_not():
    for k in ILL:
        view = faulty(SignalFaultKind.CAMERA_BLANK, camera="camera-1")[k]
        assert view.images["camera-1"].max() < 5
        assert view.images["camera-2"] is VIEWS[k].images["camera-2"]


def test_frozen_sensors_repeat_the_last_view_before_the_fault():
    for k in ILL:
        camera = faulty(SignalFaultKind.CAMERA_FROZEN, camera="camera-2")[k]
        assert camera.images["camera-2"] is VIEWS[3].images["camera-2"]
        assert faulty(SignalFaultKind.LASER_FROZEN)[k].scan is VIEWS[3].scan


def test_exchanged_cameras_show_each_others_pictures():
    view = faulty(SignalFaultKind.CAMERAS_EXCHANGED, camera="camera-1", other="camera-2")[5]
    assert view.images["camera-1"] is VIEWS[5].images["camera-2"]
    assert view.images["camera-2"] is VIEWS[5].images["camera-1"]


@pytest.mark.parametrize(("bearing", "width"), [(-45.0, 60.5), (-45.0, 60.0), (0.0, 180.0), (10.0, 91.0), (0.0, 360.0)])
def test_blind_beams_are_those_of_the_arc(bearing, width):
    scan = faulty(SignalFaultKind.LASER_BLIND, bearing=bearing, width=width)[5].scan
    bearings = np.degrees(scan.bearings)
    inside = np.abs(bearings - bearing) <= width / 2 + 1e-6
    assert np.isinf(scan.ranges[inside]).all()
    np.testing.assert_array_equal(scan.ranges[~inside], VIEWS[5].scan.ranges[~inside])


def test_an_upside_down_laser_exchanges_left_and_right():
    np.testing.assert_array_equal(faulty(SignalFaultKind.LASER_MIRRORED)[5].scan.ranges, VIEWS[5].scan.ranges[::-1])


@pytest.mark.parametrize(
    ("kind", "factor"),
    [
        (SignalFaultKind.ODOMETRY_DOUBLED, 2),
        (SignalFaultKind.ODOMETRY_FROZEN, 0),
        (SignalFaultKind.ODOMETRY_REVERSED, -1),
    ],
)
def test_odometry_is_multiplied(kind, factor):
    for k in ILL:
        view = faulty(kind)[k]
        assert (view.distance, view.turn) == (factor * VIEWS[k].distance, factor * VIEWS[k].turn)


@pytest.mark.parametrize("factor", [0.8, 1.1])
def test_a_scaled_odometer_tells_a_share_of_its_way_and_turns(factor):
    view = faulty(SignalFaultKind.ODOMETRY_SCALED, factor=factor)[5]
    assert (view.distance, view.turn) == (factor * VIEWS[5].distance, factor * VIEWS[5].turn)


@pytest.mark.parametrize("factor", [0.0, -1.0, math.inf, math.nan])
def test_an_odometer_that_stands_or_runs_back_is_another_fault(factor):
    with pytest.raises(SimError, match=r"odometry-scaled: factor = .* is not valid; it should be above 0, and finite"):
        SignalFault(SignalFaultKind.ODOMETRY_SCALED, factor=factor)


def test_lost_odometry_says_so():
    assert not faulty(SignalFaultKind.ODOMETRY_LOST)[5].has_odometry


def test_stamps_jump():
    assert faulty(SignalFaultKind.CLOCK_JUMPING, seconds=7.0)[5].time == VIEWS[5].time + 7


def test_the_same_seed_makes_the_same_views():
    one, other = (faulty(SignalFaultKind.CAMERA_BLANK, camera="camera-1")[5] for _ in range(2))
    np.testing.assert_array_equal(one.images["camera-1"], other.images["camera-1"])


def test_each_fault_of_each_seed_draws_numbers_of_its_own():
    cameras = ("camera-1", "camera-2")
    both = [SignalFault(SignalFaultKind.CAMERA_BLANK, camera=camera) for camera in cameras]
    first = [next(iter(with_signal_faults(VIEWS, both, seed))) for seed in range(3)]
    noise = {view.images[camera].tobytes() for view in first for camera in cameras}
    shape = VIEWS[0].images["camera-1"].shape
    assert len(noise) == 6
    assert np.random.default_rng(1).integers(0, 4, shape, dtype=np.uint8).tobytes() not in noise, "a drive's numbers"


def test_what_cannot_be_is_refused():
    with pytest.raises(SimError, match="a fault of camera 'top': a view has none; valid are camera-1, camera-2"):
        faulty(SignalFaultKind.CAMERA_FROZEN, camera="top")
    with pytest.raises(
        SimError, match=r"^unknown signal fault 'laser-bogus': valid are camera-blank, .*, clock-jumping$"
    ):
        SignalFault("laser-bogus")
    for width in (-10.0, 0.0, 361.0, math.inf, math.nan):
        with pytest.raises(SimError, match=r"laser-blind: width = .* is not valid; it should be above 0, at most 360"):
            SignalFault(SignalFaultKind.LASER_BLIND, width=width)
    assert SignalFault("laser-blind").kind is SignalFaultKind.LASER_BLIND
    with pytest.raises(SimError, match="at = 5 m, until = 2 m; valid is 0 <= at < until"):
        SignalFault(SignalFaultKind.LASER_FROZEN, 5.0, 2.0)
