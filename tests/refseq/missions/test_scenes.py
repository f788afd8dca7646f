"""Missions that seek a scene: the plan before and after, and a robot that goes to where the sightings lead."""

import pytest

from refseq.missions import Call, Errand, Executor, Landmarks, MissionError, Photograph, Status, compiled, parse_mission
from refseq.missions.executor import NEXT
from tests.refseq.missions.on_a_line import Line, right, way
from tests.refseq.scenes.drawn import scene

POSTER = Landmarks({"LA3": "end"}, {"LI1": scene()})
WAY = way(30.0)


def plan(text: str, landmarks: Landmarks = POSTER):
    return compiled(parse_mission(text), WAY, landmarks)


def test_a_scene_without_a_place_is_sought_to_the_end_of_the_way() -> None:
    made = plan("[LI1MT180_LA3]")
    assert made.goal == WAY.length
    assert made.sought is not None
    assert (made.sought.name, made.sought.after) == ("LI1", 0.0)
    assert "looks for    LI1MT180: box 220,140,200,180 of camera-1, cut from drawn.mcap at 12.5 m" in str(made)


def test_what_steps_behind_it_ask_for_is_told_before_it_is_found() -> None:
    errands = (Errand(None, (Photograph("poster"),)), Errand("MT:33", (Call("greet"),)))
    made = compiled(parse_mission("[LI1_LA3]"), WAY, POSTER, errands)
    assert set(made.all_tasks) == {Photograph("poster"), Call("greet")}
    assert set(made.all_behaviours) == {"MN", "MT:33"}
    assert made.takes_pictures
    assert not compiled(parse_mission("[LA3]"), WAY, POSTER, errands[1:]).takes_pictures


def test_found_it_is_a_landmark_like_others() -> None:
    made = plan("[LI1MT180]")
    assert made.sought is not None
    found = made.sought.found(WAY, 11.0)
    assert found.sought is None
    assert [(order.at, order.behaviour) for order in found.orders] == [(0.0, "MN"), (11.0, "MT:180")]


def test_it_lies_behind_the_landmark_before_it() -> None:
    made = plan("[LI9_LI1MT90]", Landmarks({}, {"LI1": scene()}))
    assert made.sought is not None
    assert made.sought.after == 9.0
    with pytest.raises(MissionError, match=r"valid is behind the landmark before it, at 9.0 m"):
        made.sought.found(WAY, 8.0)


def test_steps_before_it_do_not_leave_the_way() -> None:
    with pytest.raises(MissionError, match="LI9MT90 leaves the way"):
        plan("[LI9MT90_LI1]")


def sees(poster: float, error: float = 0.0, reach: float = 4.0):
    """Sightings from ``reach`` [m] before a scene to a little behind it, each wrong by so much of what is left."""

    def look(line: Line) -> None:
        left = poster - line.x
        if -0.5 < left < reach and round(line.x * 10) % 5 == 0:
            line.executor.sight(left * (1 + error))

    return look


@pytest.mark.parametrize("error", [0.0, 0.3, -0.3])
@pytest.mark.parametrize("grip", [1.0, 0.95])
def test_the_robot_turns_where_the_scene_was_cut(error: float, grip: float) -> None:
    line = Line(Executor(plan("[LI1MT180]")), right(WAY), grip=grip).run(each=sees(12.4, error))
    assert line.executor.status is Status.COMPLETED, line.executor.log
    (turn,) = [one for one in line.begun if one.words.startswith("MT")]
    assert turn.x == pytest.approx(12.4, abs=0.35)
    assert any("sees LI1" in str(entry) for entry in line.executor.log)


def test_it_goes_on_to_what_comes_behind() -> None:
    line = Line(Executor(plan("[LI1_LA3]")), right(WAY)).run(each=sees(12.4))
    assert line.executor.status is Status.COMPLETED
    assert line.x == pytest.approx(30.0, abs=0.4)
    assert [number for number, _ in line.executor.switches] == [0, 1]


def test_two_scenes_are_sought_one_after_the_other() -> None:
    both = Landmarks({}, {"LI1": scene(), "LI2": scene(2)})
    made = Executor(plan("[LI1_LI2MT90]", both))
    names: list[str] = []

    def look(line: Line) -> None:
        if made.sought is not None:
            names.append(made.sought.name)
            sees({"LI1": 8.0, "LI2": 20.0}[made.sought.name])(line)

    line = Line(made, right(WAY)).run(each=look)
    assert made.status is Status.COMPLETED, made.log
    assert line.x == pytest.approx(20.0, abs=0.4)
    assert list(dict.fromkeys(names)) == ["LI1", "LI2"]


def test_one_that_is_never_seen_fails_at_the_end_of_the_way() -> None:
    line = Line(Executor(plan("[LI1MT180]")), right(WAY)).run()
    assert line.executor.status is Status.FAILED
    assert line.executor.why == "LI1 was not seen on the way"
    assert line.x == pytest.approx(30.0, abs=0.4)


def test_one_that_is_seen_too_early_is_another() -> None:
    line = Line(Executor(plan("[LI9_LI1MT180]", Landmarks({}, {"LI1": scene()}))), right(WAY)).run(each=sees(5.0))
    assert line.executor.why == "LI1 was not seen on the way"


def test_sightings_while_it_stands_do_not_count() -> None:
    executor = Executor(plan("[LI1MT180]"))
    executor.sight(2.0)
    assert executor.plan.sought is not None


def test_what_cannot_be_done_behind_it_ends_the_mission() -> None:
    line = Line(Executor(plan("[LI1_LD]")), right(WAY)).run(each=sees(12.4))
    assert line.executor.status is Status.FAILED
    assert line.executor.why.startswith("LI1 is seen, at 1")
    assert "no door behind" in line.executor.why


def test_one_right_beside_the_robot_is_the_next_thing() -> None:
    executor = Executor(plan("[LI1MT180]"), localised=False)
    executor.move(1.0, 5.0)
    executor.sight(-5.0)
    assert executor.plan.orders[1].at == NEXT
