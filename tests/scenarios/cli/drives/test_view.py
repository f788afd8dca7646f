import os
import re
import shutil
import signal
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from rerun.chunk import RrdReader

from refseq.access.listener import free_port
from refseq.belief import Belief, Stage
from refseq.children import start_tied
from refseq.logs import RecordingWriter
from refseq.logs.beliefs import write_beliefs
from refseq.map.learning import learn
from refseq.map.localiser import localise
from refseq.map.map import beside
from refseq.planar import Pose
from refseq.view import View
from refseq.viewer.sinks import PROGRAM
from tests.refseq.rooms import named_maps
from tests.refseq.viewer.readback import entities, values, verified
from tests.scenarios.conftest import Refseq
from tests.support import corridor_comparison

COUNT = 10


def record(path: Path, views: tuple[View, ...]) -> None:
    with RecordingWriter(path, {}) as writer:
        for number, view in enumerate(views):
            writer.write(view, Pose(0.85 * number, 0.0, 0.0))


def by_name(answers: Mapping[Stage, list[Belief]]) -> dict[str, Sequence[Belief]]:
    return {stage.value: found for stage, found in answers.items()}


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two drives, the map and an atlas of the first, and what two localisers made of the second."""
    home = tmp_path_factory.mktemp("views")
    drives = corridor_comparison(seed=3, count=COUNT, size=160)
    record(home / "first.mcap", tuple(drives.reference_views))
    record(home / "second.mcap", tuple(drives.query_views))
    sequence = learn(drives.reference_views)
    sequence.save(home / "map.refseq")
    atlas = beside(named_maps(["there", "again"], [sequence, learn(drives.query_views)]))
    atlas.save(home / "atlas.refseq")
    answers = by_name(localise(sequence, drives.query_views))
    write_beliefs(home / "all.parquet", drives.query_views, answers)
    write_beliefs(home / "prior.parquet", drives.query_views, {Stage.PRIOR: answers[Stage.PRIOR]})
    write_beliefs(home / "atlas.parquet", drives.query_views, by_name(localise(atlas, drives.query_views)))
    return home


@pytest.fixture(autouse=True)
def at_the_desk(desk: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(desk)
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setenv("RUST_LOG", "off")


@pytest.mark.slow_cases(
    "map.refseq second.mcap all.parquet-expected4",
    "map.refseq second.mcap all.parquet prior.parquet-expected6",
    "map.refseq map.refseq second.mcap all.parquet prior.parquet-expected7",
)
@pytest.mark.parametrize(
    ("files", "expected"),
    [
        ("second.mcap", {"/now/forward", "/laser/scan", "/plan/drive"}),
        ("map.refseq", {"/map/places/fim/map/ones", "/map/places/bars", "/map/places/plan/places"}),
        ("map.refseq --reference first.mcap", {"/map/places/frames/forward", "/map/places/scan"}),
        ("atlas.refseq", {"/map/places/fim/there/ones", "/map/places/fim/again/ones"}),
        ("map.refseq second.mcap all.parquet", {"/map/places/bars", "/history/all/chain", "/keys/all/forward/matched"}),
        ("second.mcap all.parquet map.refseq --reference first.mcap", {"/place/all/lateral"}),
        ("map.refseq second.mcap all.parquet prior.parquet", {"/history/all/chain", "/history/prior/prior"}),
        ("map.refseq map.refseq second.mcap all.parquet prior.parquet", {"/history/prior/prior"}),
        ("atlas.refseq second.mcap atlas.parquet", {"/history/atlas/chain", "/posterior/atlas/uniform/belief"}),
    ],
)
def test_whatever_is_given_is_shown(refseq: Refseq, tmp_path: Path, files: str, expected: set[str]) -> None:
    answer = refseq("view", *files.split(), "-o", tmp_path / "show.rrd")
    assert answer.code == 0, answer.err
    assert answer.err == ""
    assert expected <= entities(tmp_path / "show.rrd")
    assert verified(tmp_path / "show.rrd")
    assert list(tmp_path.iterdir()) == [tmp_path / "show.rrd"]


def test_answers_shown_are_those_of_the_table(refseq: Refseq, tmp_path: Path, desk: Path) -> None:
    from refseq.logs.beliefs import read_beliefs

    refseq("view", "map.refseq", "second.mcap", "all.parquet", "-o", tmp_path / "a.rrd")
    for stage, answers in read_beliefs(desk / "all.parquet").items():
        bars = values(tmp_path / "a.rrd", f"/posterior/all/{stage}/belief", "BarChart:values", "view")
        assert [bar[0]["buffer"] for bar in bars] == [answer.places.tolist() for answer in answers]


def test_the_same_files_twice_compare_equal(refseq: Refseq, tmp_path: Path) -> None:
    for name in ("a.rrd", "b.rrd"):
        assert refseq("view", "map.refseq", "second.mcap", "all.parquet", "-o", tmp_path / name).code == 0
    words = [*PROGRAM, "rrd", "compare", str(tmp_path / "a.rrd"), str(tmp_path / "b.rrd")]
    assert subprocess.run(words, capture_output=True, check=False).returncode == 0


def test_layers_are_files_of_one_recording(refseq: Refseq, tmp_path: Path) -> None:
    folder = tmp_path / "deep" / "show"
    tables = ("all.parquet", "prior.parquet")
    answer = refseq("view", "map.refseq", "second.mcap", *tables, "--layers", folder)
    assert answer.code == 0, answer.err
    paths = [folder / name for name in ("drive.rrd", "all.rrd", "prior.rrd")]
    assert sorted(folder.iterdir()) == sorted(paths)
    assert {RrdReader(path).recordings()[0].recording_id for path in paths} == {
        RrdReader(paths[0]).recordings()[0].recording_id
    }
    assert "/now/forward" in entities(paths[0])
    assert not any(entity.startswith("/history") for entity in entities(paths[0]))
    assert "/history/prior/prior" in entities(paths[2])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("second.mcap", "no display: DISPLAY and WAYLAND_DISPLAY are unset"),
        ("second.mcap --connect rerun+http://127.0.0.1:1/proxy", "viewer rerun+http://127.0.0.1:1/proxy: nobody answ"),
        ("second.mcap --connect nobody", "viewer 'nobody': is no viewer's address; valid is rerun+http://HOST:PORT/pr"),
        ("second.mcap -o a.rrd --serve 9090", "--output and --serve exclude each other; valid is one of them, or none"),
        ("second.mcap --layers new", "--layers: there is no localiser's answer"),
        ("first.mcap second.mcap -o new.rrd", "first.mcap second.mcap: valid is a recording, a map (.refseq), or"),
        ("map.refseq second.mcap -o new.rrd", "map.refseq second.mcap: valid is a recording, a map (.refseq), or"),
        ("map.refseq all.parquet -o new.rrd", "map.refseq all.parquet: valid is a recording, a map (.refseq), or"),
        ("map.refseq map.refseq map.refseq second.mcap all.parquet all.parquet -o n.rrd", "one map for all or one"),
        ("map.refseq second.mcap all.parquet all.parquet -o new.rrd", "all.parquet: two tables have this name"),
        ("map.refseq second.mcap no.parquet -o new.rrd", "no.parquet: is no file; valid is a table of beliefs"),
        ("atlas.refseq second.mcap all.parquet -o new.rrd", "all.parquet: comparison"),
        ("map.refseq --reference cut.mcap -o new.rrd", "cut.mcap: has no view at 8.000000 s, as view 4 of"),
        ("missing.mcap -o new.rrd", "missing.mcap: cannot be read: No such file or directory"),
    ],
)
def test_what_cannot_be_shown_is_one_line_and_leaves_nothing(refseq: Refseq, desk: Path, words: str, said: str) -> None:
    if not (desk / "cut.mcap").exists():
        record(desk / "cut.mcap", tuple(corridor_comparison(seed=3, count=4, size=24).query_views))
    before = sorted(desk.iterdir())
    answer = refseq("view", *words.split())
    assert answer.code == 2
    assert answer.err.startswith("error: ")
    assert said in answer.err
    assert answer.err.count("\n") == 1
    assert sorted(desk.iterdir()) == before


def test_a_port_that_is_taken_is_one_line(refseq: Refseq) -> None:
    import socket

    with socket.create_server(("127.0.0.1", 0)) as server:
        answer = refseq("view", "second.mcap", "--serve", str(server.getsockname()[1]))
    assert answer.code == 2
    assert re.fullmatch(
        r"error: port \d+ cannot be served from: Address already in use; valid is a free port\n", answer.err
    )


@contextmanager
def serving_page(desk: Path) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """`refseq view --serve` as a process, and its page, which answers."""
    script = "import sys; from refseq_bench.scenarios.cli.app import main; sys.argv[0] = 'refseq'; main()"
    words = [sys.executable, "-c", script, "view", "second.mcap", "--serve", str(free_port())]
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[4]), "PYTHONUNBUFFERED": "1"}
    serving = subprocess.Popen(
        words, cwd=desk, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    try:
        assert serving.stdout is not None
        line = serving.stdout.readline()
        page = re.search(r"http://127\.0\.0\.1:\d+/\?token=\w+", line)
        assert page, line + (serving.stderr.read() if serving.stderr and serving.poll() is not None else "")
        with urllib.request.build_opener(urllib.request.HTTPCookieProcessor()).open(page[0], timeout=20) as answer:
            assert answer.status == 200
        yield serving, page[0]
    finally:
        serving.kill()


def test_a_browser_is_served_until_interrupted(desk: Path) -> None:
    with serving_page(desk) as (serving, _):
        serving.send_signal(signal.SIGINT)
        said = serving.communicate(timeout=60)
        assert (serving.returncode, said[1]) == (0, "")


@pytest.mark.quick_cases("9")
@pytest.mark.parametrize("how", [signal.SIGTERM, signal.SIGKILL])
def test_no_page_outlives_the_command_that_serves_it(desk: Path, how: signal.Signals) -> None:
    with serving_page(desk) as (serving, page):
        serving.send_signal(how)
        serving.wait(60)
        end = time.monotonic() + 20
        while time.monotonic() < end:
            try:
                urllib.request.urlopen(page.partition("?")[0], timeout=20).close()
            except urllib.error.HTTPError:
                pass
            except OSError:
                return
            time.sleep(0.05)
        pytest.fail(f"{page} still answers")


def test_a_viewer_that_goes_away_half_way_is_one_line(
    refseq: Refseq, desk: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Rerun's own server takes the drive's first views, and is killed before the last."""
    from refseq.viewer import drive_log, sinks, watched

    hidden = sinks.HiddenPort()
    server = start_tied([*PROGRAM, "--serve-grpc", *hidden.words])
    sinks._wait(server, hidden)
    logged = drive_log.DriveLog.update
    seen: list[int] = []

    def killing(log: drive_log.DriveLog, view: View) -> Pose | None:
        seen.append(1)
        if len(seen) == COUNT // 2:
            assert watched.gone(log.stream, 10.0) is None
            os.killpg(server.pid, signal.SIGKILL)
            server.wait()
            time.sleep(0.2)
        return logged(log, view)

    monkeypatch.setattr(drive_log.DriveLog, "update", killing)
    answer = refseq("view", "second.mcap", "--connect", hidden.address)
    assert len(seen) == COUNT
    assert answer.code == 2
    assert re.fullmatch(r"error: viewer \S+: went away before it had all of 'second.mcap': .+\n", answer.err)


@pytest.mark.slow
@pytest.mark.parametrize("files", ["map.refseq", "map.refseq second.mcap all.parquet", "second.mcap"])
def test_every_tab_is_drawn(refseq: Refseq, tmp_path: Path, files: str) -> None:
    """Needs a Vulkan driver, and is not waited for long: what Rerun draws is Rerun's."""
    if not shutil.which("vulkaninfo") and not list(Path("/usr/share/vulkan/icd.d").glob("*.json")):
        pytest.skip("no Vulkan driver: the viewer cannot draw")
    import cv2

    assert refseq("view", *files.split(), "-o", tmp_path / "a.rrd").code == 0
    words = [*PROGRAM, str(tmp_path / "a.rrd"), "--headless", "--window-size", "1280x800"]
    words += ["--port", str(free_port()), "--screenshot-to", str(tmp_path / "a.png")]
    try:
        subprocess.run(words, capture_output=True, timeout=90, check=False)
    except subprocess.TimeoutExpired:
        pytest.skip("the viewer drew nothing within 90 s")
    picture = cv2.imread(str(tmp_path / "a.png"))
    assert picture is not None
    assert picture.shape[1] / picture.shape[0] == 1280 / 800
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 100
