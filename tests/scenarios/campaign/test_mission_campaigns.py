"""Missions as scenarios: what a file may not say, and a campaign of missions from the file to the page, laser only."""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from junitparser import JUnitXml

from refseq.belief import Belief, belief_from
from refseq.map.map import Map
from refseq.view import View
from refseq_bench.scenarios.campaign.campaign import Watcher, run_campaign
from refseq_bench.scenarios.campaign.declare.case import Case
from refseq_bench.scenarios.campaign.declare.cases import load
from refseq_bench.scenarios.campaign.declare.outcomes import TaskOutcome, Verdict
from refseq_bench.scenarios.campaign.declare.overrides import with_methods
from refseq_bench.scenarios.campaign.declare.schema import ScoreTable
from refseq_bench.scenarios.campaign.judge.drives import Judged
from refseq_bench.scenarios.campaign.judge.missions import JudgedMissions
from refseq_bench.scenarios.campaign.pages.summary import summary
from refseq_bench.scenarios.campaign.pages.text_report import report_markdown
from refseq_bench.scenarios.campaign.results import Results
from refseq_bench.scenarios.campaign.run import mission_task, remote_payload
from refseq_bench.scenarios.campaign.run.case_tasks import tasks_of
from refseq_bench.scenarios.campaign.run.estimate import rest_of
from refseq_bench.scenarios.campaign.run.learning import LEARNING
from refseq_bench.scenarios.campaign.run.mission_task import MissionTask, mission_of
from refseq_bench.scenarios.campaign.run.remote_payload import remote_task_for
from refseq_bench.scenarios.campaign.run.tasks import RecordTask, Task
from refseq_bench.scenarios.campaign.store.cache import MAP, DamagedError, Store
from refseq_bench.scenarios.campaign.store.missions import read_mission
from refseq_bench.scenarios.campaign.store.result_file import CampaignRecord, read_result
from refseq_bench.scenarios.drives.drive import QUERY_SEEDS, Drive
from refseq_bench.scenarios.drives.record import open_bench
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.library import LIBRARY
from refseq_bench.scenarios.missions import leader
from refseq_bench.scenarios.missions.runs import turn_of
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.faults import Kidnap
from refseq_bench.sim.drives.view_spacing import MISSION_EVERY
from refseq_bench.sim.envs.tasks.mission_goal import WITHIN
from refseq_bench.sim.rendering.renderer import DEFAULT_RENDERER, RendererKind
from tests.scenarios.campaign.chores import AtOnce

HEAD = 'title = "T"\nseeds = [1]\n'
DRIVES = '[reference]\nworld = "offices"\nrenderer = "none"\nbehaviours = ["MN:13"]\n[query]\nlight = "18:00"\n'
NEARER = DRIVES.replace('["MN:13"]', '["MN:10"]\nwaypoints = [[4.5, 0.0], [28.0, 0.0]]')
"""From 2 m before the first door to past the second: what is run takes three quarters of the time."""
MISSION = '[mission]\nstring = "[LD_LDMC]"\ngoal = [12.2, 2.4]\n'
METHODS = '[localise]\nmethods = ["odometry", "best/chain"]\n'
LAMP = '[mission]\nlamp = "p.lamp"\n[localise]\nmethods = ["lamp"]\n'


def loaded(folder: Path, text: str) -> list[Case]:
    (folder / "p.lamp").write_text("1. MOVE LV 20 DIL 100\n")
    (folder / "bad.lamp").write_text("1. FLY\n")
    (folder / "mine.toml").write_text(text)
    return load(folder / "mine.toml")


BAD = {
    "nothing to do": (HEAD + DRIVES + "[mission]\n", "mission: what odometry is to do is missing; valid is one of"),
    "two things": (
        HEAD + DRIVES + MISSION + "learnt = true\n",
        "mission: string and learnt exclude each other; valid is one of string, learnt, to",
    ),
    "unknown key": (
        HEAD + DRIVES + MISSION + 'sting = "x"\n',
        "mission.sting: is not known here; valid are string, learnt, to, lamp, landmarks, goal",
    ),
    "text for a flag": (HEAD + DRIVES + '[mission]\nlearnt = "yes"\n', "mission.learnt = 'yes' is not valid"),
    "string": (
        HEAD + DRIVES + '[mission]\nstring = "[LDMX]"\n',
        "mission.string: mission '[LDMX]', column 4: 'MX]'; valid is a behaviour: MA, MT, MO, MW, MC, MN",
    ),
    "file of a mission": (
        HEAD + DRIVES + '[mission]\nstring = "none.toml"\n',
        "none.toml: cannot be read: No such file or directory; valid is a mission in TOML",
    ),
    "landmark's name": (
        HEAD + DRIVES + MISSION + "[mission.landmarks]\nLX = 3.0\n",
        "mission.landmarks: mission '[LX]', column 2",
    ),
    "landmark's place": (
        HEAD + DRIVES + MISSION + '[mission.landmarks]\nLA1 = "middle"\n',
        "mission.landmarks.LA1",
    ),
    "landmark nobody knows": (
        HEAD + DRIVES + '[mission]\nstring = "[LA3]"\n',
        "mission.landmarks: nobody has said where LA3 is; landmarks with a place: none",
    ),
    "landmarks without a string": (
        HEAD + DRIVES + '[mission]\nlearnt = true\nlandmarks = { LA3 = "end" }\n',
        "mission.landmarks: go with a string; valid is mission.string beside them",
    ),
    "no goal behind a door": (
        HEAD + DRIVES + '[mission]\nstring = "[LD_LDMC]"\n',
        "mission.goal: is missing; what LDMC leads to was never learnt, valid is [x, y] in metres",
    ),
    "goal in space": (HEAD + DRIVES + "[mission]\nlearnt = true\ngoal = [1.0]\n", "mission.goal"),
    "behaviour": (HEAD + DRIVES.replace("MN:13", "MQ:13") + MISSION, "reference: unknown behaviour 'MQ': valid are"),
    "behaviour's value": (
        HEAD + DRIVES.replace("MN:13", "MN:far") + MISSION,
        "reference: behaviour 'MN:far': length 'far': valid is a number from 0.01 to 1000 m",
    ),
    "behaviours of the query": (
        HEAD + DRIVES + 'behaviours = ["MN:1"]\n' + MISSION,
        "query.behaviours: what the robot does is the mission's to say; valid is none",
    ),
    "no place": (HEAD + DRIVES + '[mission]\nto = "forward"\n', "mission.to = 'forward' is not valid; it should be"),
    "no such path": (
        HEAD + DRIVES + '[mission]\nto = "north:end"\n',
        "mission.to = 'north:end': path 'north' is unknown; valid are forward",
    ),
    "several references": (
        HEAD + DRIVES + MISSION + '[[further]]\nroute = "reverse"\n',
        "further: goes with mission.to, a route over all references; valid is one reference",
    ),
    "a log": (
        HEAD + '[reference]\nlog = "x.log"\n[query]\nworld = "offices"\n' + MISSION,
        "reference: is a recording; valid in a mission is a drive to simulate: world",
    ),
    "program that is not there": (HEAD + DRIVES + LAMP.replace("p.l", "q.l"), "mission.lamp: "),
    "program": (
        HEAD + DRIVES + LAMP.replace("p.l", "bad.l"),
        "LAMP program, line 1, column 4: 'FLY' is no verb; valid are MOVP, MOVE, CROSS",
    ),
    "robot without sonars": (
        HEAD + DRIVES + 'robot = "segway_rmp"\n' + LAMP,
        "mission.lamp: robot 'segway_rmp' has no sonars; valid is one such as 'robuter'",
    ),
    "lamp without a program": (
        HEAD + DRIVES + MISSION + '[localise]\nmethods = ["lamp"]\n',
        "localise.methods: 'lamp' has no program here; valid is to name one: mission.lamp",
    ),
    "method": (
        HEAD + DRIVES + MISSION + '[localise]\nmethods = ["bets/chain"]\n',
        "localise: method 'bets/chain' is unknown; valid are thesis/uniform",
    ),
    "hindsight": (
        HEAD + DRIVES + MISSION + '[localise]\nmethods = ["best/hindsight"]\n',
        "localise.methods: 'best/hindsight' knows a place when the drive is over; valid are others",
    ),
    "key of localising": (
        HEAD + DRIVES + MISSION + '[localise]\nplaces = "0:5"\n',
        "localise.places: is not known here; valid are judged, methods, sensors, merge",
    ),
    "figure of localising": (
        'expect = ["success >= 80 %"]\n' + HEAD + DRIVES + MISSION,
        "'success >= 80 %': figure 'success' is unknown; valid are completed, completed_narrow, goal_distance",
    ),
    "stage": ('expect = ["completed_hmm >= 80 %"]\n' + HEAD + DRIVES + MISSION, "figure 'completed_hmm' is unknown"),
    "unit": (
        'expect = ["time <= 3 m"]\n' + HEAD + DRIVES + MISSION,
        "'time <= 3 m': time is not told in m; valid is s",
    ),
}


@pytest.mark.parametrize("mistake", BAD)
def test_what_is_wrong_is_told_in_one_line_before_anything_is_driven(mistake: str, tmp_path: Path) -> None:
    text, told = BAD[mistake]
    with pytest.raises(ScenarioError) as error:
        loaded(tmp_path, text)
    assert "mine.toml: " in str(error.value)
    assert told in str(error.value)
    assert "\n" not in str(error.value)


def test_a_figure_of_missions_means_nothing_where_nobody_is_on_one(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="figure 'completed' is unknown; valid are success"):
        loaded(tmp_path, 'expect = ["completed >= 80 %"]\n' + HEAD + DRIVES)


def test_the_query_is_where_and_when_and_takes_over_no_behaviours(tmp_path: Path) -> None:
    (case,) = loaded(tmp_path, HEAD + DRIVES + "start = 3.0\n" + MISSION + METHODS)
    (tasks,) = tasks_of(case).values()
    assert [task.methods for task in tasks] == [("odometry",), ("best/chain",)]
    blind, seeing = tasks
    assert isinstance(blind, MissionTask)
    assert (blind.drive.behaviours, blind.drive.seed, blind.drive.start) == ((), 1 + QUERY_SEEDS, 3.0)
    assert [need.drive.behaviours for need in blind.needs] == [("MN:13",)], "the query is not recorded"
    assert blind.needs[0].key == seeing.needs[0].key
    assert len({task.key for task in tasks}) == 2


@pytest.mark.parametrize(("said", "distance"), [("", MISSION_EVERY), ("trigger = { distance = 0.7 }\n", 0.7)])
def test_views_on_the_way_are_not_as_far_apart_as_places(said: str, distance: float, tmp_path: Path) -> None:
    (case,) = loaded(tmp_path, HEAD + DRIVES + said + MISSION + METHODS)
    reference, query = case.sources(1)
    assert isinstance(reference, Drive)
    assert isinstance(query, Drive)
    assert (reference.trigger.distance, query.trigger.distance) == (0.85, distance)


def test_environments_call_a_switch_right_as_missions_do() -> None:
    assert ScoreTable().within == WITHIN


def test_who_looks_at_nothing_needs_no_images(tmp_path: Path) -> None:
    (case,) = loaded(tmp_path, HEAD + DRIVES.replace('renderer = "none"\n', "") + MISSION + METHODS)
    (tasks,) = tasks_of(case).values()
    renderers = [task.drive.renderer for task in tasks if task.drive is not None]
    assert renderers == [RendererKind.NONE, DEFAULT_RENDERER]


@pytest.mark.parametrize(
    "changed",
    ["goal = [12.2, 2.3]", 'string = "[LD_LDMN]"', "landmarks = { LA3 = 2.0 }"],
)
def test_another_mission_has_another_key(changed: str, tmp_path: Path) -> None:
    key = changed.partition(" ")[0]
    lines = [line for line in MISSION.splitlines() if not line.startswith(f"{key} ")]
    (one,), (other,) = (
        loaded(tmp_path, HEAD + DRIVES + mission + METHODS) for mission in (MISSION, "\n".join([*lines, changed, ""]))
    )
    keys = [{task.key for task in tasks_of(case)[1]} for case in (one, other)]
    assert not keys[0] & keys[1]


def test_others_may_be_asked_to_lead(tmp_path: Path) -> None:
    cases = loaded(tmp_path, HEAD + DRIVES + MISSION + METHODS)
    (asked,) = with_methods(cases, ["vlad"], ["odometry"])
    assert (asked.scenario.methods, asked.scenario.judged) == (("odometry", "vlad"), "vlad")
    with pytest.raises(ScenarioError, match="method 'vald' is unknown"):
        with_methods(cases, ["vald"], None)
    with pytest.raises(ScenarioError, match="'lamp' has no program here"):
        with_methods(cases, [], ["lamp"])


def test_a_program_on_another_machine_needs_no_file_but_a_world_does(tmp_path: Path) -> None:
    (tmp_path / "small.toml").write_text((LIBRARY / "offices-closed.toml").read_text())
    (case,) = loaded(tmp_path, HEAD + DRIVES + 'world = "small.toml"\n' + LAMP)
    ((task,),) = tasks_of(case).values()
    order = remote_task_for(task, Store(tmp_path / "store"))
    assert [piece.path.name for piece in order.pieces if piece.where == "file"] == ["small.toml"]
    task.__dict__["network"] = "of the sender"
    there = task.with_files({str(tmp_path.resolve() / "small.toml"): "elsewhere.toml"})
    assert there.drive is not None
    assert (there.drive.world, there.key, there.sources) == ("elsewhere.toml", task.key, task.sources)
    assert there.network == task.network


def test_turns_that_an_ideal_robot_makes_too() -> None:
    turns = {"MT:-90": 90, "MC:left": 90, "MC:ahead": 0, "MC": 0, "MN:3": 0, "MA:2,1,45": 45, "MA:3,0": 0, "MN": 0}
    assert {words: round(math.degrees(turn_of(words))) for words in turns} == turns


# --- a campaign, laser only ---

CAMPAIGN = (
    HEAD
    + 'expect = ["completed >= 95 %", "goal_distance <= 0.5 m", "wrong_switches <= 0", "collisions <= 0", '
    + '"time of odometry <= 5 s"]\n'
    + NEARER
    + MISSION
    + METHODS
    + '[[vary.list]]\nname = "open"\n[[vary.list]]\nname = "closed"\n"query.world" = "offices-closed.toml"\n'
    + 'expect = ["completed <= 0", "collisions <= 0", "wrong_switches <= 0"]\n'
    + '[[vary.list]]\nname = "no-door"\n"mission.string" = "[LD_LD_LD_LD_LD_LDMC]"\n'
)


@dataclass(frozen=True)
class Ran:
    """A campaign that was run."""

    cases: list[Case]
    store: Store
    out: Path
    judged: dict[str, JudgedMissions]
    record: CampaignRecord


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory) -> Ran:
    folder = tmp_path_factory.mktemp("missions")
    (folder / "offices-closed.toml").write_text((LIBRARY / "offices-closed.toml").read_text())
    cases = loaded(folder, CAMPAIGN)
    store = Store(folder / "store")
    found = campaign(cases, store, folder / "out")
    missions = {name: one for name, one in found.items() if isinstance(one, JudgedMissions)}
    return Ran(cases, store, folder / "out", missions, read_result(folder / "out"))


class Counted(Watcher):
    """Notes what was done and not kept."""

    def __init__(self) -> None:
        self.done: list[Task] = []

    def ended(self, task: Task, outcome: TaskOutcome) -> None:
        if not outcome.kept:
            self.done.append(task)


def campaign(cases: list[Case], store: Store, out: Path, watcher: Watcher | None = None) -> dict[str, Judged]:
    results = Results(out, cases, store)
    judged = run_campaign(cases, AtOnce(store), store, watcher or Watcher(), conclude=results.add)
    return {one.case.name: one for one in judged}


def test_the_second_door_is_crossed_and_expectations_decide(ran: Ran) -> None:
    case = ran.judged["mine/open"]
    assert case.verdict is Verdict.FAILED, "nobody is there in 5 s"
    assert [one.met for one in case.judgements] == [True, True, True, True, False]
    for method in ("odometry", "best/chain"):
        run, score = case.kept[method][1].run, case.score(method, 1)
        assert run.completed
        assert score.goal_distance < 0.5
        assert run.touched == ()
        assert run.track[-1, 2] > 1.2 + 0.5, "it is behind the wall"
        assert run.ideal < run.time < 3 * run.ideal
        assert np.diff(run.track[:, 0]) == pytest.approx(0.04)
    assert case.kept["odometry"][1].run.views == 0
    assert case.kept["best/chain"][1].run.views > 10


def test_a_closed_door_is_refused_and_that_is_no_error_of_the_bench(ran: Ran) -> None:
    case = ran.judged["mine/closed"]
    assert case.verdict is Verdict.PASSED
    for method in ("odometry", "best/chain"):
        run = case.kept[method][1].run
        assert not run.completed
        assert run.why.startswith("failed: MC:left failed: ")
        assert run.touched == ()
        assert run.track[:, 2].max() < 1.2, "it stayed before the wall"


def test_a_mission_that_what_was_learnt_has_no_place_for_is_its_own_failure(ran: Ran) -> None:
    case = ran.judged["mine/no-door"]
    assert (case.verdict, case.mishaps) == (Verdict.FAILED, ())
    run = case.kept["best/chain"][1].run
    assert run.refused
    assert run.why.startswith("refused: mission [LD_LD_LD_LD_LD_LDMC], step ")
    assert "no door behind" in run.why
    assert len(run.track) == 1


def test_a_campaign_that_goes_on_runs_nothing_again(ran: Ran, tmp_path: Path) -> None:
    watcher = Counted()
    again = campaign(ran.cases, ran.store, tmp_path / "again", watcher)
    assert watcher.done == []
    assert {name: one.verdict for name, one in again.items()} == {n: one.verdict for n, one in ran.judged.items()}
    rest = rest_of(ran.cases, ran.store)
    assert (rest.recordings_kept, rest.recordings, rest.answers_kept, rest.answers) == (1, 1, 6, 6)
    assert rest.seconds == 0


@pytest.mark.slow
def test_the_same_mission_goes_the_same_way_again(ran: Ran, tmp_path: Path) -> None:
    task = ran.judged["mine/open"].led["best/chain"][1]
    store = Store(tmp_path)
    for need in task.needs:
        assert isinstance(need, RecordTask)
        store.path(need.key, need.ending).write_bytes(ran.store.path(need.key, need.ending).read_bytes())
    task.carry_out(store)
    first, again = mission_of(task, ran.store), mission_of(task, store)
    assert first.digest == again.digest
    assert np.array_equal(first.run.track, again.run.track)
    assert first.run.log == again.run.log


def test_what_is_kept_comes_back_as_it_was_and_damage_is_told(ran: Ran, tmp_path: Path) -> None:
    task = ran.judged["mine/open"].led["odometry"][1]
    path = ran.store.path(task.key, task.ending)
    run = read_mission(path).run
    assert [order.behaviour for order in run.orders] == ["MN:10", "MN:10", "MC:left"]
    assert all(len(order.where) for order in run.orders)
    assert run.log[-1].what == "the mission is completed"
    store = Store(tmp_path)
    store.path(task.key, task.ending).write_bytes(b"PAR1 nothing PAR1")
    with pytest.raises(DamagedError, match="is no mission"):
        mission_of(task, store)


def test_learning_costs_what_it_took_whoever_learnt_the_map_and_however_long_the_bench_opens(
    ran: Ran, monkeypatch: pytest.MonkeyPatch
) -> None:
    task = ran.judged["mine/no-door"].led["best/chain"][1]  # refused before it is driven: the cost is told all the same
    (kept,) = [Map.load(path) for key in task.maps if (path := ran.store.path(key, MAP)).exists()]

    def slow(drive: Drive) -> Bench:
        time.sleep(0.5)
        return open_bench(drive)

    monkeypatch.setattr(mission_task, "open_bench", slow)
    ran.store.discard(task.key)
    task.carry_out(ran.store)
    for led in (task, *(ran.judged["mine/open"].led[method][1] for method in ("odometry", "best/chain"))):
        assert mission_of(led, ran.store).cost.learn_s == float(kept.metadata[LEARNING])


class Guest:
    """A user's localiser that knows nothing, and whose process was seen to hold 7 TiB."""

    peak_bytes = 7 << 40
    open = 0

    def __init__(self, name: str, views: Sequence[View]) -> None:
        del name
        self._places = len(views)
        Guest.open += 1

    def reset(self) -> None:
        pass

    def update(self, view: View) -> Belief:
        del view
        return belief_from(np.ones(self._places), 0.5)

    def bytes_elsewhere(self) -> int:
        return 5 << 40

    def close(self) -> None:
        Guest.open -= 1


def test_a_user_s_localiser_costs_its_own_process_too_which_ends_with_the_mission(
    ran: Ran, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(leader, "PluginLocaliser", Guest)
    task = replace(ran.judged["mine/open"].led["best/chain"][1], methods=("mine:Mine",))
    task.__dict__["key"] = "guest"  # there is no code of it that a digest could be made of
    task.carry_out(ran.store)
    cost = mission_of(task, ran.store).cost
    assert 7 << 40 < cost.peak_bytes < 8 << 40
    assert 5 << 40 < cost.bytes_kept < 6 << 40
    assert Guest.open == 0


def test_the_result_file_tells_how_many_of_how_many(ran: Ran) -> None:
    case = next(one for one in ran.record.cases if one.name == "mine/open")
    assert case.schema_type == "mission"
    method = case.method("best/chain")
    assert method is not None
    assert (method.success.right, method.success.of) == (1, 1)
    assert method.figures["wrong_switches"] == "0 of 3"
    assert set(case.seeds[1].answers) == {"odometry", "best/chain"}
    led = ran.judged["mine/open"].led
    assert case.seeds[1].query == led["best/chain"][1].sources[-1] != led["odometry"][1].sources[-1]
    table = summary(ran.record, "completed")
    assert table.cases == ("mine/open", "mine/closed", "mine/no-door")
    assert dict(table.rows)["best/chain"] == ("1 of 1", "0 of 1", "0 of 1")
    assert "| best/chain |" in report_markdown(ran.record, figures=True)
    assert "BARN" in report_markdown(ran.record, figures=True)


def test_ci_servers_are_told(ran: Ran) -> None:
    tests = [test for suite in JUnitXml.fromfile(str(ran.out / "junit.xml")) for test in suite]
    missed = [test.name for test in tests if test.result and test.classname == "mine.open"]
    assert missed == ["time of odometry <= 5 s"]


def test_the_page_shows_one_that_was_completed_and_all_that_were_not(ran: Ran) -> None:
    page = (ran.out / "mine-open" / "report.html").read_text()
    assert "completed in" in page
    assert page.count('<figure class="plot">') == 1
    assert "LDMC: door on the left" in page
    assert "the mission is completed" in page
    failed = (ran.out / "mine-closed" / "report.html").read_text()
    assert failed.count('<figure class="plot">') == 2
    assert "failed: MC:left failed" in failed
    assert 'href="mine-open/report.html"' in (ran.out / "index.html").read_text()


def test_lamp_is_run_from_the_same_start_and_scored_by_the_same_goal(ran: Ran, tmp_path: Path) -> None:
    (tmp_path / "p.lamp").write_text("1. MOVE LV 500 DIL 3000\n")
    text = HEAD + NEARER + LAMP + '[[vary.list]]\nname = "a"\n"mission.goal" = [7.5, 0.0]\n'
    (tmp_path / "mine.toml").write_text(text)
    (case,) = load(tmp_path / "mine.toml")
    ((task,),) = tasks_of(case).values()
    assert isinstance(task, MissionTask)
    task.carry_out(ran.store)
    run = mission_of(task, ran.store).run
    assert run.completed
    assert run.track[0, 1:3] == pytest.approx((4.5, 0.0), abs=0.02)
    assert run.track[-1, 1] == pytest.approx(7.5, abs=0.2)
    assert run.goal == (7.5, 0.0)
    (told,) = run.log
    assert told.what.startswith("1. MOVE LV 500 DIL 3000: finished, ")


def test_lamp_lasts_no_longer_than_the_limit_of_steps(ran: Ran, tmp_path: Path) -> None:
    (tmp_path / "p.lamp").write_text("1. MOVE LV 500 DIL 3000\n")
    (tmp_path / "mine.toml").write_text(HEAD + NEARER + LAMP + "[limits]\nsteps = 50\n")
    ((task,),) = tasks_of(load(tmp_path / "mine.toml")[0]).values()
    assert isinstance(task, MissionTask)
    known = replace(task, reference=ran.judged["mine/open"].led["odometry"][1].reference)  # it may take longer
    known.carry_out(ran.store)
    run = mission_of(known, ran.store).run
    assert run.why.startswith("failed: stage 1, not done after 2 s")
    assert run.time == pytest.approx(2.0, abs=0.1)


def test_a_mission_goes_elsewhere_with_all_that_it_reads(
    ran: Ran, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its query's world is a file, which the other machine has somewhere else."""

    class Here:
        def call(self, mishap: object, limit: float, function: Callable[..., TaskOutcome], *given: object) -> object:
            return type("Done", (), {"result": lambda self: function(*given)})()

    monkeypatch.setattr(remote_payload, "_process", Here)
    (tmp_path / "shut.toml").write_text((LIBRARY / "offices-closed.toml").read_text())
    (tmp_path / "p.lamp").write_text("1. MOVE LV 500 DIL 500\n")
    (tmp_path / "mine.toml").write_text(HEAD + NEARER + 'world = "shut.toml"\n' + LAMP)
    ((task,),) = tasks_of(load(tmp_path / "mine.toml")[0]).values()
    task.carry_out(ran.store)
    order = remote_task_for(task, ran.store)
    sent = [piece.path.read_bytes() for piece in order.pieces]
    (tmp_path / "shut.toml").unlink()
    delivery = remote_payload.carry_out(order, *sent)
    assert delivery.outcome.good, delivery.outcome.reason
    name = ran.store.path(task.key, task.ending).name
    (tmp_path / name).write_bytes(delivery.files[name])
    there, here = read_mission(tmp_path / name).run, read_mission(ran.store.path(task.key, task.ending)).run
    assert np.array_equal(there.track, here.track, equal_nan=True)


def test_a_robot_that_is_carried_on_by_somebody_is_elsewhere_than_its_odometer_says(ran: Ran) -> None:
    task = ran.judged["mine/open"].led["odometry"][1]
    carried = replace(task, query=replace(task.drive, faults=(Kidnap(at=2.0, to=6.0),)))
    assert carried.key != task.key
    carried.carry_out(ran.store)
    run = mission_of(carried, ran.store).run
    jumps = np.hypot(*np.diff(run.track[:, 1:3], axis=0).T)
    assert jumps.max() == pytest.approx(4.0, abs=0.3)
    assert not run.completed
