"""The command line as a user meets it: what is said, where, and with which exit code."""

import json
import os
import re
import signal
import subprocess
import sys
import time
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from refseq.logs import read_recording
from refseq_bench.scenarios.cli.app import exit_code
from refseq_bench.sim.bench.bench import Bench
from tests.scenarios.conftest import Refseq
from tests.worlds.conftest import SMALL

DOOR = """
[[door]]
name = "exit"
wall = "left"
at = 7.8
width = 0.9
material = "door"
"""
COMMANDS = ("record", "learn", "localise", "live", "drive", "compare", "report", "view", "demo", "doctor")
LASER_ONLY = ("--renderer", "none")


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a plan, a recording of its laser, the map of it, and beliefs; and much that is none of these."""
    home = tmp_path_factory.mktemp("desk")
    (home / "small.toml").write_text(SMALL.format(top="", end=""))
    (home / "door.toml").write_text(SMALL.format(top="", end="") + DOOR)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(home)
        for line in (
            "record small.toml --renderer none --distance 0.4 -o run.mcap",
            "learn run.mcap --features walls,boundary,sectors -o map.refseq",
            "localise map.refseq run.mcap -o beliefs.parquet",
        ):
            assert exit_code(line.split()) == 0
    spoil(home)
    return home


def environment() -> dict[str, str]:
    root = str(Path(__file__).parents[3])
    return {**os.environ, "PYTHONPATH": os.pathsep.join([root, os.environ.get("PYTHONPATH", "")]), "COLUMNS": "80"}


def spoil(home: Path) -> None:
    recording = (home / "run.mcap").read_bytes()
    (home / "cut-early.mcap").write_bytes(recording[:200])
    (home / "cut.mcap").write_bytes(recording[:20000])
    (home / "empty.mcap").write_bytes(b"")
    (home / "noise.mcap").write_bytes(bytes(range(256)) * 20)
    (home / "stand.log").write_text("FLASER 3 1.0 2.0 3.0 0 0 0 0 0 0 1 h 1\n" * 2)
    (home / "short.log").write_text("# a comment\nPARAM robot_name x 0 host 0\nFLASER 3 1.0 2.0\n")
    (home / "prose.log").write_text("hello world\n")
    (home / "folder").mkdir()
    with zipfile.ZipFile(home / "map.refseq") as old, zipfile.ZipFile(home / "version-9.refseq", "w") as new:
        for name in old.namelist():
            content = old.read(name)
            new.writestr(name, json.dumps({**json.loads(content), "version": 9}) if name == "map.json" else content)
    table = pq.read_table(home / "beliefs.parquet")
    pq.write_table(pa.table({"a": [1]}), home / "other.parquet")
    pq.write_table(table.slice(0, 20), home / "few.parquet")
    pq.write_table(table.slice(0, 0), home / "none.parquet")
    numbers = pa.array([1] * table.num_rows)
    pq.write_table(table.set_column(table.column_names.index("method"), "method", numbers), home / "magic.parquet")


@pytest.fixture
def at_desk(desk: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Work in that folder, and find it as it was afterwards."""
    monkeypatch.chdir(desk)
    before = inventory(desk)
    yield desk
    assert inventory(desk) == before, "a command that refused its input must leave nothing behind"


def inventory(folder: Path) -> dict[str, int]:
    return {str(path.relative_to(folder)): path.stat().st_mtime_ns for path in folder.rglob("*") if path.is_file()}


RECORD = "record small.toml --renderer none -o new.mcap"
BAD_INPUT = [
    # names that are unknown
    ("record nowhere -o new.mcap", "unknown world 'nowhere'; known are annex, "),
    (f"{RECORD} --robot r2d2", "unknown robot 'r2d2': valid are robuter, segway_rmp, segway_rmp-tractor"),
    (f"{RECORD} --light dusk", "unknown light 'dusk'; known are morning, noon, 16:00, 18:00, overcast, late-evening, "),
    (f"{RECORD} --light 18:00,cloud=2", "light '18:00,cloud=2': cloud '2' is not valid; it should be a share from 0"),
    (f"{RECORD} --change rain=1", "change 'rain=1': unknown 'rain=1'; valid is none, few, busy, or any of people=0..1"),
    (f"{RECORD} --camera wide", "camera 'wide': valid is a name, '=' and a value"),
    (
        f"{RECORD} --camera camera-9=fire-i",
        "unknown camera 'camera-9' of robot 'robuter': valid are camera-1, camera-2",
    ),
    (
        f"{RECORD} --camera camera-1=pixie",
        "unknown camera 'pixie': valid are fire-i, fire-i-wide, or a path to a .toml",
    ),
    (f"{RECORD} --route up", "unknown route 'up' in world 'small': valid are forward"),
    (f"{RECORD} --sensors sonar", "sensor 'sonar' is not on robot 'robuter'; valid are camera-1, camera-2, laser"),
    (f"{RECORD} --sensors camera-1", "renderer 'none' takes no images; valid is to record the laser as well"),
    (f"{RECORD} --sensors laser,,", "sensors 'laser,,': a name is empty; valid are names with commas between"),
    ("learn run.mcap -o new.refseq --sensors sonar", "run.mcap: sensor 'sonar' is not in the drive; valid are laser"),
    (
        "learn run.mcap -o new.refseq --features magic",
        "feature 'magic' is unknown; valid are sift, neural, dense, walls, doors",
    ),
    ("learn run.mcap -o new.refseq --features ,", "features ',': a name is empty; valid are names with commas"),
    ("learn run.mcap -o new.refseq --features sift", "features sift do not fit sensors laser; valid are walls"),
    ("localise map.refseq run.mcap --stage magic", "stage 'magic' is unknown; valid are uniform, prior, chain"),
    ("localise map.refseq run.mcap --sensors sonar", "map.refseq: sensor 'sonar' is not in the map; valid are laser"),
    ("learn run.mcap -o new.refseq --profile magic", "profile 'magic' is unknown; valid are thesis, counting, best"),
    ("demo -o new --profile magic", "profile 'magic' is unknown; valid are thesis, counting, best"),
    ("compare run.mcap", "run.mcap: comes without a query; valid are pairs of a reference"),
    ("compare run.mcap nothing.mcap", "nothing.mcap: is no file; valid is a recording"),
    ("compare run.mcap run.mcap --methods magic", "method 'magic' is unknown; valid are thesis/uniform, thesis/prior"),
    ("compare run.mcap run.mcap --first-view 120%", "run.mcap: first view '120%' is not in it; valid are 0 to "),
    ("compare run.mcap run.mcap --first-view soon", "run.mcap: first view 'soon' is not in it; valid are 0 to "),
    ("compare run.mcap run.mcap --kidnap 0:1", "run.mcap: kidnap '0:1' is not in it; valid is FROM:TO"),
    ("compare run.mcap run.mcap --places 5", "run.mcap: views '5' is no stretch of it; valid is FROM:TO within 0:"),
    ("compare run.mcap run.mcap -o new.txt", "new.txt: is no name of a table; valid is one that ends in .csv"),
    ("demo --world nowhere -o new", "unknown world 'nowhere'; known are annex, "),
    ("demo --query-light dusk -o new", "unknown light 'dusk'; known are morning, noon, 16:00, "),
    ("demo --light dusk -o new", "unknown light 'dusk'; known are morning, noon, 16:00, "),
    ("demo --robot r2d2 -o new", "unknown robot 'r2d2': valid are robuter, segway_rmp, segway_rmp-tractor"),
    # options that are said twice, or that say nothing
    (
        f"{RECORD} --camera camera-1=a --camera camera-1=b",
        "camera 'camera-1=a, camera-1=b': camera-1 is named twice; valid",
    ),
    (
        "record door.toml -o new.mcap --sensors laser,laser",
        "sensors 'laser,laser': laser is named twice; valid is once",
    ),
    (
        "record door.toml -o new.mcap --sensors laser --camera camera-2=fire-i-wide",
        "--camera camera-2=fire-i-wide: has no effect, as camera-2 is not among --sensors laser; valid is to ask for",
    ),
    # numbers out of range
    (
        f"{RECORD} --distance -1",
        "--distance -1 is not valid; it should be above 0 and finite, or 0 for none by distance",
    ),
    (
        f"{RECORD} --distance nan",
        "--distance nan is not valid; it should be above 0 and finite, or 0 for none by distance",
    ),
    (f"{RECORD} --distance 0", "trigger: distance, turn and time are all off; valid is at least one of them"),
    (f"{RECORD} --start 99", "start 99.0 m and end 6 m are no stretch of route"),
    (f"{RECORD} --time inf", "--time inf is not valid; it should be above 0 and finite"),
    (
        "learn run.mcap -o new.refseq --thin inf",
        "thin inf is not valid; valid is a finite number of 0 or more [METRES]",
    ),
    (
        "learn run.mcap -o new.refseq --tolerance inf",
        "tolerance inf is not valid; valid is a finite number of 0 or more",
    ),
    (
        "learn run.mcap -o new.refseq --late laser=1e300",
        "late '1e300' is not valid; valid are numbers up to 8589934592 ",
    ),
    ("learn run.mcap -o new.refseq --late laser=nan", "late 'nan' is not valid; valid are numbers up to 8589934592 "),
    (
        "learn run.mcap -o new.refseq --late laser=0,12",
        "late '0,12' has a decimal comma; valid are decimal points, as ",
    ),
    ("learn run.mcap -o new.refseq --late laser=-0,12,truth=1", "late '-0,12' has a decimal comma; valid are decimal"),
    ("learn run.mcap -o new.refseq --views 5:2", "run.mcap: views '5:2' is no stretch of it; valid is FROM:TO within"),
    ("localise map.refseq run.mcap --views 0:999", "run.mcap: views '0:999' is no stretch of it; valid is FROM:TO"),
    ("view run.mcap -o new.rrd --views abc", "run.mcap: views 'abc' is no stretch of it; valid is FROM:TO"),
    # files that cannot be read
    ("record missing.toml -o new.mcap", "missing.toml: cannot be read: No such file or directory"),
    (
        "record door.toml -o new.mcap",
        "door.toml: door[0].at: 7.8: door 'exit' spans 7.35 to 8.25 m, outside wall 'left' (0 to 8 m); "
        "valid is 0.45 to 7.55",
    ),
    ("learn missing.mcap -o new.refseq", "missing.mcap: cannot be read: No such file or directory"),
    ("learn folder -o new.refseq", "folder: is a folder that holds no log; valid are "),
    ("learn cut-early.mcap -o new.refseq", "cut-early.mcap: is cut off or damaged before its first view"),
    ("learn empty.mcap -o new.refseq", "empty.mcap: is empty; valid are a ROS bag, an MCAP recording"),
    ("learn noise.mcap -o new.refseq", "noise.mcap: is neither MCAP (its magic bytes are missing) nor text; valid"),
    ("learn short.log -o new.refseq", "short.log: topic /laser: line 3, FLASER, is not readable, the only one: has"),
    (
        "learn stand.log -o new.refseq",
        "stand.log: a map would have 2 places over 0.0 m: the odometry never moves; valid",
    ),
    (
        "learn prose.log -o new.refseq",
        "prose.log: is text, so a CARMEN log, and holds no scan (kinds of lines seen: hello); valid are FLASER",
    ),
    ("localise missing.refseq run.mcap", "missing.refseq: cannot be read: No such file or directory"),
    (
        "localise run.mcap run.mcap",
        "run.mcap: is a log (a Foxglove MCAP file), no map; valid is a map (.refseq): is it in",
    ),
    (
        "localise map.refseq map.refseq",
        "map.refseq: is a map (.refseq), no log; valid are a ROS bag, an MCAP recording",
    ),
    (
        "localise run.mcap map.refseq",
        "run.mcap: is a log (a Foxglove MCAP file), no map; valid is a map (.refseq): is it in",
    ),
    ("localise prose.log run.mcap", "prose.log: is not a .refseq map, or is damaged"),
    (
        "localise version-9.refseq run.mcap",
        "version-9.refseq: is of map format version 9; valid is 4: a newer",
    ),
    ("report map.refseq run.mcap missing.parquet -o new.html", "missing.parquet: is no file; valid is a table of"),
    ("report map.refseq run.mcap folder -o new.html", "folder: is no file; valid is a table of beliefs (.parquet)"),
    ("report map.refseq run.mcap run.mcap -o new.html", "run.mcap: is no table of beliefs"),
    ("report map.refseq run.mcap other.parquet -o new.html", "other.parquet: is no table of beliefs: column 'method'"),
    ("report map.refseq run.mcap magic.parquet -o new.html", "magic.parquet: column 'method' holds int64; valid is"),
    ("report map.refseq run.mcap none.parquet -o new.html", "none.parquet: holds no belief; valid is one a view of"),
    ("map matrix missing.refseq", "missing.refseq: cannot be read: No such file or directory"),
    *(
        (line, "run.mcap: is a log (a Foxglove MCAP file), no map; valid is a map (.refseq): make it by `refseq learn`")
        for line in (
            "map matrix run.mcap",
            "map similarity map.refseq run.mcap",
            "map merge map.refseq run.mcap -o new.refseq",
            "map compact run.mcap -o new.refseq",
            "map plan run.mcap",
            "map route run.mcap a:0 a:1",
            "map channel run.mcap run.mcap",
            "map paths run.mcap run.mcap",
        )
    ),
    ("map add map.refseq run.mcap -o new.refseq", "map.refseq: its matching is "),
    ("map matrix empty.mcap", "empty.mcap: is not a .refseq map, or is damaged"),
    (
        "map matrix version-9.refseq",
        "version-9.refseq: is of map format version 9; valid is 4: a newer",
    ),
    ("compare missing.mcap run.mcap", "missing.mcap: is no file; valid is a recording"),
    ("compare folder run.mcap", "folder: is a folder that holds no log; valid are "),
    ("compare run.mcap empty.mcap", "empty.mcap: is empty; valid are a ROS bag, an MCAP recording"),
    # files that do not fit each other
    ("compare run.mcap run.mcap cut.mcap", "cut.mcap: comes without a query; valid are pairs of a reference and a"),
    ("report map.refseq run.mcap few.parquet -o new.html", "few.parquet: comparison 'map.refseq ← run.mcap', stage"),
    ("report map.refseq run.mcap beliefs.parquet --views 0:3 -o new.html", "'--views' of 'refseq report' is unknown"),
    ("view map.refseq run.mcap few.parquet -o new.rrd", "5 answers; valid is one a query view, 15"),
    ("view run.mcap map.refseq -o new.rrd", "run.mcap map.refseq: valid is a recording, a map (.refseq), or map,"),
    # results that cannot be written
    ("record small.toml --renderer none -o folder", "folder: is a folder; valid is the name of a recording to write"),
    ("record small.toml --renderer none -o run.mcap/x.mcap", "run.mcap/x.mcap: cannot be written: run.mcap is no"),
    ("demo --world small.toml --renderer none -o run.mcap", "run.mcap: is no folder; valid is the name of a folder"),
    ("learn run.mcap -o folder", "folder: is a folder; valid is the name of a file to write"),
    ("learn run.mcap -o missing/new.refseq", "missing/new.refseq: cannot be written: there is no folder missing"),
    ("learn run.mcap -o run.mcap/new.refseq", "run.mcap/new.refseq: cannot be written: run.mcap is no folder"),
    ("localise map.refseq run.mcap -o folder", "folder: is a folder; valid is the name of a file to write"),
    ("localise map.refseq run.mcap -o missing/b.parquet", "missing/b.parquet: cannot be written: there is no folder"),
    ("map matrix map.refseq -o folder", "folder: is a folder; valid is the name of a file to write"),
    ("map matrix map.refseq -o missing/m.png", "missing/m.png: cannot be written: there is no folder missing"),
    ("map matrix map.refseq -o m.txt", "m.txt: is no name of a picture; valid is one that ends in .png, .svg or .pdf"),
    ("report map.refseq run.mcap beliefs.parquet -o folder", "folder: is a folder; valid is the name of a file"),
    ("report map.refseq run.mcap beliefs.parquet -o missing/r.html", "missing/r.html: cannot be written: there is no"),
    ("view run.mcap -o missing/new.rrd", "missing/new.rrd: cannot be written: there is no folder missing"),
    ("view run.mcap -o folder", "folder: is a folder; valid is the name of a file to write"),
]


@pytest.mark.parametrize(("line", "message"), BAD_INPUT, ids=[line for line, _ in BAD_INPUT])
def test_bad_input_is_one_line_and_code_2(refseq: Refseq, at_desk: Path, line: str, message: str) -> None:
    answer = refseq(*line.split())
    assert answer.code == 2
    assert answer.out == ""
    assert len(answer.err.splitlines()) == 1
    assert answer.err.startswith("error: ")
    assert message in answer.err


def test_a_folder_without_write_access_is_told(refseq: Refseq, at_desk: Path, tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    if os.access(tmp_path, os.W_OK):
        pytest.skip("this user may write everywhere")
    try:
        answers = [
            refseq("learn", "run.mcap", "-o", tmp_path / "new.refseq"),
            refseq("record", "small.toml", *LASER_ONLY, "-o", tmp_path / "new.mcap"),
        ]
    finally:
        tmp_path.chmod(0o700)
    for answer in answers:
        assert answer.code == 2
        assert len(answer.err.splitlines()) == 1
        assert str(tmp_path) in answer.err


def test_an_error_that_nobody_foresaw_comes_with_its_trace(
    refseq: Refseq, at_desk: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(Bench, "sense", broken)
    with pytest.raises(ZeroDivisionError):
        refseq(*RECORD.split())


def test_a_recording_that_was_cut_off_is_used_and_told(refseq: Refseq, desk: Path, tmp_path: Path) -> None:
    views = len(read_recording(desk / "cut.mcap").views)
    assert 1 < views < 15
    answer = refseq("learn", desk / "cut.mcap", "-o", tmp_path / "m.refseq")
    assert answer.code == 0
    assert re.fullmatch(
        rf"note: \S+cut.mcap is incomplete \(unexpected end of file\); its {views} views are used\n", answer.err
    )
    assert f"{views} places over" in answer.out
    answer = refseq("localise", tmp_path / "m.refseq", desk / "run.mcap")
    assert "m.refseq: m was learnt from an incomplete drive (unexpected end of file)" in answer.err


def test_a_long_name_with_brackets_stays_one_line(refseq: Refseq, desk: Path, tmp_path: Path) -> None:
    odd = tmp_path / f"[bold]{'long' * 20}[" / "nothing].refseq"
    odd.parent.mkdir()
    answer = refseq("learn", desk / "run.mcap", "-o", odd)
    assert answer.code == 0
    assert odd.exists()
    assert answer.out.startswith(f"{odd}: 15 places over")
    assert len(answer.out.splitlines()) == 1
    assert refseq("localise", odd, desk / "run.mcap").code == 0


# --- what goes well ---


def test_help_of_every_command_has_examples_within_80_columns(refseq: Refseq, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    overview = refseq("--help").out
    for command in COMMANDS:
        assert command in overview
        said = refseq(command, "--help")
        assert said.code == 0
        assert max(map(len, said.out.splitlines())) <= 80
        assert "…" not in said.out, "a name or value is cut off"
        assert command == "doctor" or f"refseq {command}" in said.out.partition("Example")[2]


def test_the_version_is_printed(refseq: Refseq) -> None:
    assert re.fullmatch(r"\d+\.\d+\.\d+\S*\n", refseq("--version").out)


def test_stages_views_and_thinning_are_taken(refseq: Refseq, desk: Path, tmp_path: Path) -> None:
    answer = refseq("localise", desk / "map.refseq", desk / "run.mcap", "--stage", "prior", "--views", "2:8")
    assert answer.code == 0
    assert "6 views" in answer.out
    assert "prior" in answer.out
    assert "chain" not in answer.out
    thinned = refseq("learn", desk / "run.mcap", "--thin", "0.8", "-o", tmp_path / "m.refseq")
    assert "8 places over" in thinned.out


def test_the_table_of_results_keeps_within_80_columns(
    refseq: Refseq, desk: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    answer = refseq("localise", desk / "map.refseq", desk / "run.mcap")
    rows = [line for line in answer.out.splitlines() if line.split()[:1] in (["uniform"], ["prior"], ["chain"])]
    assert len(rows) == 3
    assert all(row.count(" of 15") == 2 for row in rows), "no cell is broken over two lines"


def test_at_least_decides_between_0_and_1(refseq: Refseq, desk: Path) -> None:
    localise = ("localise", desk / "map.refseq", desk / "run.mcap", "--stage", "prior", "--at-least")
    share = float(re.search(r"prior +(\d+\.\d) %", refseq(*localise, "0").out)[1])  # type: ignore[index]
    assert 0 < share <= 100
    assert refseq(*localise, str(share - 1)).code == 0
    if share < 100:
        below = refseq(*localise, "100")
        assert below.code == 1
        assert below.err.startswith("below what was asked: ")
    unknown = refseq("localise", desk / "map.refseq", desk / "run.mcap", "--stage", "uniform", "--at-least", "100")
    assert unknown.code == 1


@pytest.mark.slow
def test_a_drive_is_reported_and_shown_from_its_files(refseq: Refseq, desk: Path, tmp_path: Path) -> None:
    files = (desk / "map.refseq", desk / "run.mcap", desk / "beliefs.parquet")
    assert refseq("report", *files, "-o", tmp_path / "r.html").code == 0
    assert refseq("view", *files, "-o", tmp_path / "s.rrd").code == 0
    assert refseq("view", desk / "run.mcap", "-o", tmp_path / "run.rrd").code == 0
    assert refseq("view", desk / "map.refseq", "-o", tmp_path / "map.rrd").code == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["map.rrd", "r.html", "run.rrd", "s.rrd"]
    assert (tmp_path / "r.html").read_text().startswith("<!")


def test_a_matrix_is_described_and_drawn(
    refseq: Refseq, desk: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    picture = tmp_path / "m.png"
    answer = refseq("map", "matrix", desk / "map.refseq", "-o", picture, "--top", "3")
    assert answer.code == 0
    assert picture.read_bytes().startswith(b"\x89PNG")
    for words in ("walls/laser", "boundary/laser", "sectors/laser", "all", "features at 15 places", "of 3.91 bits"):
        assert words in answer.out
    assert "The 3 features that tell the most" in answer.out
    assert "…" not in answer.out, "no cell is cut off"
    assert "tell the most" not in refseq("map", "matrix", desk / "map.refseq", "--top", "0").out


# --- stopping it ---


@pytest.fixture
def driving(tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    """A long drive that has begun to record ``long.mcap``."""
    plan = SMALL.format(top="", end="").replace("[8, ", "[300, ").replace("[7, 0]", "[299, 0]")
    (tmp_path / "long.toml").write_text(plan)
    script = "import sys; from refseq_bench.scenarios.cli.app import main; sys.argv[0] = 'refseq'; main()"
    words = ["record", "long.toml", *LASER_ONLY, "--distance", "0.2", "-o", "long.mcap"]
    process = subprocess.Popen(
        [sys.executable, "-c", script, *words],
        cwd=tmp_path,
        env=environment(),
        stderr=subprocess.PIPE,
        text=True,
    )
    written, limit = tmp_path / "long.partial.mcap", time.monotonic() + 60
    while time.monotonic() < limit and process.poll() is None:
        if written.exists() and written.stat().st_size > 30_000:
            break
        time.sleep(0.02)
    yield process
    if process.poll() is None:
        process.kill()
    process.wait()


def test_ctrl_c_leaves_a_readable_recording_and_says_so(driving: subprocess.Popen[str], tmp_path: Path) -> None:
    driving.send_signal(signal.SIGINT)
    _, said = driving.communicate(timeout=60)
    assert driving.returncode == 130
    kept = read_recording(tmp_path / "long.partial.mcap")
    assert not kept.complete
    holds = f"long.partial.mcap holds {len(kept.views)} views, incomplete: use it as it is, or record again"
    assert said == f"interrupted: {holds}\n"
    assert {path.name for path in tmp_path.iterdir()} == {"long.toml", "long.partial.mcap"}


def test_a_killed_recording_is_readable_up_to_its_last_view(
    driving: subprocess.Popen[str], tmp_path: Path, refseq: Refseq
) -> None:
    driving.kill()
    driving.communicate(timeout=60)
    assert driving.returncode == -signal.SIGKILL
    assert not (tmp_path / "long.mcap").exists()
    recording = read_recording(tmp_path / "long.partial.mcap")
    assert not recording.complete
    assert len(recording.views) > 5
    assert all(view.scan is not None for view in recording.views[:-1])
    answer = refseq("view", tmp_path / "long.partial.mcap", "-o", tmp_path / "long.rrd")
    assert answer.code == 0
    assert "long.partial.mcap is incomplete (unexpected end of file); its" in answer.err


@pytest.mark.parametrize("words", [["log", "info", "a" * 5000], ["record", "hallway", "-o", "9" * 300]])
def test_name_that_no_file_can_have_is_told_in_one_line(refseq: Refseq, words: list[str]) -> None:
    answer = refseq(*words)
    assert (answer.code, answer.out, answer.err.count("\n")) == (2, "", 1)
    assert "too long" in answer.err


@pytest.mark.parametrize(
    "words",
    ["--help", "--version", "world", "world list", "world list --json", "world generate --help", "nonsense"],
)
def test_where_nobody_reads_any_more_every_command_ends_alike_and_says_nothing(words: str) -> None:
    """As ``refseq … | head -1`` with ``set -o pipefail`` does; errors are read no more where both go into the pipe."""
    reader, writer = os.pipe()
    os.close(reader)
    script = "import sys; from refseq_bench.scenarios.cli.start import main; sys.argv[0] = 'refseq'; main()"
    command = [sys.executable, "-c", script, *words.split()]
    apart = words != "nonsense"
    told = subprocess.run(
        command, stdout=writer, stderr=subprocess.PIPE if apart else writer, env=environment(), check=False
    )
    os.close(writer)
    assert (told.returncode, told.stderr or b"") == (141, b"")
