"""The scenarios that come with the bench: that they mean what they say, and that what they drive can be driven."""

import json
import math
import os
from dataclasses import asdict
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from refseq.logs import read_recording
from refseq_bench.scenarios.campaign.campaign import Watcher, run_campaign
from refseq_bench.scenarios.campaign.declare.case import Case
from refseq_bench.scenarios.campaign.declare.cases import find, load, names
from refseq_bench.scenarios.campaign.declare.checks.drivable import check_route
from refseq_bench.scenarios.campaign.declare.outcomes import Verdict
from refseq_bench.scenarios.campaign.declare.real_recordings import DATA, real_paths
from refseq_bench.scenarios.campaign.declare.schema import DriveTable, MissionScenario, Scenario
from refseq_bench.scenarios.campaign.declare.sources import Log
from refseq_bench.scenarios.campaign.run.case_tasks import tasks_of
from refseq_bench.scenarios.campaign.run.tasks import RecordTask, distinct
from refseq_bench.scenarios.campaign.run.workers import LocalWorkers
from refseq_bench.scenarios.campaign.store.cache import Store
from refseq_bench.scenarios.drives.drive import QUERY_SEEDS, Drive
from refseq_bench.scenarios.drives.route import driven, plan_of
from refseq_bench.scenarios.drives.selection import stretch
from refseq_bench.scenarios.library import LIBRARY
from refseq_bench.scenarios.scoring.path_geometry import WIDE
from refseq_bench.scenarios.world_survey.facts import robot_boxes
from refseq_bench.sim.rendering.drivers import vulkan_device
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.worlds.build import build_world
from refseq_bench.worlds.check import check_world
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.plans.load import load_plan

THESIS = {
    "fig-2.6-visible-features",
    "fig-2.7-laboratory",
    "fig-2.11-2.13-sensors",
    "fig-3.11-daylight",
    "fig-3.12-evening",
    "fig-4.9-two-paths",
    "fig-4.14-eight-sequences",
    "fig-3.11-3.12-people",
    "table-3.1-camera-1",
    "table-3.1-hours",
    "table-3.1-dusk",
    "fig-6.1-car-park",
}
OWN = {
    "light-dial",
    "between-places",
    "kidnap",
    "detour",
    "lost-view",
    "neural-keys",
    "moved-furniture",
    "crowd",
    "other-robot",
    "aliasing",
    "real-csail",
    "real-csail-merge",
    "real-merge",
    "joins",
    "real-fr079",
    "real-corridor",
    "track",
    "validity-laser",
    "validity-camera",
    "camera-black",
    "laser-dazzled",
    "wheel-slip",
    "start-in-the-middle",
    "smoke",
    "fewer-words",
    "compact-maps",
    "corners",
    "prior-window",
    "odometry-scale",
    *(f"dial-{dial}" for dial in ("glass", "hour", "people", "repetition", "side", "texture", "width")),
    "part-of-the-way",
}

MISSIONS = {"end-of-corridor", "second-door", "laboratory-round", "three-paths", "lamp", "led-once", "led-by-laser"}


@cache
def cases() -> tuple[Case, ...]:
    return tuple(case for name in names() for case in load(LIBRARY / f"{name}.toml"))


@cache
def drives(atlas: bool | None = None) -> dict[str, Drive]:
    """The distinct drives by all that they are made of, of localising with and without an atlas, or of all of it."""
    localising = [one for one in cases() if isinstance(one.scenario, Scenario)]
    asked = [one for one in localising if atlas is None or atlas == ("atlas" in one.scenario.tags)]
    sources = [source for case in asked for seed in case.scenario.seeds for source in case.sources(seed)]
    return {json.dumps(asdict(one), default=str, sort_keys=True): one for one in sources if isinstance(one, Drive)}


@cache
def missions() -> tuple[Case, ...]:
    return tuple(one for one in cases() if isinstance(one.scenario, MissionScenario))


def case(name: str) -> Case:
    (found,) = find([name])
    return found


def query(name: str, seed: int) -> Drive:
    found = case(name).sources(seed)[-1]
    assert isinstance(found, Drive)
    return found


# --- the files ---


def test_the_library_holds_what_it_is_said_to_hold() -> None:
    assert set(names()) == THESIS | OWN | MISSIONS
    assert {one.file.stem for one in missions()} == MISSIONS


def test_what_lies_beside_the_scenarios_is_a_world_a_camera_or_a_program_of_one_of_them() -> None:
    files = {path.name for path in LIBRARY.iterdir() if path.is_file() and path.suffix != ".py"}
    beside = files - {f"{name}.toml" for name in names()}
    sets = ("corridor", "gardens-point-day", "gardens-point-night")
    cameras = {Path(model).name for drive in drives().values() for model in drive.cameras.values() if "/" in model}
    assert cameras == {f"camera-{name}.toml" for name in sets}
    assert beside == {"identical-doors.toml", "offices-closed.toml", "fig-1.6.lamp", *cameras}
    queries = [source for one in missions() for source in one.sources(1) if isinstance(source, Drive)]
    worlds = {Path(drive.world).name for drive in (*drives().values(), *queries) if drive.world.endswith(".toml")}
    programs = {one.scenario.mission.lamp for one in missions() if isinstance(one.scenario, MissionScenario)}
    assert worlds | programs - {None} == beside - cameras


@pytest.mark.parametrize("name", names())
def test_a_file_begins_with_what_it_is_for_and_names_its_figure_and_its_doubts(name: str) -> None:
    first = (LIBRARY / f"{name}.toml").read_text().splitlines()[0]
    assert first.startswith("# ")
    for one in load(LIBRARY / f"{name}.toml"):
        assert one.expectations, "nothing would ever fail"
        assert one.scenario.tags
        assert one.scenario.blocking or one.scenario.note, "what may fail says why"
        assert ("thesis" in one.scenario.tags) == (name in THESIS)
        if name in THESIS:
            numbers = [part for part in name.split("-") if part[0].isdigit()]
            assert all(number in one.scenario.source for number in numbers)


@pytest.mark.slow
def test_the_page_tells_of_each_scenario_and_of_as_many_drives_as_there_are() -> None:
    page = Path(__file__).resolve().parents[3].joinpath("docs", "scenarios.md").read_text()
    (section,) = (part for part in page.split("\n## ") if part.startswith("The library\n"))
    localising = [one for one in cases() if one not in missions()]
    simulated = [one for one in localising if isinstance(one.scenario.reference, DriveTable)]
    assert {name for name in names() if f"`{name}`" not in section} == set()
    assert f"So {len(simulated)} simulated cases" in section
    way = sum(check_route(drive) for drive in drives().values())
    assert f"{len(drives())} drives, {way / 1000:.1f} km" in section
    asked = [task for one in missions() for of_seed in tasks_of(one).values() for task in of_seed]
    found = distinct(asked)
    recorded = sum(isinstance(task, RecordTask) for task in found)
    assert f"{len(missions())} cases of missions need {recorded} drives" in section


def test_titles_differ() -> None:
    titles = {one.file: one.scenario.title for one in cases()}
    assert len(set(titles.values())) == len(titles) == len(names())


def test_all_that_is_expected_is_expected_of_methods_that_run() -> None:
    for one in cases():
        named = {method for each in one.expectations for method in each.methods}
        assert named | {one.scenario.judged} <= set(one.scenario.methods)


def test_a_claim_between_methods_that_blocks_is_made_over_five_seeds_where_the_thesis_has_figures() -> None:
    held = [one for one in cases() if "table" in one.scenario.tags]
    assert any(one.expectations for one in held)
    for one in held:
        assert len(one.scenario.seeds) >= 5
        assert all(each.seeds >= 5 for each in one.expectations)


# --- the drives ---


def test_recordings_are_shared() -> None:
    """Rendering is what a campaign costs: all drives of the hallway that can be one are one."""
    print(f"{len(drives())} distinct drives in {len(cases())} cases")
    twins = sum(2 * len(one.scenario.seeds) for one in cases() if "/twin/" in one.name)
    track = sum(2 * len(one.scenario.seeds) for one in cases() if one.scenario.training_seeds)
    # Thirteen points of the dials of a building have a world of their own, ten of a query one reference.
    dials = 5 * (2 * 13 + 1 + 10)
    # Each twin, and each seed of the track, has its own world; for corners nothing is rendered.
    assert len(drives(atlas=False)) <= 148 + 15 + 10 + 5 * 5 * 2 + 14 + twins + track + dials
    # Two paths as references, three queries, and one path as the only reference; eight references at one hour, four of
    # them at another and all at a third, and two queries, of which one is asked in both.
    # Nine buildings by the laser alone, four references and a query, of which nothing is rendered.
    assert len(drives(atlas=True)) <= 5 * (2 + 3 + 1) + 3 * (8 + 4 + 8 + 1) + 3 * 9 * (4 + 1)
    mapped = [
        drive
        for drive in drives().values()
        if (drive.world, drive.robot, drive.light, drive.end) == ("hallway", "robuter", "16:00", None)
        and drive.renderer is not RendererKind.NONE
        and drive.seed < QUERY_SEEDS
    ]
    assert sorted(drive.seed for drive in mapped) == [1, 2, 3, 4, 5]


def test_no_query_is_the_very_drive_of_its_map() -> None:
    for one in cases():
        for seed in one.scenario.seeds:
            *learnt, asked = one.sources(seed)
            assert asked not in learnt
            seeds = [source.seed for source in (*learnt, asked) if isinstance(source, Drive)]
            assert len(set(seeds)) == len(seeds), "nor is a further reference the drive of another"


def test_every_fault_lies_on_the_stretch_that_is_driven() -> None:
    faulty = [drive for drive in drives().values() if drive.faults]
    assert {fault.kind for drive in faulty for fault in drive.faults} == {
        "kidnap",
        "camera-black",
        "laser-dazzled",
        "wheel-slip",
    }
    for drive in faulty:
        length = check_route(drive)
        for fault in drive.faults:
            said = asdict(fault)
            assert all(0 <= said[key] <= length for key in ("at", "to", "until") if key in said)


def test_a_stretch_of_the_map_that_is_learnt_is_one_that_any_drive_has() -> None:
    """Views come every trigger's distance and up to a control period later."""
    learning = [one for one in cases() if one.scenario.places and isinstance(one.scenario.reference, DriveTable)]
    assert learning
    for one in learning:
        reference = one.sources(1)[0]
        assert isinstance(reference, Drive)
        assert reference.trigger.distance is not None
        fewest = int(check_route(reference) / (reference.trigger.distance + 0.03))
        stretch(one.scenario.places, fewest, one.file)


@pytest.mark.parametrize("name", ["off-the-map", "onto-the-map"])
def test_a_kidnap_off_the_map_leaves_it_by_more_than_the_tolerance(name: str) -> None:
    one = case(f"kidnap/{name}")
    places = stretch(one.scenario.places, 120, one.file)
    reference, asked = one.sources(1)
    assert isinstance(reference, Drive)
    assert isinstance(asked, Drive)
    end = places.stop * (reference.trigger.distance or math.nan) + 1.0
    (fault,) = asked.faults
    at, to = asdict(fault)["at"], asdict(fault)["to"]
    far = end + WIDE.distance
    if name == "off-the-map":
        assert at < end < far < to
    else:
        assert to < end < far < at


def test_the_detour_leaves_the_path_for_more_than_ten_metres_and_comes_back() -> None:
    one = case("detour")
    reference, asked = one.sources(1)
    assert isinstance(reference, Drive)
    assert isinstance(asked, Drive)
    path, way = (
        along(driven(np.array(route), drive))
        for route, drive in ((plan_of(reference).routes[reference.route], reference), (asked.waypoints, asked))
    )
    gap = np.array([np.hypot(*(path - point).T).min() for point in way])
    off = gap > WIDE.distance + 0.2  # a person wanders by as much
    away = np.flatnonzero(off)
    assert 0.1 * off.sum() > 10.0
    assert off[away[0] : away[-1] + 1].all()
    assert gap[: away[0] - 30].max() < 0.2
    assert gap[away[-1] + 30 :].max() < 0.2


def along(route: np.ndarray) -> np.ndarray:
    """Points every 10 cm along a polyline (n, 2), (m, 2)."""
    lengths = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(route, axis=0).T))])
    at = np.arange(0.0, lengths[-1], 0.1)
    return np.column_stack([np.interp(at, lengths, route[:, axis]) for axis in (0, 1)])


@pytest.mark.slow
def test_robots_get_through_the_detour() -> None:
    assert check_world(plan_of(query("detour", 1)), light_named("16:00"), robot_boxes()).findings == ()


# --- worlds and changes ---


def test_the_corridor_of_identical_doors_repeats_itself_exactly() -> None:
    plan = load_plan(str(LIBRARY / "identical-doors.toml"))
    assert check_world(plan, light_named("16:00"), robot_boxes()).findings == ()
    for wall in ("left", "right"):
        doors = [door for door in plan.door if door.wall == wall]
        assert np.ptp(np.diff([door.at for door in doors])) == 0.0
        assert len({door.model_dump_json(exclude={"name", "at"}) for door in doors}) == 1
    steps = np.diff([door.at for door in plan.door if door.wall == "left"])
    assert plan.lamp[0].step == (steps[0], 0.0)
    others = (plan.window, plan.poster, plan.board, plan.fixture, plan.cabinet, plan.bin, plan.furniture)
    assert not any(others)


def test_the_offices_with_a_closed_door_differ_in_nothing_else() -> None:
    plan, shut = load_plan("offices"), load_plan(str(LIBRARY / "offices-closed.toml"))
    named = {"name", "title", "door"}
    assert plan.model_dump(exclude=named) == shut.model_dump(exclude=named)
    pairs = [(was, now) for was, now in zip(plan.door, shut.door, strict=True) if was != now]
    ((was, now),) = pairs
    assert (was.open, now.open) == (105, 0)
    told = {"open", "depth"}
    assert was.model_dump(exclude=told) == now.model_dump(exclude=told)


def test_no_daylight_gets_in_there() -> None:
    plan = load_plan(str(LIBRARY / "identical-doors.toml"))
    spots = np.array([[x, 0.0, 1.0] for x in (5.0, 25.0, 45.0)])
    day, night = (build_world(plan, light_named(light), seed=0).ambient for light in ("16:00", "late-evening"))
    assert [day.at(spot) for spot in spots] == pytest.approx([night.at(spot) for spot in spots], rel=1e-6)


@pytest.mark.parametrize("seed", [1, 2, 3, 4, 5])
def test_a_crowd_stands_and_walks_on_each_days_hallway(seed: int) -> None:
    people = plan_of(query("crowd", seed)).person
    walking = [person for person in people if person.walk]
    assert len(walking) >= 3
    assert len(people) - len(walking) >= 6


@pytest.mark.parametrize("seed", [1, 2, 3, 4, 5])
def test_things_have_moved_on_each_day_and_nothing_else_differs(seed: int) -> None:
    plan, then = load_plan("hallway"), plan_of(query("moved-furniture", seed))
    for kind, least in (("door", 4), ("poster", 8), ("bin", 2)):
        was, now = ({thing.model_dump_json() for thing in getattr(one, kind)} for one in (plan, then))
        assert len(was ^ now) >= least, kind
    assert then.person == plan.person
    assert then.wall == plan.wall
    assert query("moved-furniture", seed).light == "16:00"


# --- real recordings ---


def data() -> Path | None:
    folder = os.environ.get(DATA)
    return Path(folder) if folder else None


@cache
def views_in(log: Path) -> int:
    return len(read_recording(log).views)


@pytest.mark.slow_cases("real-merge")
@pytest.mark.skipif(data() is None, reason=f"no folder of real recordings in {DATA}")
@pytest.mark.parametrize("name", [name for name in names() if name.startswith("real-")])
def test_the_stretches_of_real_logs_are_there_and_do_not_overlap(name: str) -> None:
    for one in load(LIBRARY / f"{name}.toml"):
        spans: list[slice] = []
        for source in one.sources(1):
            assert not isinstance(source, Drive)
            path, *_ = real_paths(source)
            if isinstance(source, Log):
                spans.append(stretch(source.views, views_in(path), path))
        # References may overlap each other, where they are to be merged: never what is asked about.
        assert all(learnt.stop <= spans[-1].start for learnt in spans[:-1])


# --- for each commit ---


def test_smoke_is_the_one_that_ci_is_offered_and_is_short() -> None:
    (one,) = [case for case in cases() if "ci" in case.scenario.tags]
    assert one.name == "smoke"
    assert len(one.scenario.seeds) == 2
    way = [
        check_route(source) for seed in one.scenario.seeds for source in one.sources(seed) if isinstance(source, Drive)
    ]
    # 0.6 s for a view with two pictures, as measured where there is no GPU, and 0.25 s for a second at 0.4 m/s.
    assert sum(length / 0.85 * 0.6 + length / 0.4 * 0.25 for length in way) < 150.0


@pytest.mark.slow
@pytest.mark.skipif(vulkan_device() is None, reason="no Vulkan device on this machine")
def test_smoke_passes(tmp_path: Path) -> None:
    store, workers = Store(tmp_path), LocalWorkers(2, tmp_path)
    try:
        (result,) = run_campaign([case("smoke")], workers, store, Watcher())
    finally:
        workers.close(at_once=True)
    assert result.verdict is Verdict.PASSED, result.reasons
