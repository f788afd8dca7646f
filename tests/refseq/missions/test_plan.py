"""Missions compiled for hand-made ways: what is done where, and what cannot be."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq.map.paths.annotations import DoorSide, PathDoor
from refseq.missions.language import MissionError, parse_mission
from refseq.missions.path import MissionPath
from refseq.missions.plan import BEFORE_DOOR, Errand, Landmarks, Order, Plan, as_learnt, compiled
from refseq.missions.tasks import Photograph, Wait
from tests.refseq.missions.on_a_line import way

TOLD = {0: "MN:12", 12: "MT:-90", 13: "MW:left,0.8,18"}


def door(along: float, side: DoorSide = DoorSide.LEFT) -> PathDoor:
    return PathDoor(along, side, 0.9, True)


DOORS = (door(5.2), door(9.0, DoorSide.RIGHT), door(20.4, DoorSide.AHEAD))
WAY = way(30.0, told=TOLD, doors=DOORS)
PLACES = Landmarks({"LA3": "end", "LA0": "start", "LA1": 12.0, "LO2": 16.5, "LA9": 31.0, "LA8": "middle"})


def plan(text: str, of: MissionPath = WAY, errands: list[Errand] | None = None) -> Plan:
    return compiled(parse_mission(text), of, PLACES, errands)


def shown(plan: Plan) -> list[tuple[float, str]]:
    return [(order.at, order.behaviour) for order in plan.orders]


LEARNT = [(0.0, "MN:12"), (12.0, "MT:-90"), (12.0, "MW:left,0.8,18")]


# --- as it was learnt ---


def test_as_learnt_gives_back_what_was_recorded() -> None:
    learnt = as_learnt(WAY)
    assert shown(learnt) == LEARNT
    assert learnt.goal == 30.0
    assert not learnt.tasks
    assert [learnt.end_of(number) for number in range(3)] == [12.0, 12.0, 30.0]
    assert str(learnt).splitlines()[0].split() == ["0.0", "m", "MN:12", "as", "learnt"]
    assert str(learnt).splitlines()[-1].split()[:3] == ["30.0", "m", "stop"]


def test_where_nobody_told_it_goes_on() -> None:
    assert shown(as_learnt(way(5.0))) == [(0.0, "MN")]
    assert shown(as_learnt(way(5.0, told={2: "MT:90"}))) == [(0.0, "MN"), (2.0, "MT:90")]


def test_a_turn_at_the_end_is_done_and_a_way_that_leads_nowhere_is_not() -> None:
    assert shown(as_learnt(way(5.0, told={0: "MN:5", 5: "MT:180"}))) == [(0.0, "MN:5"), (5.0, "MT:180")]
    assert shown(as_learnt(way(5.0, told={0: "MN:5", 5: "MN:3"}))) == [(0.0, "MN:5")]


# --- steps ---


def test_past_the_first_door_to_the_end() -> None:
    got = plan("[LD_LA3]")
    assert shown(got) == [LEARNT[0], (5.2, "MN:12"), *LEARNT[1:]]
    assert got.goal == 30.0
    assert got.orders[1].why == "LD: door on the left, 5.2 m"


def test_past_the_first_door_and_through_the_second() -> None:
    got = plan("[LD_LDMC]")
    assert shown(got) == [(0.0, "MN:12"), (5.2, "MN:12"), (pytest.approx(9.0 - BEFORE_DOOR), "MC:right")]
    assert got.orders[-1].why == "LDMC: door on the right, 9.0 m"
    assert got.goal == got.orders[-1].at, "wherever crossing it leads, the mission is over"


def test_it_stops_at_a_landmark_where_nobody_says_what_to_do() -> None:
    got = plan("[LD]")
    assert (shown(got), got.goal) == ([(0.0, "MN:12")], 5.2)


def test_after_a_last_landmark_with_a_way_to_go_on_it_goes_to_the_end() -> None:
    got = plan("[LA0_LDMN]")
    assert shown(got)[-3:] == [(5.2, "MN:12"), *LEARNT[1:]]
    assert got.goal == 30.0


def test_images_are_places_by_their_number() -> None:
    assert plan("[LI7]").goal == 7.0
    assert plan("[LI13]").goal == 12.0
    with pytest.raises(MissionError, match=r"^mission \[LI32\], step 1: LI32 is not on the way; valid is LI0 to LI31$"):
        plan("[LI32]")


def test_another_behaviour_takes_the_place_of_the_learnt_one_from_there_on() -> None:
    got = plan("[LO2MA_LA3]")
    assert shown(got) == [*LEARNT, (16.5, "MA")]
    got = plan("[LI5MN_LA3]", errands=[Errand("MW:right,0.7"), Errand()])
    assert shown(got) == [LEARNT[0], (5.0, "MW:right,0.7"), *LEARNT[1:]]


def test_one_that_begins_where_another_was_learnt_takes_its_place() -> None:
    of = way(10.0, told={0: "MN:5", 5: "MN:5"})
    got = plan("[LI5MN_LA3]", of, [Errand("MW:right,0.7"), Errand()])
    assert shown(got) == [(0.0, "MN:5"), (5.0, "MW:right,0.7")]
    got = plan("[LA0MN_LA3]", of, [Errand("MW:right,0.7"), Errand()])
    assert shown(got) == [(0.0, "MW:right,0.7"), (5.0, "MN:5")]


def test_a_turn_comes_before_what_was_done_after_the_learnt_one() -> None:
    got = plan("[LA1MT270_LA3]")
    assert shown(got) == [LEARNT[0], (12.0, "MT:270"), LEARNT[2]]


def test_what_was_learnt_at_a_landmark_is_all_kept() -> None:
    of = way(20.0, told={0: "MN:8", 8: "MT:90", 9: "MC:ahead", 12: "MN:9"}, doors=(door(8.0),))
    got = plan("[LD_LA3]", of, [Errand(tasks=(Wait(3.0),)), Errand()])
    assert shown(got) == shown(as_learnt(of))
    assert [order.tasks for order in got.orders] == [(), (Wait(3.0),), (), ()]


def test_a_crossing_that_was_learnt_is_begun_where_it_was() -> None:
    of = way(20.0, told={0: "MN:8", 8: "MC:left", 11: "MN:9"}, doors=(door(9.5),))
    assert shown(plan("[LDMC_LA3]", of)) == [(0.0, "MN:8"), (8.0, "MC:left"), (11.0, "MN:9")]


def test_the_step_before_a_door_is_not_overtaken() -> None:
    """Crossing begins before the door, but not before what was asked for last."""
    of = way(20.0, doors=(door(9.6), door(10.5, DoorSide.RIGHT)))
    got = plan("[LD_LDMC]", of, [Errand(tasks=(Wait(2.0),)), Errand()])
    assert shown(got) == [(0.0, "MN"), (9.6, "MN"), (9.6, "MC:right")]
    assert got.orders[1].tasks == (Wait(2.0),)


def test_doors_across_from_each_other_are_two() -> None:
    of = way(20.0, doors=(door(9.0), door(9.0, DoorSide.RIGHT), door(15.0)))
    assert [order.why for order in plan("[LD_LD_LDMN]", of).orders[1:]] == [
        "LD: door on the left, 9.0 m",
        "LD: door on the right, 9.0 m",
        "LDMN: door on the left, 15.0 m",
    ]


def test_tasks_and_timeouts_are_kept() -> None:
    waits, takes = Errand(tasks=(Wait(3.0), Photograph("a"))), Errand(tasks=(Photograph("end"),), timeout=50.0)
    got = plan("[LD_LA3]", errands=[waits, takes])
    assert got.orders[1].tasks == waits.tasks
    assert got.tasks == takes.tasks
    got = plan("[LD_LDMC]", errands=[Errand(timeout=70.0), takes])
    assert got.orders[1].timeout == 70.0
    assert (got.orders[-1].tasks, got.orders[-1].timeout) == (takes.tasks, 50.0)
    assert not got.tasks
    start = plan("[LA0]", errands=[waits])
    assert (start.goal, start.tasks, start.orders[0].tasks) == (0.0, waits.tasks, ())


# --- one to one ---

mixed = st.lists(st.one_of(st.none(), st.integers(0, 30)), min_size=1, max_size=5)
"""Steps: at the next door, or at a place [m]."""


@given(st.lists(st.tuples(st.integers(0, 30), st.sampled_from(DoorSide)), max_size=6, unique=True), mixed)
def test_doors_are_matched_one_to_one_in_their_order(
    doors: list[tuple[int, DoorSide]], steps: list[int | None]
) -> None:
    """As the first of all choices of doors, tried one by one, in which all landmarks come behind each other."""
    of = way(30.0, doors=[door(float(at), side) for at, side in sorted(doors)])
    text = "_".join(f"LA{number}MN" if at is not None else "LDMN" for number, at in enumerate(steps))
    names = Landmarks({f"LA{number}": float(at) for number, at in enumerate(steps) if at is not None})
    wanted = by_trying(of.doors, steps)
    try:
        got = compiled(parse_mission(f"[{text}]"), of, names)
    except MissionError:
        assert wanted is None
        return
    assert wanted == [order.at for order in got.orders if order.why.startswith("L")]


def by_trying(doors: tuple[PathDoor, ...], steps: list[int | None]) -> list[float] | None:
    for choice in combinations(range(len(doors)), steps.count(None)):
        left, places, good, last = list(choice), [], True, (-1.0, False)
        for step in steps:
            at = float(step) if step is not None else doors[left.pop(0)].along
            both_doors = step is None and last[1]
            good = good and (at > last[0] or (both_doors and at == last[0]))
            places.append(at)
            last = at, step is None
        if good:
            return places
    return None


# --- what cannot be ---


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[LD_LD_LD_LD]", "step 4: no door behind 20.4 m; the way has 3 doors"),
        ("[LO2_LA1]", "step 2: LA1 is at 12.0 m; valid is behind the landmark before it, at 16.5 m"),
        ("[LA1_LA1]", "step 2: LA1 is at 12.0 m; valid is behind the landmark before it, at 12.0 m"),
        (
            "[LO7]",
            "step 1: nobody has said where LO7 is; landmarks with a place: LA3, LA0, LA1, LO2, LA9, LA8",
        ),
        ("[LA9]", "step 1: LA9 is at 31 m; valid is 0 to 30.0 m, the way's length"),
        ("[LA8]", "step 1: LA8 is at 'middle'; valid is metres along the way, 'start' or 'end'"),
        (
            "[LDMC_LA3]",
            "step 1: LDMC leaves the way, and behind that no landmark is known; valid is as the last step",
        ),
        (
            "[LO2MT90_LA3]",
            "step 1: LO2MT90 leaves the way, and behind that no landmark is known; valid is as the last step",
        ),
    ],
)
def test_what_cannot_be_is_told(text: str, told: str) -> None:
    with pytest.raises(MissionError) as caught:
        plan(text)
    assert str(caught.value) == f"mission {text}, {told}"


def test_the_length_that_is_told_to_be_valid_is() -> None:
    """Not rounded up: 26 m of 25.996 m were told to be behind 26.0 m."""
    of = way(25.996, spacing=25.996 / 30)
    with pytest.raises(MissionError, match=r"LA1 is at 26 m; valid is 0 to 25\.9 m, the way's length"):
        compiled(parse_mission("[LA1]"), of, Landmarks({"LA1": 26.0}))
    assert compiled(parse_mission("[LA1]"), of, Landmarks({"LA1": 25.9})).goal == 25.9


def test_a_recorded_turn_or_crossing_that_is_left_out_leaves_the_way() -> None:
    crossing = way(20.0, told={0: "MN:8", 8: "MC:left", 11: "MN:9"}, doors=(door(9.5),))
    for text, of in (("[LDMN_LA3]", crossing), ("[LA1MN_LA3]", WAY), ("[LA1MT90_LA3]", WAY), ("[LA1MT180_LA3]", WAY)):
        with pytest.raises(MissionError, match=r"step 1: .* leaves the way"):
            plan(text, of)
    assert shown(plan("[LDMN]", crossing))[:2] == [(0.0, "MN:8"), (9.5, "MN")], "as the last step it may"


def test_nothing_can_be_done_in_the_middle_of_a_turn() -> None:
    of = way(20.0, told={0: "MC:left", 15: "MN:9"})
    with pytest.raises(
        MissionError,
        match=r"^mission \[LI10_LI15\], step 1: LI10: at 10\.0 m: in the middle of MC:left nothing can be done",
    ):
        plan("[LI10_LI15]", of)


def test_orders_know_what_is_in_force() -> None:
    learnt = as_learnt(WAY)
    assert [learnt.order_at(at) for at in (-1.0, 0.0, 11.9, 12.0, 40.0)] == [0, 0, 0, 2, 2]
    assert [order.travels for order in learnt.orders] == [True, False, True]
    assert Plan(WAY, (Order(12.0, "MT:90", "x"),), 3.0).end_of(0) == 12.0


@pytest.mark.parametrize("words", ["MW:left", "MW", "MT", "MT:left"])
def test_words_of_a_log_that_lack_numbers_are_told(words: str) -> None:
    way = MissionPath(np.arange(5), np.arange(5) * 2.0, ("MN:8", words, "MN:8", "", ""), ())
    with pytest.raises(MissionError, match=rf"^behaviour '{words}', as it was learnt, lacks numbers; valid are "):
        as_learnt(way)


def test_words_that_begin_nowhere_are_told() -> None:
    way = MissionPath(np.arange(3), np.arange(3) * 2.0, ("MN:8", "go @home", ""), ())
    with pytest.raises(
        MissionError, match=r"^behaviour 'go @home', as it was learnt, begins nowhere; valid is MT:90@0"
    ):
        as_learnt(way)


@pytest.mark.parametrize("count", [1, 3])
def test_errands_are_one_a_step(count: int) -> None:
    with pytest.raises(MissionError) as caught:
        plan("[LD_LA3]", errands=[Errand()] * count)
    assert str(caught.value) == f"mission [LD_LA3]: {count} errands for 2 steps; valid is one a step"


@pytest.mark.parametrize("words", ["MW", "MT", "MT:left"])
def test_words_of_an_errand_that_lack_numbers_are_told(words: str) -> None:
    with pytest.raises(MissionError) as caught:
        plan("[LD_LA3]", errands=[Errand(), Errand(words)])
    valid = "valid are MW:left,0.5,4 and MT:90, say"
    assert str(caught.value) == f"mission [LD_LA3], step 2: behaviour {words!r} lacks numbers; {valid}"
