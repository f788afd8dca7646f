"""Views of strangers: made sense of, or refused in one line that names the view, the sensor and what is valid."""

import math
import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from refseq import (
    Localiser,
    LogError,
    Map,
    Pose,
    Recording,
    RecordingWriter,
    RefseqError,
    Scan,
    Stage,
    View,
    ViewError,
    add_drive,
    learn,
    localise,
    merge,
    read_recording,
)
from refseq.features.boundary import boundary_of
from refseq.intake import each_view, sound, usable

GREY = np.random.default_rng(7).integers(0, 256, (48, 64), np.uint8)


def seen(image: Any = GREY, ranges: Any = (1.0, 2.0, 3.0)) -> View:
    return View(1.5, {"front": image}, Scan(ranges), distance=0.5)


@pytest.mark.parametrize(
    ("colour", "order"),
    [
        (np.dstack([GREY, np.roll(GREY, 9), GREY[::-1]]), cv2.COLOR_RGB2GRAY),
        (np.dstack([GREY, np.roll(GREY, 9), GREY[::-1], GREY]), cv2.COLOR_RGBA2GRAY),
    ],
)
def test_colour_becomes_grey_by_the_eye_s_weights(colour: np.ndarray[Any, Any], order: int) -> None:
    grey = usable(seen(colour)).images["front"]
    assert np.array_equal(grey, cv2.cvtColor(colour, order))
    assert abs(grey.astype(float) - colour[..., :3] @ [0.299, 0.587, 0.114]).max() <= 1


def test_grey_of_one_channel_is_the_picture_itself() -> None:
    assert np.array_equal(usable(seen(GREY[:, :, None])).images["front"], GREY)
    assert usable(seen()).images["front"] is GREY


@pytest.mark.parametrize(
    ("image", "told"),
    [
        (GREY / 255, r"\(48, 64\) float64"),
        (GREY > 100, r"\(48, 64\) bool"),
        (GREY.astype(np.uint16), r"\(48, 64\) uint16"),
        (GREY[:0], r"\(0, 64\) uint8"),
        (GREY[0], r"\(64,\) uint8"),
        (np.dstack([GREY, GREY]), r"\(48, 64, 2\) uint8"),
        ("front.png", r"\(\) <U9"),
    ],
)
def test_what_is_no_picture_is_refused(image: Any, told: str) -> None:
    with pytest.raises(ViewError, match=rf"^view at 1\.5 s: front: an image of {told}; valid is .*uint8.*$"):
        usable(seen(image))


def test_ranges_are_a_row_of_numbers_from_lists_too() -> None:
    scan = usable(seen(ranges=[1, 2, 3])).scan
    assert scan is not None
    assert (scan.ranges.dtype, scan.ranges.tolist()) == (np.float32, [1, 2, 3])
    with pytest.raises(ViewError, match=r"^view at 1\.5 s: laser: ranges of \(2, 2\) float64; valid is \(n,\)"):
        usable(seen(ranges=np.ones((2, 2))))


def test_only_pictures_of_the_sensors_asked_for_are_looked_at() -> None:
    both = replace(seen(), images={"front": GREY, "broken": GREY / 255})
    assert set(usable(both, {"front"}).images) == {"front"}


def test_a_time_that_is_no_number_is_refused() -> None:
    with pytest.raises(ViewError, match="time is nan s; valid is a finite number"):
        usable(replace(seen(), time=float("nan")))


def walk(**changed: Any) -> list[View]:
    """Six views of one long picture past which the camera moves, with ``changed`` in each."""
    wall = cv2.resize(np.random.default_rng(3).integers(0, 256, (24, 200), np.uint8), (1600, 192))
    ranges = np.linspace(1, 4, 361, dtype=np.float32)
    views = [
        View(float(i), {"front": wall[:, 200 * i : 200 * i + 256].copy()}, Scan(ranges + i / 10), distance=0.8)
        for i in range(6)
    ]
    return [replace(view, **changed) for view in views]


@pytest.mark.parametrize("profile", ["thesis", "best"])
def test_a_map_is_learnt_from_a_generator_of_colour_views_as_from_a_list_of_grey_ones(profile: str) -> None:
    colour = (replace(view, images={"front": np.dstack([view.images["front"]] * 3)}) for view in walk())
    assert learn(colour, profile=profile).to_bytes() == learn(walk(), profile=profile).to_bytes()


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_a_map_needs_a_motion_that_is_a_number(value: float) -> None:
    views = walk()
    views[2] = replace(views[2], distance=value)
    with pytest.raises(ViewError, match=rf"^view 2 at 2 s: distance {value} m; valid is a finite number$"):
        learn(views)


@pytest.mark.parametrize("silent", [0.0, np.inf, np.nan, 90.0])
def test_a_laser_that_sees_nothing_is_not_learnt(silent: float) -> None:
    with pytest.raises(
        ViewError, match=r"^laser: no beam came back in any of 6 views; valid is to learn from the others$"
    ):
        learn(walk(scan=Scan(np.full(361, silent, np.float32))))


def test_a_camera_that_sees_nothing_is_silent_beside_another_one_and_no_map_by_itself() -> None:
    views = [replace(view, images={**view.images, "dark": np.zeros((192, 256), np.uint8)}) for view in walk()]
    assert learn(views).sensors == {"front", "dark", "laser"}
    with pytest.raises(ViewError, match=r"^dark: nothing is seen in any of 6 views$"):
        learn(views, sensors=["dark"])


def test_cameras_of_other_names_are_told_of_and_a_missing_one_is_no_error() -> None:
    localiser = Localiser(learn(walk()))
    first = walk()[0]
    with pytest.raises(ViewError, match=r"^view at 0 s: left, right: no camera of the map; valid are front$"):
        localiser.update(replace(first, images={"left": first.images["front"], "right": first.images["front"]}))
    localiser.update(first)
    localiser.update(replace(first, images={"left": first.images["front"]}, time=1.0))
    localiser.update(replace(first, images={}, time=2.0))


@pytest.mark.parametrize("shape", [(1, 1), (1, 640), (480, 1), (2, 70), (2_000_000, 1)])
@pytest.mark.parametrize("profile", ["thesis", "best"])
def test_the_smallest_and_the_slenderest_pictures_say_nothing(shape: tuple[int, int], profile: str) -> None:
    localiser = Localiser(learn(walk(), profile=profile))
    belief = localiser.update(replace(walk()[0], images={"front": np.full(shape, 9, np.uint8)}))
    assert belief.places.sum() == pytest.approx(1.0)


def test_a_map_is_told_in_one_line() -> None:
    assert repr(learn(walk(), name="wall")) == "<Map of 6 places: wall 4.0 m; front, laser>"


@pytest.mark.parametrize(
    ("view", "told"),
    [
        (None, "a view is a NoneType; valid is refseq.View"),
        (GREY, "a view is a ndarray; valid is refseq.View"),
        (replace(seen(), time="now"), "a view's time is 'now' s; valid is a finite number"),
        (replace(seen(), time=None), "a view's time is None s; valid is a finite number"),
        (
            replace(seen(), images=[GREY]),
            "view at 1.5 s: images are a list; valid are pictures by the names of their cameras, as a dict",
        ),
        (replace(seen(), images={"": GREY}), "view at 1.5 s: a camera's name is ''; valid is any text but 'laser'"),
        (replace(seen(), images={3: GREY}), "view at 1.5 s: a camera's name is 3; valid is any text but 'laser'"),
        (
            replace(seen(), images={"laser": GREY}),
            "view at 1.5 s: a camera's name is 'laser'; valid is any text but 'laser'",
        ),
        (replace(seen(), behaviour=3), "view at 1.5 s: behaviour is 3; valid is a text"),
        (
            replace(seen(), distance="0.5"),
            "view at 1.5 s: distance is '0.5'; valid is a number, or None: not measured",
        ),
        (replace(seen(), turn=1j), "view at 1.5 s: turn is 1j; valid is a number, or None: not measured"),
        (
            replace(seen(), scan=np.ones(3)),
            "view at 1.5 s: laser: a scan is a ndarray; valid is refseq.Scan, or None",
        ),
        (
            replace(seen(), scan=Scan(np.ones(3), start=None)),
            "view at 1.5 s: laser: start is None; valid is a number",
        ),
        (
            replace(seen(), scan=Scan(np.ones(3), step=np.nan)),
            "view at 1.5 s: laser: a scan starts at -1.5707963267948966 rad with steps of nan rad; "
            "valid are angles within two turns, and steps not of 0",
        ),
        (
            replace(seen(), scan=Scan(np.ones(361), step=0.5)),
            "view at 1.5 s: laser: a scan of 361 beams with steps of 0.5 rad is more than one turn; "
            "valid is one turn at most",
        ),
        (
            replace(seen(), scan=Scan(np.ones(100_001), step=1e-5)),
            "view at 1.5 s: laser: it has 100001 ranges in a scan; valid are at most 100000",
        ),
        *(
            (
                replace(seen(), scan=Scan(np.ones(3), max_range=reach)),
                f"view at 1.5 s: laser: max_range is {reach} m; valid is a finite number above 0",
            )
            for reach in (np.nan, np.inf, 0, -8.0)
        ),
        (
            seen(np.zeros((9000, 9000), np.uint8)),
            "view at 1.5 s: front: an image has 81000000 pixels in a picture; valid are at most 67108864",
        ),
    ],
)
def test_what_is_no_view_is_refused_by_name(view: Any, told: str) -> None:
    with pytest.raises(ViewError) as caught:
        usable(view)
    assert str(caught.value) == told


VALID = "valid are refseq.View, one after the other, as read_recording(file).views are"


@pytest.mark.parametrize(
    ("views", "told"),
    [
        ("drive.mcap", f"the views are a str; {VALID}"),
        (seen(), f"the views are a View; {VALID}"),
        ([seen(), GREY], f"view 1 is a ndarray; {VALID}"),
        (["drive.mcap"], f"view 0 is a str; {VALID}"),
    ],
)
def test_what_gives_no_views_is_refused_wherever_views_are_taken(views: Any, told: str) -> None:
    with pytest.raises(ViewError) as caught:
        list(each_view(views))
    assert str(caught.value) == told
    for taken in (learn, lambda given: localise(learnt(), given), lambda given: add_drive(learnt("best"), given)):
        with pytest.raises(ViewError, match=r"^(the views are|view [01] is) a "):
            taken(views)


def test_a_view_that_is_sound_is_left_as_it_is() -> None:
    view = walk()[0]
    assert sound(view) is view


@pytest.mark.parametrize("nothing", [0.0, -1.0, np.nan, 20.0, 21.5])
def test_a_beam_from_nowhere_is_infinite_as_in_a_log(nothing: float) -> None:
    """Drivers have words of their own for it: none may become a wall."""
    there = np.full(90, 4.0, np.float32)
    silent = np.arange(90) % 3 == 0
    told = Scan(np.where(silent, np.float32(nothing), there), max_range=20.0)
    meant = Scan(np.where(silent, np.inf, there).astype(np.float32), max_range=20.0)
    np.testing.assert_array_equal(told.returned, ~silent)
    assert boundary_of(told) == boundary_of(meant)
    (taken,) = each_view([View(1.0, scan=told)])
    assert taken.scan is not None
    np.testing.assert_array_equal(taken.scan.ranges, meant.ranges)


def test_a_scanner_that_turns_clockwise_is_turned_round() -> None:
    ranges = np.linspace(1, 4, 181, dtype=np.float32)
    one, other = Scan(ranges, -1.0, 0.01), Scan(ranges[::-1].copy(), 0.8, -0.01)
    turned = usable(replace(seen(), scan=other)).scan
    assert turned is not None
    np.testing.assert_allclose(turned.points, one.points, atol=1e-6)
    assert turned.step > 0


def test_one_beam_alone_needs_no_step_and_gets_one() -> None:
    beam = Scan(np.array([2.0], np.float32), 0.5, 0.0)
    assert usable(replace(seen(), scan=beam)).scan == replace(beam, step=1.0)


@pytest.mark.parametrize("name", ["distance", "turn"])
@pytest.mark.parametrize("value", [None, float("nan"), float("inf")])
def test_a_motion_that_is_no_number_was_not_measured(name: str, value: Any) -> None:
    view = usable(replace(seen(), **{name: value}))
    assert (view.distance, view.turn, view.has_odometry) == (0.0, 0.0, False)


@pytest.mark.quick_cases("None-best", "nan-thesis", "-inf-best")
@pytest.mark.parametrize("profile", ["thesis", "best"])
@pytest.mark.parametrize("value", [None, float("nan"), float("inf"), float("-inf")])
def test_beliefs_without_odometry_are_the_same_however_that_is_told(profile: str, value: Any) -> None:
    map_ = learn(walk(), profile=profile)
    told, plain = ([replace(v, **change) for v in walk()] for change in ({"distance": value}, {"has_odometry": False}))
    found, wanted = (localise(map_, views, stages=[Stage.CHAIN])[Stage.CHAIN] for views in (told, plain))
    for one, other in zip(found, wanted, strict=True):
        assert one.places.tobytes() == other.places.tobytes()
        assert one.lost == other.lost


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"distance": None}, "view 0 at 0 s: distance nan m; valid is a finite number"),
        ({"turn": float("inf")}, "view 0 at 0 s: turn inf rad; valid is a finite number"),
        ({"distance": 1e12}, "view 0 at 0 s: distance 1000000000000.0 m; valid are numbers from -1e+09 to 1e+09"),
        ({"truth": (0, 0, 0)}, "view 0 at 0 s: truth is a tuple; valid is refseq.Pose, or None"),
        ({"truth": Pose(0.0, float("nan"), 0.0)}, "view 0 at 0 s: true y nan m; valid is a finite number"),
    ],
)
def test_a_map_that_could_not_be_read_again_is_not_learnt(change: dict[str, Any], told: str) -> None:
    with pytest.raises(ViewError) as caught:
        learn(walk(**change))
    assert str(caught.value) == told


def test_a_recording_serves_wherever_views_do() -> None:
    recording = Recording(tuple(walk()))
    assert learn(recording).to_bytes() == learn(walk()).to_bytes()
    assert len(localise(learnt(), recording)[Stage.CHAIN]) == 6


def test_ranges_of_a_list_are_learnt_as_those_of_an_array() -> None:
    lists = [replace(v, scan=replace(v.scan, ranges=v.scan.ranges.tolist())) for v in walk() if v.scan is not None]
    assert learn(lists).to_bytes() == learn(walk()).to_bytes()


def test_one_name_serves_for_a_list_of_one() -> None:
    assert learn(walk(), sensors="front", features="sift").sensors == {"front"}
    one, all_ = (Localiser(learnt(), sensors=given).update(walk()[2]) for given in ("front", ["front"]))
    assert one.places.tobytes() == all_.places.tobytes()


@pytest.mark.parametrize("stage", Stage)
def test_a_stage_goes_by_its_name_too(stage: Stage) -> None:
    one, other = (Localiser(learnt(), stage=given).update(walk()[2]) for given in (stage, str(stage)))
    assert (one.places.tobytes(), one.lost) == (other.places.tobytes(), other.lost)


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda: Localiser("map.refseq"), "a map is a str; valid is refseq.Map, as learn or Map.load(file) gives it"),
        (lambda: merge(["a.refseq"]), "a map is a str; valid is refseq.Map, as learn or Map.load(file) gives it"),
        (lambda: add_drive(None, []), "a map is a NoneType; valid is refseq.Map, as learn or Map.load(file) gives it"),
        (lambda: Localiser(learnt(), stage="hmm"), "stage 'hmm' is unknown; valid are uniform, prior, chain"),
        (lambda: Localiser(learnt(), seed=-1), "seed -1 is not valid; valid is a whole number from 0"),
        (lambda: Localiser(learnt(), seed=None), "seed None is not valid; valid is a whole number from 0"),
        (
            lambda: learn(walk(), profile=None),
            "profile None is unknown; valid are thesis, counting, best, neural, or a Profile",
        ),
        (lambda: learn(walk(), name=3), "the path's name is 3; valid is a text of one line"),
        (
            lambda: learn(walk(), most_informative=1.5),
            "1.5 words are to be kept; valid is a whole number of at least 1",
        ),
    ],
)
def test_arguments_of_another_kind_are_refused_by_name(call: Callable[[], Any], told: str) -> None:
    with pytest.raises(RefseqError, match=f"^{re.escape(told)}$"):
        call()


def test_maps_are_merged_from_one_alone_and_from_a_generator() -> None:
    assert merge(learnt()).to_bytes() == merge(iter([learnt()])).to_bytes() == merge([learnt()]).to_bytes()


@pytest.mark.parametrize(
    ("view", "odometry", "error", "told"),
    [
        (seen(GREY / 255), Pose(0, 0, 0), ViewError, "view at 1.5 s: front: an image of (48, 64) float64; valid is"),
        (seen(), None, LogError, "the odometer's pose is a NoneType; valid is refseq.Pose"),
        (
            replace(seen(), time=-5.0),
            Pose(0, 0, 0),
            LogError,
            "a view is at -5 s; valid are seconds from 0 to 2147483648",
        ),
        (
            replace(seen(), time=1.7e18),
            Pose(0, 0, 0),
            LogError,
            "a view is at 1.7e+18 s; valid are seconds from 0 to 2147483648",
        ),
        (
            seen(),
            Pose(0, math.nan, 0),
            LogError,
            "view at 1.5 s: the odometer's pose is (0, nan, 0); valid are numbers from",
        ),
    ],
)
def test_a_log_is_not_written_of_what_it_cannot_hold(
    tmp_path: Path, view: View, odometry: Any, error: type[RefseqError], told: str
) -> None:
    with RecordingWriter(tmp_path / "drive.mcap", {}) as writer:
        writer.write(seen(), Pose(0.0, 0.0, 0.0))
        with pytest.raises(error, match=f"^{re.escape(told)}"):
            writer.write(view, odometry)
    assert len(read_recording(tmp_path / "drive.mcap").views) == 1


def test_a_log_of_what_is_told_in_no_text_is_not_begun(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"^metadata 'run' is 3; valid are texts, by names that are texts$"):
        RecordingWriter(tmp_path / "drive.mcap", {"run": 3})  # type: ignore[dict-item]
    assert list(tmp_path.iterdir()) == []


def test_a_scan_without_beams_is_none() -> None:
    """Drivers send one while they begin; what the cameras saw then is a view all the same."""
    empty = replace(seen(), scan=Scan(np.zeros(0, np.float32)))
    assert usable(empty).scan is None
    assert usable(empty).sensors == {"front"}


def test_colour_is_written_as_the_grey_that_the_localiser_sees(tmp_path: Path) -> None:
    colour = np.dstack([GREY, np.roll(GREY, 9), GREY[::-1]])
    with RecordingWriter(tmp_path / "drive.mcap", {}) as writer:
        writer.write(seen(colour, [1.0, 2.0, 3.0]), Pose(0.0, 0.0, 0.0))
    (view,) = read_recording(tmp_path / "drive.mcap").views
    assert np.array_equal(view.images["front"], usable(seen(colour)).images["front"])


@cache
def learnt(profile: str = "thesis") -> Map:
    return learn(walk(), profile=profile)
