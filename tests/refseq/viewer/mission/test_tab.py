"""The tab Mission: what the executor, the localiser and the log said is what the recording holds."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from refseq.belief import Belief
from refseq.missions import Errand, Executor, Photograph, Plan, Status, Wait, as_learnt, compiled, parse_mission
from refseq.missions.executor import Level
from refseq.planar import Pose
from refseq.view import Scan, View
from refseq.viewer.mission.record import MissionRecord, Recorder
from refseq.viewer.mission.tab import MissionTab, steps_text
from refseq.viewer.recording import write_recording
from refseq.viewer.timelines import TIME
from tests.refseq.missions.on_a_line import Line, Script, flat, lost, right, way
from tests.refseq.viewer.readback import empty_views, entities, rows, values, verified

pytestmark = pytest.mark.filterwarnings("error")  # Rerun only warns about data that it cannot take
WAY = way(30.0, told={0: "MN:10", 10: "MT:90", 11: "MN:20"})
TASKS = Errand(tasks=(Wait(2.0), Photograph("here")))


def a_plan() -> Plan:
    return compiled(parse_mission("[LI5_LI20]"), WAY, errands=(TASKS, Errand()))


class Told:
    """The localiser of a robot on a line: it says what the script says, and is asked by a view as a bench asks it."""

    def __init__(self, script: Script, pictures: bool) -> None:
        self.script, self.pictures, self.count, self.said = script, pictures, 0, list[Belief]()
        self.x = 0.0

    def reset(self) -> None:
        self.count = 0

    def update(self, view: View) -> Belief:
        self.said.append(self.script(self.count, self.x))
        self.count += 1
        return self.said[-1]


def run(
    plan: Plan, script: Script | None, *, pictures: bool = False, each: Callable[[Line], None] | None = None
) -> tuple[Executor, list[Belief], MissionRecord]:
    """A mission on a line, and its record."""
    recorder, executor = Recorder(), Executor(plan, localised=script is not None)
    told = Told(script or right(WAY), pictures)
    heard = recorder.heard(told)
    images = {"camera": np.full((8, 12), 90, np.uint8)} if pictures else {}
    scan = Scan(np.array([2.0, np.inf, 3.0], np.float32), start=0.0, step=np.pi / 4)

    def seen(_number: int, x: float) -> Belief:
        told.x = x
        return heard.update(View(7.0 + line.time, images, scan, 1.0))

    line = Line(executor, None if script is None else seen)

    def note(line: Line) -> None:
        recorder.note(executor, Pose(line.x, 0.5, 0.0))
        if each is not None:
            each(line)

    line.run(each=note)
    places = np.stack([WAY.along, np.zeros(len(WAY.along))], axis=1)
    return executor, told.said, recorder.record(plan, places, [np.array([(0.0, -1.0), (30.0, -1.0)])])


@pytest.fixture(scope="module")
def made() -> tuple[Executor, list[Belief], MissionRecord]:
    return run(a_plan(), right(WAY), pictures=True)


@pytest.fixture(scope="module")
def recording(made: tuple[Executor, list[Belief], MissionRecord], tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("mission") / "mission.rrd"
    write_recording(path, [MissionTab(made[2])], name="a line", timeline=TIME)
    return path


def test_every_panel_has_data_and_rerun_finds_nothing_wrong(
    made: tuple[Executor, list[Belief], MissionRecord], recording: Path
) -> None:
    assert made[0].status is Status.COMPLETED
    assert verified(recording)
    assert empty_views(MissionTab(made[2]).layout(), recording) == []
    assert all(entity.startswith(("/mission/", "/__")) for entity in entities(recording))


def test_the_log_is_the_mission_s(made: tuple[Executor, list[Belief], MissionRecord], recording: Path) -> None:
    executor, said, _ = made
    assert values(recording, "/mission/log", "TextLog:text", "time") == [[str(entry)] for entry in executor.log]
    times = [time.total_seconds() for time, _ in rows(recording, "/mission/log", "TextLog:text", "time")]
    np.testing.assert_allclose(times, [entry.time for entry in executor.log], atol=1e-6)
    views = [view for view, _ in rows(recording, "/mission/log", "TextLog:text", "view")]
    assert views == sorted(views)
    assert views[-1] == len(said) - 1


def test_p_of_being_lost_and_distance_to_the_goal_are_what_was_believed(
    made: tuple[Executor, list[Belief], MissionRecord], recording: Path
) -> None:
    executor, said, record = made
    found = rows(recording, "/mission/lost", "Scalars:scalars", "view")
    assert [view for view, _ in found] == list(range(len(said)))
    assert [value for _, (value,) in found] == [belief.lost for belief in said]
    to_go = {
        round(time.total_seconds(), 6): value
        for time, (value,) in rows(recording, "/mission/to_go", "Scalars:scalars", "time")
    }
    for instant in record.instants:
        assert to_go[round(instant.time, 6)] == pytest.approx(executor.plan.goal - instant.along, abs=0.5)
    assert to_go[max(to_go)] == executor.plan.goal - executor.along


def test_views_lie_on_all_three_lines(made: tuple[Executor, list[Belief], MissionRecord], recording: Path) -> None:
    _, said, record = made
    entity = "/mission/plan/likely"
    assert [view for view, _ in rows(recording, entity, "Points2D:positions", "view")] == list(range(len(said)))
    times = [time.total_seconds() for time, _ in rows(recording, entity, "Points2D:positions", "time")]
    assert times[0] == 0.0
    np.testing.assert_allclose(np.diff(times), np.diff([seen.view.time for seen in record.views]), atol=1e-6)
    gone = [distance for distance, _ in rows(recording, entity, "Points2D:positions", "distance_cm")]
    np.testing.assert_allclose(gone, [100 * seen.instant.travelled for seen in record.views], atol=0.5)
    assert len(values(recording, "/mission/camera/camera", "EncodedImage:blob", "view")) == len(said)


def test_lanes_tell_what_was_done_in_its_order(
    made: tuple[Executor, list[Belief], MissionRecord], recording: Path
) -> None:
    lane = {
        name: [state for (state,) in values(recording, f"/mission/doing/{name}", "StateChange:state", "time")]
        for name in ("status", "behaviour", "step", "task")
    }
    to_landmark = ["travelling", "approaching"]
    assert [state for state, before in zip(lane["status"], ["", *lane["status"]], strict=False) if state != before] == [
        *(*to_landmark, "at a task"),
        *(*to_landmark, "manoeuvring"),
        *(*to_landmark, "completed"),
    ]
    heads = [entry.what.partition(": ")[0] for entry in made[0].log]
    begun = [head for head in heads if head.startswith("M") and not head.endswith(" done")]
    ran = [word for word in lane["behaviour"] if word != "stands"]
    assert [word for word, before in zip(ran, ["", *ran], strict=False) if word != before] == begun
    assert "wait 2 s, photograph 'here'" in lane["task"]
    assert [int(step.partition(":")[0]) for step in lane["step"]] == sorted(
        int(s.partition(":")[0]) for s in lane["step"]
    )


def test_the_robot_is_drawn_where_it_was_and_where_it_believed_to_be(
    made: tuple[Executor, list[Belief], MissionRecord], recording: Path
) -> None:
    """North is up: what lies at y = 0.5 m is drawn at −0.5."""
    record = made[2]
    drawn = {
        name: dict(rows(recording, f"/mission/plan/{name}", "LineStrips2D:strips", "time"))
        for name in ("robot", "believed")
    }
    last = max(drawn["robot"])
    robot, ring = (np.array(drawn[name][last][0]) for name in ("robot", "believed"))
    end = record.instants[-1]
    assert end.truth is not None
    assert robot[:, 0].min() < end.truth.x < robot[:, 0].max()
    assert robot[:, 1].min() < -0.5 < robot[:, 1].max()
    np.testing.assert_allclose(ring[:-1].mean(axis=0), [np.interp(end.along, WAY.along, WAY.along), 0.0], atol=0.05)


def test_what_goes_wrong_is_told_by_its_level(tmp_path: Path) -> None:
    def script(number: int, x: float) -> Belief:
        return right(WAY)(number, x) if number < 5 else lost(len(WAY.along))

    executor, _, record = run(as_learnt(WAY), script)
    assert executor.status is Status.FAILED
    write_recording(tmp_path / "a.rrd", [MissionTab(record)], name="lost", timeline=TIME)
    levels = dict(
        zip(
            (entry.what for entry in executor.log),
            (level for (level,) in values(tmp_path / "a.rrd", "/mission/log", "TextLog:level", "time")),
            strict=True,
        )
    )
    assert [level for what, level in levels.items() if what.startswith("a view says lost")] == ["WARN"]
    assert [level for what, level in levels.items() if what.startswith("lost: ")] == ["WARN"]
    assert [level for what, level in levels.items() if what.startswith("failed: ")] == ["ERROR"]
    assert levels["the mission begins; 3 orders over 30.0 m"] == "INFO"
    assert {entry.level for entry in executor.log} == set(Level)


def test_an_abort_after_the_last_period_is_still_in_the_log(tmp_path: Path) -> None:
    def give_up(line: Line) -> None:
        if line.time > 4:
            line.executor.abort("not over in time")

    executor, _, record = run(as_learnt(WAY), right(WAY), each=give_up)
    assert [line.entry for line in record.log] == executor.log
    assert record.instants[-1].status is Status.ABORTED
    write_recording(tmp_path / "a.rrd", [MissionTab(record)], name="aborted", timeline=TIME)
    assert values(tmp_path / "a.rrd", "/mission/log", "TextLog:level", "time")[-1] == ["ERROR"]


def test_by_the_odometer_alone_there_is_no_line_of_views(tmp_path: Path) -> None:
    executor, _, record = run(as_learnt(WAY), None)
    assert executor.status is Status.COMPLETED
    path = tmp_path / "a.rrd"
    tab = MissionTab(record)
    write_recording(path, [tab], name="odometer", timeline=TIME)
    assert empty_views(tab.layout(), path) == []
    assert not any("lost" in entity or "camera" in entity for entity in entities(path))
    with pytest.raises(KeyError):
        rows(path, "/mission/log", "TextLog:text", "view")


def test_who_knows_nothing_of_the_world_is_shown_without_a_plan(tmp_path: Path) -> None:
    recorder, plan = Recorder(), as_learnt(WAY)
    executor = Executor(plan)
    Line(executor, lambda _n, _x: flat(len(WAY.along))).run(each=lambda line: recorder.note(line.executor, None))
    tab = MissionTab(recorder.record(plan, np.zeros((0, 2))))
    write_recording(tmp_path / "a.rrd", [tab], name="nowhere", timeline=TIME)
    assert empty_views(tab.layout(), tmp_path / "a.rrd") == []
    assert not any("plan" in entity for entity in entities(tmp_path / "a.rrd"))


def test_steps_are_marked_where_the_mission_is(made: tuple[Executor, list[Belief], MissionRecord]) -> None:
    record = made[2]
    task = next(instant for instant in record.instants if instant.status is Status.AT_TASK)
    lines = steps_text(record.plan, task).split("\n")
    assert lines[0] == "at a task: wait 2 s, photograph 'here'"
    (marked,) = [line for line in lines if "▶" in line]
    assert marked.split("|")[1].split() == ["▶", str(task.order + 1)]
    assert "▶" not in steps_text(record.plan, record.instants[-1])
