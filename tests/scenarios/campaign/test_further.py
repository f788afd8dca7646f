"""Scenarios with further references: how they are declared, what is asked, how it is judged. Drives made by rule."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from refseq.logs import RecordingWriter
from refseq.view import View
from refseq_bench.scenarios.campaign.declare.case import Case
from refseq_bench.scenarios.campaign.declare.cases import load
from refseq_bench.scenarios.campaign.declare.expand import put
from refseq_bench.scenarios.campaign.declare.outcomes import Verdict
from refseq_bench.scenarios.campaign.declare.overrides import with_methods
from refseq_bench.scenarios.campaign.declare.real_recordings import DATA
from refseq_bench.scenarios.campaign.declare.sources import Images, Log, names_of
from refseq_bench.scenarios.campaign.judge.drives import Judged
from refseq_bench.scenarios.campaign.results import Results
from refseq_bench.scenarios.campaign.run.case_tasks import answer_tasks
from refseq_bench.scenarios.campaign.run.remote_payload import remote_task_for
from refseq_bench.scenarios.campaign.run.tasks import (
    AnswerTask,
    RecordTask,
    answers_of,
    asked_views,
    learnt_drives,
    perform,
)
from refseq_bench.scenarios.campaign.store.cache import MAP, RECORDING, Store
from refseq_bench.scenarios.campaign.store.result_file import read_result
from refseq_bench.scenarios.drives.drive import QUERY_SEEDS, Drive
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.methods.by_name import Learnt
from tests.scenarios.campaign.made import carried_out
from tests.support import corridor_drive

HEAD = 'title = "T"\nseeds = [1, 2]\n'
DRIVEN = """
[reference]
world = "hallway"
end = 20.0
renderer = "none"
faults = [{ kind = "wheel-slip", at = 5.0, seconds = 2.0 }]
[[further]]
light = "18:00"
[[further]]
route = "reverse"
[query]
light = "noon"
[localise]
sensors = ["laser"]
"""
LOGS = """
[reference]
log = "first.mcap"
odometry_noise = true
[[further]]
log = "second.mcap"
[query]
log = "query.mcap"
odometry_noise = false
[localise]
sensors = ["forward", "laser"]
"""


def cases(folder: Path, text: str, name: str = "mine") -> list[Case]:
    path = folder / f"{name}.toml"
    path.write_text(text)
    return load(path)


def only_case(folder: Path, text: str) -> Case:
    (case,) = cases(folder, text)
    return case


# --- what a file declares ---


def test_a_further_reference_is_as_the_first_but_for_what_it_says_and_has_no_faults(tmp_path: Path) -> None:
    case = only_case(tmp_path, HEAD + DRIVEN)
    first, second, third, query = case.sources(1)
    assert all(isinstance(one, Drive) for one in (first, second, third, query))
    assert isinstance(first, Drive)
    assert len(first.faults) == 1
    assert second == replace(first, light="18:00", faults=(), seed=1 + 2 * QUERY_SEEDS)
    assert third == replace(first, route="reverse", faults=(), seed=1 + 4 * QUERY_SEEDS)
    assert query == replace(first, light="noon", faults=(), seed=1 + QUERY_SEEDS)
    assert case.sides == ("reference", "further.0", "further.1", "query")
    assert tuple(case.source(side, 1) for side in case.sides) == case.sources(1)


def test_no_two_drives_of_a_case_have_a_seed_in_common(tmp_path: Path) -> None:
    case = only_case(tmp_path, HEAD + DRIVEN)
    seeds = [one.seed for seed in case.scenario.seeds for one in case.sources(seed) if isinstance(one, Drive)]
    assert len(set(seeds)) == len(seeds) == 8


def test_a_further_reference_of_another_kind_takes_over_nothing(tmp_path: Path) -> None:
    text = LOGS.replace('log = "second.mcap"', 'images = "folder"\nspacing = 2.0')
    first, second, query = only_case(tmp_path, HEAD + text).sources(2)
    assert first == Log("first.mcap", noise=2)
    assert second == Images("folder", 2.0)
    assert query == Log("query.mcap")
    same = LOGS.replace('log = "second.mcap"', 'views = "5:"')
    assert only_case(tmp_path, HEAD + same).sources(2)[1] == Log("first.mcap", "5:", noise=2 + 2 * QUERY_SEEDS)


def test_without_further_references_all_is_as_it_was(tmp_path: Path) -> None:
    alone = LOGS.replace('[[further]]\nlog = "second.mcap"\n', "")
    for text in (alone, "further = []\n" + alone):
        case = only_case(tmp_path, HEAD + text)
        assert case.sides == ("reference", "query")
        assert case.sources(1) == (Log("first.mcap", noise=1), Log("query.mcap"))
        assert case.scenario.localise.merge


def driven(drive: str = "", localise: str = "") -> str:
    """The driven case with more said of its last further reference, and of who is asked."""
    return DRIVEN.replace("[query]", f"{drive}\n[query]") + localise + "\n"


BAD: Mapping[str, tuple[str, str]] = {
    "a table": (LOGS.replace("[[further]]", "[further]"), "further: is no list of tables; valid is [[further]], once"),
    "a number": ("further = 3\n" + LOGS.replace("[[further]]\nlog", "#"), "further: is no list of tables"),
    "a list of numbers": ("further = [3]\n" + LOGS.replace("[[further]]\nlog", "#"), "further: is no list of tables"),
    "unknown key": (
        driven('lihgt = "noon"\n', ""),
        "further.1.lihgt: is not known here; valid are world, robot, light, change,",
    ),
    "a log's unknown key": (
        LOGS.replace('"second.mcap"', '"second.mcap"\nwidth = 3'),
        "further.0.width: is not known here; valid are log, views, thin, odometry_noise",
    ),
    "a picture's": (
        LOGS.replace('log = "second.mcap"', 'images = "a"\nlight = "noon"'),
        "further.0.light: is not known here; valid are images, spacing, width",
    ),
    "a value": (driven('end = "5"\n', ""), "further.1.end = '5' is not valid: input should be a valid number"),
    "a trigger's unknown key": (
        driven("[further.trigger]\nlength = 1\n", ""),
        "further.1.trigger.length: is not known here; valid are distance, turn, time",
    ),
    "a trigger's value": (driven("trigger = { turn = -1 }\n", ""), "further.1.trigger.turn = -1 is not valid"),
    "a fault's kind": (
        driven('faults = [{ kind = "ghost" }]\n', ""),
        "further.1.faults.0: kind 'ghost' is unknown; valid are 'kid",
    ),
    "half a fault": (
        driven('faults = [{ kind = "kidnap", at = 1 }]\n', ""),
        "further.1.faults.0.to: is missing",
    ),
    "a fault's key": (
        driven('faults = [{ kind = "kidnap", at = 1, to = 2, by = "ET" }]\n', ""),
        "further.1.faults.0.by: is not known here; valid are at, to, kind",
    ),
    "light": (driven('light = "dusk"\n', ""), "further.1: unknown light 'dusk'; known are morning"),
    "route": (driven("", "").replace('"reverse"', '"up"'), "further.1: unknown route 'up' in world 'hallway'"),
    "no end": (driven("end = 500.0\n", ""), "further.1: start 0.0 m and end 500 m are no stretch of route"),
    "places": (
        driven("", 'places = "2:8"'),
        "localise.places = '2:8'; valid with [[further]] is to learn all",
    ),
    "hindsight": (
        driven("", 'methods = ["best/hindsight"]\njudged = "best/hindsight"'),
        "localise: 'best/hindsight' knows one reference only; valid are methods without hindsight",
    ),
    "merge": (driven("", 'merge = "no"'), "localise.merge = 'no' is not valid: input should be a valid boolean"),
    "a key through no reference": (
        driven("", '[vary.grid]\n"further.2.light" = ["noon"]'),
        "vary: key 'further.2.light' leads through '2'; valid is a path through tables",
    ),
    "a key through a number below none": (
        driven("", '[vary.grid]\n"further.-1.light" = ["noon"]'),
        "vary: key 'further.-1.light' leads through '-1'",
    ),
    "a key through a number without end": (
        driven("", f'[[vary.list]]\nname = "x"\n"further.{"9" * 5000}.light" = "noon"'),
        "vary: key 'further.99",
    ),
    "a key that ends at a reference": (
        driven("", '[[vary.list]]\nname = "x"\n"further.0" = { light = "noon" }'),
        "vary: key 'further.0' ends at '0'; valid is a key of a table",
    ),
    "a varied value": (
        driven("", '[vary.grid]\n"further.0.light" = ["noon", "dusk"]'),
        "further.0: unknown light 'dusk'",
    ),
    "a key where there is none": (
        LOGS.replace('[[further]]\nlog = "second.mcap"\n', "") + '[vary.grid]\n"further.0.thin" = [1.0]\n',
        "further: is no list of tables",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_what_is_wrong_is_told_in_one_line(tmp_path: Path, name: str) -> None:
    text, message = BAD[name]
    with pytest.raises(ScenarioError) as error:
        cases(tmp_path, HEAD + text)
    told = str(error.value)
    assert told.startswith(f"{tmp_path / 'mine.toml'}: {message}"), told[:300]
    assert "\n" not in told


def test_each_further_reference_can_be_varied_by_its_number(tmp_path: Path) -> None:
    text = driven("", '[vary.grid]\n"further.0.light" = ["morning", "noon"]\n"further.1.end" = [10.0]')
    found = cases(tmp_path, HEAD + text)
    assert [case.name for case in found] == ["mine/morning,10.0", "mine/noon,10.0"]
    for case, light in zip(found, ("morning", "noon"), strict=True):
        told = [(one.light, one.end) for one in case.sources(1) if isinstance(one, Drive)]
        assert told == [("16:00", 20.0), (light, 20.0), ("16:00", 10.0), ("noon", 20.0)]


def test_a_case_may_go_without_them_or_not_merge(tmp_path: Path) -> None:
    text = (
        LOGS + '[[vary.list]]\nname = "none"\nfurther = []\n[[vary.list]]\nname = "apart"\n"localise.merge" = false\n'
    )
    none, apart = cases(tmp_path, HEAD + text)
    assert [len(none.sources(1)), len(apart.sources(1))] == [2, 3]
    assert [none.scenario.localise.merge, apart.scenario.localise.merge] == [True, False]


def test_what_is_put_into_a_list_stays_out_of_the_table_it_came_from() -> None:
    table = {"further": [{"light": "noon"}, {"faults": [{"at": 1}]}], "seeds": [1, 2]}
    changed = put(table, {"further.0.light": "18:00", "further.1.faults.0.at": 7, "further.0.trigger.turn": 5})
    assert changed["further"] == [{"light": "18:00", "trigger": {"turn": 5}}, {"faults": [{"at": 7}]}]
    assert table["further"] == [{"light": "noon"}, {"faults": [{"at": 1}]}]
    for key in ("seeds.0.x", "further.light", "further.0.light.x", "further.1.faults.1.at"):
        with pytest.raises(ScenarioError, match=r"leads through|ends at"):
            put(table, {key: 1})


def test_asking_for_what_knows_one_reference_is_refused_before_anything_is_run(tmp_path: Path) -> None:
    (case,) = cases(tmp_path, HEAD + LOGS)
    with pytest.raises(ScenarioError, match=r"^mine: localise: 'best/hindsight' knows one reference only"):
        with_methods([case], [], ["thesis", "best/hindsight"])
    (alone,) = cases(tmp_path, HEAD + LOGS.replace('[[further]]\nlog = "second.mcap"\n', ""))
    assert with_methods([alone], [], ["best/hindsight"])[0].scenario.methods == ("best/hindsight",)


def test_references_go_by_names_that_differ() -> None:
    drive = Drive(world="hallway", route="forward")
    assert names_of([drive, replace(drive, light="18:00"), replace(drive, route="reverse")]) == (
        "forward",
        "forward (2)",
        "reverse",
    )
    assert names_of([Log("a/x.mcap"), Log("b/x.mcap"), Log("x.log", "3:9"), Images("a/x")]) == (
        "x",
        "x (2)",
        "x 3:9",
        "x (4)",
    )


# --- tasks ---


FIRST, SECOND, QUERY = Log("first.mcap"), Log("second.mcap"), Log("query.mcap")
LENGTHS = {"first": 18, "second": 23, "query": 16}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two drives whose last and first twelve views are of the same places, and a query along their way."""
    path = tmp_path_factory.mktemp("further")
    walk = corridor_drive(np.random.default_rng(0), 29, size=80)
    again = corridor_drive(np.random.default_rng(1), 29, size=80, brightness=0.8)
    asked = corridor_drive(np.random.default_rng(2), 29, size=80, brightness=0.6)
    for name, views in (("first", walk[:18]), ("second", again[6:]), ("query", asked[8:24])):
        assert len(views) == LENGTHS[name]
        with RecordingWriter(path / f"{name}.mcap", {"world": "made", "light": name, "seed": "7"}) as writer:
            for number, view in enumerate(views):
                assert view.truth is not None
                writer.write(replace(view, distance=view.distance if number else 0.0), view.truth)
    return path


@pytest.fixture(autouse=True)
def recordings(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(DATA, str(folder))


@pytest.fixture
def alone() -> AnswerTask:
    return AnswerTask(("thesis/uniform",), FIRST, QUERY, None, ("forward", "laser"), 1, 60.0)


@pytest.fixture
def both(alone: AnswerTask) -> AnswerTask:
    return replace(alone, further=(SECOND,))


def test_answers_have_another_key_with_other_references(alone: AnswerTask, both: AnswerTask) -> None:
    others = [
        alone,
        both,
        replace(both, merge=False),
        replace(both, further=(QUERY,)),
        replace(both, further=(SECOND, SECOND)),
        replace(both, reference=SECOND, further=(FIRST,)),
        replace(both, further=(replace(SECOND, views="0:9"),)),
        replace(alone, reference=SECOND),
    ]
    assert len({one.key for one in others}) == len(others)
    assert replace(alone, merge=False).key == alone.key  # there is nothing to merge


def test_the_query_is_the_last_of_the_sources(both: AnswerTask, tmp_path: Path) -> None:
    assert len(both.sources) == 3
    store = Store(tmp_path)
    assert len(asked_views(both, store).views) == LENGTHS["query"]
    assert [len(drive.views) for drive in learnt_drives(both, store)] == [18, 23]
    assert asked_views(both, store).metadata["light"] == "query"
    assert [drive.metadata["light"] for drive in learnt_drives(both, store)] == ["first", "second"]


def test_drives_are_read_from_where_they_were_recorded(folder: Path, tmp_path: Path) -> None:
    """Recordings of drives are found by their keys alone: the query's is behind those of all references."""
    drive = Drive(world="hallway", seed=1)
    further, query = replace(drive, light="18:00", seed=2001), replace(drive, light="noon", seed=1001)
    task = AnswerTask(("thesis/uniform",), drive, query, None, ("forward", "laser"), 1, 60.0, (further,))
    store = Store(tmp_path)
    for name, one in zip(("first", "second", "query"), (drive, further, query), strict=True):
        store.path(RecordTask(one, 1.0).key, RECORDING).write_bytes((folder / f"{name}.mcap").read_bytes())
    assert [one.metadata["light"] for one in learnt_drives(task, store)] == ["first", "second"]
    assert asked_views(task, store).metadata["light"] == "query"
    outcome = perform(task, store)
    assert outcome.verdict is Verdict.PASSED, outcome.reason
    (beliefs,) = answers_of(task, store).beliefs.values()
    assert (len(beliefs), len(beliefs[0].places)) == (16, 41)


def test_all_drives_are_needed_and_each_once(tmp_path: Path) -> None:
    case = only_case(tmp_path, HEAD + DRIVEN)
    (task,) = answer_tasks(case)[1]
    assert [one.drive for one in task.needs] == list(case.sources(1))
    assert [one.key for one in task.needs] == list(task.sources)
    assert all(isinstance(one, RecordTask) for one in task.needs)


def test_maps_are_shared_with_all_who_learn_one_of_the_drives(alone: AnswerTask, both: AnswerTask) -> None:
    second = replace(alone, reference=SECOND)
    assert set(both.maps) == {*alone.maps, *second.maps}
    assert not set(alone.maps) & set(second.maps)
    assert replace(both, merge=False).maps == both.maps


def test_what_is_sent_elsewhere_holds_all_drives(both: AnswerTask, tmp_path: Path) -> None:
    pieces = [piece.name for piece in remote_task_for(both, Store(tmp_path)).pieces]
    assert pieces == ["first.mcap", "second.mcap", "query.mcap"]


def test_each_map_is_learnt_once_whoever_learns_it_first(
    alone: AnswerTask, both: AnswerTask, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = Store(tmp_path)
    assert perform(alone, store).verdict is Verdict.PASSED
    kept = {path: path.read_bytes() for path in tmp_path.glob(f"*{MAP}")}
    assert len(kept) == 1
    outcome = perform(both, store)
    assert outcome.verdict is Verdict.PASSED, outcome.reason
    assert {path: path.read_bytes() for path in kept} == kept
    assert len(list(tmp_path.glob(f"*{MAP}"))) == 2
    monkeypatch.setattr("refseq_bench.scenarios.methods.shelf.learn", None)
    apart = replace(both, merge=False)
    assert perform(apart, store).verdict is Verdict.PASSED
    whole, unmerged = (answers_of(task, store).mergings["thesis/uniform"] for task in (both, apart))
    assert [one.joined for one in whole.decisions] == [True]
    assert len(set(whole.held_by.tolist())) == 41 - 12
    assert unmerged.decisions == ()
    assert unmerged.held_by.tolist() == list(range(41))


def test_what_was_learnt_asked_and_merged_is_left_in_the_store(
    both: AnswerTask, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[Sequence[View]] = []
    answers = Learnt.answers

    def watched(learnt: Learnt, query: Sequence[View]) -> object:
        asked.append(query)
        return answers(learnt, query)

    monkeypatch.setattr(Learnt, "answers", watched)
    store = Store(tmp_path)
    outcome = perform(both, store)
    assert outcome.verdict is Verdict.PASSED, outcome.reason
    (views,) = asked
    assert all(view.truth is None for view in views)
    # Pictures of the query, which is darker than what was learnt.
    truly = asked_views(both, store).views
    assert all((mine.images["forward"] == its.images["forward"]).all() for mine, its in zip(views, truly, strict=True))
    kept = answers_of(both, store)
    beliefs, cost = kept.beliefs, kept.cost
    assert {name: (len(each), len(each[0].places)) for name, each in beliefs.items()} == {"thesis/uniform": (16, 41)}
    assert cost.places == 41
    merging = kept.mergings["thesis/uniform"]
    assert (merging.names, merging.lengths) == (("first", "second"), (18, 23))
    assert all(
        not len(np.flatnonzero(b.places)) > len(set(merging.held_by.tolist())) for b in beliefs["thesis/uniform"]
    )


def test_who_learns_one_drive_or_has_no_atlas_merges_nothing(
    alone: AnswerTask, both: AnswerTask, tmp_path: Path
) -> None:
    store = Store(tmp_path)
    for task in (alone, replace(both, methods=("seqslam",))):
        assert perform(task, store).verdict is Verdict.PASSED
        assert answers_of(task, store).mergings == {}
    kept = answers_of(replace(both, methods=("seqslam",)), store)
    beliefs, cost = kept.beliefs, kept.cost
    assert (len(beliefs["seqslam"][0].places), cost.places) == (41, 41)


# --- a case, judged ---

EXPECT = """expect = [
  "success >= 50 %", "success of seqslam >= 0 %", "jumps <= 9", "to_settle >= 0", "join_precision >= 0 %",
  "join_recall >= 0 %", "false_joins <= 9", "duplicates <= 99", "places_left <= 100 %", "bytes_left <= 100 %",
]
"""
METHODS = 'methods = ["thesis", "seqslam"]\njudged = "thesis/chain"\n'


@pytest.fixture(scope="module")
def done(folder: Path) -> Judged:
    """A case that was carried out, its store beside it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(DATA, str(folder))
        return carried_out(only_case(folder, HEAD + EXPECT + LOGS + METHODS), Store(folder / "store"))


def test_a_case_is_judged_by_its_atlas(done: Judged) -> None:
    result = done
    assert not result.mishaps, result.reasons
    assert len(result.judgements) == 10
    assert all(one.reason == "" for one in result.judgements), result.reasons
    met = {one.text.split()[0]: one.met for one in result.judgements}
    assert met["success"], result.reasons
    assert met["places_left"]
    for run in result.comparisons:
        assert run.drives is not None
        assert (run.drives.names, run.drives.lengths) == (("first", "second"), (18, 23))
        assert (len(run.reference_views), len(run.query_views)) == (41, 16)
        assert [view.truth.x for view in run.query_views if view.truth] == pytest.approx(
            [1.0 + 0.85 * k for k in range(8, 24)]
        )
        assert set(run.mergings) == {"thesis/uniform", "thesis/prior", "thesis/chain"}
    by_method = {one.method: one for one in result.figures}
    assert all(one.atlas is not None for one in result.figures)
    seqslam = by_method["seqslam"].atlas
    assert seqslam is not None
    assert seqslam.joined is None
    ours = by_method["thesis/chain"].atlas
    assert ours is not None
    assert ours.joined is not None
    assert ours.joined.views == 2 * 41
    assert ours.joined.recall.trials == 2 * 2 * 12, "twelve places on either drive"
    assert len(ours.forks) == 2, "where the first drive ends, in both seeds"


def test_the_page_and_the_record_tell_of_all_drives(done: Judged, folder: Path, tmp_path: Path) -> None:
    Results(tmp_path, [done.case], Store(folder / "store")).add(done)
    (record,) = read_result(tmp_path).cases
    for seed, of_seed in answer_tasks(done.case).items():
        told = record.seeds[seed]
        assert (told.reference, *told.further, told.query) == of_seed[0].sources
        assert (told.learnt_views, told.asked_views) == (41, 16)
    figures = {one.method: one.figures for one in record.methods}
    assert figures["thesis/chain"]["learnt_views"] == 82
    assert "learnt_views" not in figures["seqslam"]
    assert record.page is not None
    page = (tmp_path / record.page).read_text()
    assert "<h3>Several drives</h3>" in page
    assert "truly there" in page
    assert re.search(r"second \(\d+ of 23\)", page)


@pytest.mark.slow
def test_one_drive_twice_is_merged_into_one(tmp_path: Path) -> None:
    text = LOGS.replace("odometry_noise = true\n", "").replace('"second.mcap"', '"first.mcap"')
    text = text.replace('"query.mcap"', '"second.mcap"\nviews = "0:5"')
    case = only_case(tmp_path, HEAD.replace("[1, 2]", "[1]") + text + 'methods = ["best/chain"]\nprofile = "best"\n')
    result = carried_out(case, Store(tmp_path / "store"))
    assert not result.mishaps, result.reasons
    (found,) = result.figures
    assert found.atlas is not None
    assert found.atlas.joined is not None
    assert (found.atlas.joined.places, found.atlas.joined.views) == (18, 36)
    assert found.atlas.joined.precision.value == found.atlas.joined.recall.value == 1.0
    assert found.atlas.joined.duplicates == 0
    assert result.comparisons[0].drives is not None
    assert result.comparisons[0].drives.names == ("first", "first (2)")
