"""Keys follow all code that makes what they name, and none else: by changing files, and by tracing what really runs."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import pytest

from refseq.features.neural.network import FILE
from refseq_bench.scenarios.campaign.declare.case import Case
from refseq_bench.scenarios.campaign.declare.cases import load
from refseq_bench.scenarios.campaign.declare.sources import Log
from refseq_bench.scenarios.campaign.run import remote_payload
from refseq_bench.scenarios.campaign.run.answering_code import answering_code, answering_modules
from refseq_bench.scenarios.campaign.run.case_tasks import answer_tasks, mission_tasks
from refseq_bench.scenarios.campaign.run.tasks import HANDS
from refseq_bench.scenarios.campaign.store import keys, views
from refseq_bench.scenarios.campaign.store.views import recording_key, source_key
from refseq_bench.scenarios.drives.drive import Drive
from refseq_bench.scenarios.drives.record import record
from refseq_bench.scenarios.imports.closure import PACKAGES, ROOT, Closure, closure_of
from refseq_bench.sim.rendering.renderer import RendererKind
from tests.scenarios.campaign import traced
from tests.scenarios.campaign.made import write_logs
from tests.worlds.conftest import SMALL

KINDS = ("recording", "real log", "map", "answers", "mission", "remote")


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the bench."""
    root = tmp_path_factory.mktemp("bench")
    for name in PACKAGES:
        shutil.copytree(ROOT / name, root / name, ignore=shutil.ignore_patterns("__pycache__"))
    return root


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("logs")
    write_logs(folder, 8)
    return folder


@pytest.fixture
def made(copy: Path, logs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[dict[str, Closure]]:
    """Closures that were made for keys, of the code in the copy."""
    found: dict[str, Closure] = {}

    def noted(*modules: str, alone: tuple[str, ...] = ()) -> Closure:
        found["+".join(modules)] = closure = closure_of(*modules, alone=alone, root=copy)
        return closure

    for module in (keys, remote_payload):
        monkeypatch.setattr(module, "closure_of", noted)
    monkeypatch.setenv("REFSEQ_RECORDINGS", str(logs))
    forget()
    yield found
    forget()


def forget() -> None:
    keys.code_digest.cache_clear()
    remote_payload.here.cache_clear()


@pytest.fixture(scope="module")
def unchanged() -> dict[str, object]:
    """Keys of each kind by the code as it is, once a test has made them."""
    return {}


@pytest.fixture
def key_makers(made: Mapping[str, Closure], tmp_path: Path) -> Mapping[str, Callable[[], object]]:
    """Functions that make a key of each kind, of tasks that were never asked for theirs."""

    def case(text: str, name: str) -> Case:
        (tmp_path / f"{name}.toml").write_text(text)
        return load(tmp_path / f"{name}.toml")[0]

    (tmp_path / "small.toml").write_text(SMALL.format(top="", end=""))
    driven, mission = case(traced.DRIVEN, "driven"), case(traced.MISSION, "mission")
    return {
        "recording": lambda: answer_tasks(driven)[1][0].needs[0].key,
        "real log": lambda: source_key(Log("query.mcap")),
        "map": lambda: answer_tasks(driven)[1][0].maps,
        "answers": lambda: answer_tasks(driven)[1][0].key,
        "mission": lambda: mission_tasks(mission)[1][0].key,
        "remote": lambda: remote_payload.here().sources,
    }


def all_keys(makers: Mapping[str, Callable[[], object]]) -> dict[str, object]:
    forget()
    return {kind: make() for kind, make in makers.items()}


DRIVEN = {"recording", "mission", "remote"}
ALL = set(KINDS)


@pytest.mark.quick_cases(
    "refseq/features/doors.py-changed0",
    "refseq/viewer/drawing/colours.py-changed1",
    "refseq/logs/ros/bag.py-changed6",
    "refseq_bench/worlds/library/new.toml-changed8",
    "refseq_bench/scenarios/methods/baselines/vlad.py-changed11",
    "refseq_bench/scenarios/campaign/run/worker_init.py-changed15",
)
@pytest.mark.parametrize(
    ("file", "changed"),
    [
        ("refseq/features/doors.py", ALL - {"real log"}),  # found for behaviours, and to tell views apart
        ("refseq/viewer/drawing/colours.py", set()),
        ("refseq/logs/foxglove/writer.py", ALL),
        ("refseq/logs/foxglove/source.py", ALL - {"recording"}),  # reads what was recorded, and records nothing
        ("refseq/logs/thin.py", ALL - {"recording"}),
        ("refseq/logs/carmen/source.py", {"real log", "mission", "remote"}),
        ("refseq/logs/ros/bag.py", {"real log", "mission", "remote"}),
        ("refseq_bench/worlds/library/hallway.toml", DRIVEN),
        ("refseq_bench/worlds/library/new.toml", DRIVEN),
        ("refseq_bench/robots/robuter/robuter.xml", DRIVEN),
        ("refseq_bench/robots/robuter/README.md", set()),
        ("refseq_bench/scenarios/methods/baselines/vlad.py", {"remote"}),
        ("refseq_bench/scenarios/scoring/merging.py", {"answers", "mission", "remote"}),
        ("refseq_bench/scenarios/errors.py", ALL),
        ("refseq_bench/scenarios/campaign/run/tasks.py", {"map", "answers", "mission", "remote"}),
        ("refseq_bench/scenarios/campaign/run/worker_init.py", {"remote"}),
        ("refseq_bench/scenarios/campaign/pages/index.py", set()),
        ("refseq_bench/scenarios/cli/app.py", set()),
    ],
)
def test_a_changed_file_changes_the_keys_of_what_it_has_a_part_in(
    copy: Path,
    key_makers: Mapping[str, Callable[[], object]],
    unchanged: dict[str, object],
    file: str,
    changed: set[str],
) -> None:
    before = unchanged or all_keys(key_makers)
    unchanged.update(before)
    path = copy / file
    content = path.read_bytes() if path.exists() else None
    path.write_bytes((content or b"") + b"\n# changed\n")
    try:
        after = all_keys(key_makers)
    finally:
        path.unlink() if content is None else path.write_bytes(content)
    # Answers are those to recordings: where one changes, what is asked about it does too.
    followed = changed | ({"map", "answers"} if "recording" in changed else set())
    assert {kind for kind in KINDS if after[kind] != before[kind]} == followed


FAMILIES = ("thesis/chain", "best/chain", "hamming", "vlad", "ransac", "fabmap", "seqslam", "topometric")
OURS = {"thesis/chain", "best/chain"}
ON_VLAD = {"vlad", "topometric"}


@pytest.mark.quick_cases(
    "scenarios/methods/baselines/seqslam.py-changed0",
    "scenarios/methods/baselines/vlad.py-changed2",
    "scenarios/methods/names.py-changed6",
)
@pytest.mark.parametrize(
    ("file", "changed"),
    [
        ("scenarios/methods/baselines/seqslam.py", {"seqslam"}),
        ("scenarios/methods/baselines/topometric.py", {"topometric"}),
        ("scenarios/methods/baselines/vlad.py", ON_VLAD | {"ransac"}),  # which takes its root of SIFT
        ("scenarios/methods/baselines/place_filter.py", {"fabmap", "seqslam", "topometric"}),
        ("scenarios/methods/baselines/__init__.py", set(FAMILIES)),
        ("scenarios/methods/by_name.py", set(FAMILIES)),
        ("scenarios/methods/names.py", set(FAMILIES)),
        ("scenarios/campaign/run/answering.py", set(FAMILIES)),
        ("scenarios/campaign/store/recordings.py", set(FAMILIES)),
    ],
)
def test_a_changed_method_changes_the_keys_of_its_own_answers_alone(
    copy: Path, made: Mapping[str, Closure], file: str, changed: set[str]
) -> None:
    def code() -> dict[str, str]:
        forget()
        return {method: answering_code([method], HANDS) for method in FAMILIES}

    before, path = code(), copy / "refseq_bench" / file
    content = path.read_bytes()
    path.write_bytes(content + b"\n# changed\n")
    try:
        after = code()
    finally:
        path.write_bytes(content)
    assert made
    assert {method for method in FAMILIES if after[method] != before[method]} == changed


@pytest.mark.parametrize(
    "file", ["refseq/inference/chain/forward.py", "refseq/map/tracking/stages.py", "refseq/map/tracking/trackers.py"]
)
def test_a_change_to_our_localiser_leaves_what_baselines_answered(file: str) -> None:
    modules = {method: answering_modules([method], HANDS) for method in FAMILIES}
    followers = {method for method, of in modules.items() if file in closure_of(*of.all, alone=of.alone).files}
    assert followers >= OURS
    assert followers <= OURS | {"hamming"}  # which asks for our map


def test_recordings_follow_what_writes_them_and_no_reader() -> None:
    found = closure_of(record.__module__)
    files = {file.removeprefix("refseq/logs/") for file in found.files if file.startswith("refseq/logs/")}
    assert "foxglove/writer.py" in files
    assert not [file for file in files if file.startswith(("ros/", "pictures/", "pairing/", "trajectories/"))]
    assert not files & {"carmen.py", "kinds.py", "reader.py", "foxglove/source.py", "formats.py"}
    assert not {"rosbags", "mcap", "av", "networkx"} & set(found.versions)


@pytest.mark.slow
def test_every_file_that_is_reached_counts(
    made: Mapping[str, Closure], key_makers: Mapping[str, Callable[[], object]]
) -> None:
    all_keys(key_makers)
    assert len(made) >= len(KINDS)
    for closure in made.values():
        before = closure.digest
        for name, path in closure.files.items():
            content = path.read_bytes()
            path.write_bytes(content + b"\n")
            assert closure.digest != before, name
            path.write_bytes(content)


# --- what really runs ---


@pytest.fixture(scope="module")
def ran(logs: Path, tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, list[str]]:
    """Files in which code ran, by what was made meanwhile."""
    ended = subprocess.run(
        [sys.executable, traced.__file__, str(logs), str(tmp_path_factory.mktemp("traced"))],
        cwd=ROOT,
        env={"PYTHONPATH": str(ROOT), "PATH": "", FILE: os.environ[FILE]},
        check=True,
        capture_output=True,
        text=True,
    )
    return dict(json.loads(ended.stdout.splitlines()[-1]))


@pytest.mark.slow
@pytest.mark.parametrize("kind", traced.CLOSURES)
def test_all_code_that_runs_is_in_the_closure(kind: str, ran: Mapping[str, list[str]]) -> None:
    modules, alone = traced.CLOSURES[kind]
    reached = closure_of(*modules, alone=alone).files
    assert len(ran[kind]) > 10
    assert [file for file in ran[kind] if file not in reached] == []


# --- devices and logs ---


@pytest.mark.parametrize(
    ("renderer", "asked"), [("classic", "gl_device"), ("baked", "gl_device"), ("filament", "vulkan_driver")]
)
def test_drives_are_keyed_by_the_device_that_draws_them(
    renderer: str, asked: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def key(driver: object) -> str:
        monkeypatch.setattr(views, asked, lambda: driver)
        views.drawing_device.cache_clear()
        return recording_key(Drive(renderer=RendererKind(renderer)))

    drivers = [None, ("a card", "1.0", "egl"), ("a card", "1.1", "egl"), ("a card", "1.0", "osmesa")]
    try:
        assert len({key(driver) for driver in drivers}) == len(drivers)
        assert key(drivers[1]) == key(drivers[1])
    finally:
        views.drawing_device.cache_clear()


def test_a_drive_without_images_asks_for_no_device(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(views, "gl_device", lambda: pytest.fail("nothing is drawn"))
    monkeypatch.setattr(views, "vulkan_driver", lambda: pytest.fail("nothing is drawn"))
    assert recording_key(Drive(renderer=RendererKind.NONE))


def test_a_drive_is_keyed_by_the_content_of_the_files_that_it_names_wherever_they_lie(tmp_path: Path) -> None:
    def key(folder: str, plan: str, lens: str) -> str:
        world, camera = tmp_path / folder / "mine.toml", tmp_path / folder / "lens.toml"
        world.parent.mkdir(exist_ok=True)
        world.write_text(plan)
        camera.write_text(lens)
        return recording_key(Drive(world=str(world), cameras={"camera-1": str(camera)}, renderer=RendererKind.NONE))

    assert key("here", "plan", "lens") == key("there", "plan", "lens")
    assert len({key("here", *content) for content in (("plan", "lens"), ("other", "lens"), ("plan", "other"))}) == 3


def test_a_log_is_keyed_by_its_content(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("REFSEQ_RECORDINGS", "REFSEQ_CACHE"):
        monkeypatch.setenv(name, str(tmp_path))
    path = tmp_path / "run.log"
    path.write_text("FLASER")
    before, key = path.stat(), source_key(Log("run.log"))
    path.touch()
    assert source_key(Log("run.log")) == key
    path.write_text("ODOMET")
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert source_key(Log("run.log")) != key
    path.write_text("FLASER")
    assert source_key(Log("run.log")) == key
    assert source_key(Log("run.log", thin=1.0)) != key
