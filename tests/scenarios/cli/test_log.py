"""`refseq log` as a robot's owner uses it: what is printed, what is written, and how it ends."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from refseq.logs import RecordingWriter
from refseq.planar import Pose
from refseq_bench.scenarios.cli.app import exit_code
from tests.support import corridor_drive

SPACING = 0.25


def write(path, views, metadata=None):
    with RecordingWriter(path, metadata or {"robot": "mine"}) as writer:
        for number, view in enumerate(views):
            writer.write(view, Pose(3.0 + SPACING * number, 2.0, 0.0))
    return path


@pytest.fixture(scope="module")
def views():
    drive = corridor_drive(np.random.default_rng(0), count=40, spacing=SPACING, size=24)
    return [replace(view, truth=replace(view.truth, y=view.truth.y + 0.3)) for view in drive]


@pytest.fixture
def drive(tmp_path, views):
    return write(tmp_path / "drive.mcap", views)


def run(capsys, *words) -> tuple[int, str, str]:
    code = exit_code(["log", *map(str, words)])
    told = capsys.readouterr()
    return code, told.out, told.err


def test_info_tells_topics_rates_and_how_a_drive_was_made(drive, capsys):
    code, out, _ = run(capsys, "info", drive)
    assert code == 0
    assert "78.0 s, complete" in out
    assert "/forward" in out
    assert "foxglove.CompressedImage" in out
    assert "robot: mine" in out


def test_a_clock_that_jumps_by_years_is_told_in_days(tmp_path, views, capsys):
    """Stamps jump ahead by 2^30 s, as where a counter wraps."""
    late = [view if k < 3 else replace(view, time=view.time + 2.0**30) for k, view in enumerate(views)]
    code, out, _ = run(capsys, "info", write(tmp_path / "jump.mcap", late))
    assert code == 0
    assert "12427.6 days by its stamps, complete" in out


def test_a_layout_for_foxglove(drive, tmp_path, capsys):
    target = tmp_path / "layout.json"
    assert run(capsys, "layout", drive, "-o", target) == (0, f"{target}\n", "")
    assert "/forward" in target.read_text()
    code, out, told = run(capsys, "layout", drive, "-o", tmp_path)
    assert (code, out) == (2, "")
    assert told == f"error: {tmp_path}: is a folder; valid is the name of a file to write\n"


def test_info_of_several_logs_as_json(drive, capsys):
    code, out, _ = run(capsys, "info", drive, drive, "--json")
    found = json.loads(out)
    assert (code, len(found)) == (0, 2)
    laser = next(topic for topic in found[0]["topics"] if topic["topic"] == "/laser")
    assert (laser["role"], laser["messages"]) == ("laser", 40)
    assert laser["rate_hz"] == pytest.approx(0.5)


def test_check_says_what_is_taken_as_what_and_what_to_type_next(drive, capsys):
    code, out, _ = run(capsys, "check", drive)
    assert code == 0
    assert "camera forward, 32 × 24" in out
    assert "laser, 361 beams over 180°" in out
    assert "9.8 m by topic /odometry" in out
    assert f"refseq learn {drive} --thin 0.85 --profile best -o drive.refseq" in out
    assert "score      works: true poses from topic /truth" in out


def test_check_as_json_has_the_figures(drive, capsys):
    code, out, _ = run(capsys, "check", drive, "--thin", "0.5", "--json")
    found = json.loads(out)
    assert (code, found["usable"], found["views"], found["views_after_thinning"]) == (0, True, 40, 20)
    assert found["length_m"] == pytest.approx(39 * SPACING, abs=0.2)
    assert [one["usability"] for one in found["verdicts"]] == ["works"] * 3


def test_the_commands_that_check_names_work_as_they_stand(drive, capsys, monkeypatch):
    monkeypatch.chdir(drive.parent)
    found = json.loads(run(capsys, "check", drive, "--json")[1])
    learn = found["verdicts"][0]["commands"][0]
    assert exit_code(learn.split()[1:]) == 0
    localise = found["verdicts"][1]["commands"][0].replace("SECOND", str(drive))
    assert exit_code(localise.split()[1:]) == 0
    assert (drive.parent / "beliefs.parquet").is_file()


def test_a_log_without_truth_is_usable_and_says_so(tmp_path, views, capsys):
    path = write(tmp_path / "blind.mcap", [replace(view, truth=None) for view in views])
    code, out, _ = run(capsys, "check", path)
    assert code == 0
    assert "score      works, with less: no true poses" in out


def test_truth_that_is_the_odometry_itself_is_no_truth(tmp_path, views, capsys):
    same = [replace(view, truth=Pose(3.0 + SPACING * k, 2.0, 0.0)) for k, view in enumerate(views)]
    path = write(tmp_path / "same.mcap", same)
    code, out, _ = run(capsys, "check", path)
    assert code == 0
    assert "truth and odometry are the same poses" in out
    assert f"refseq learn {path} --thin 0.85 --odometry-noise --profile best -o same.refseq" in out


def test_a_robot_that_stands_is_told(tmp_path, views, capsys):
    path = tmp_path / "standing.mcap"
    with RecordingWriter(path, {}) as writer:
        for view in views[:12]:
            writer.write(replace(view, truth=None), Pose(0.0, 0.0, 0.0))
    _, out, _ = run(capsys, "check", path)
    assert "learn      does not work: the robot hardly moves: 0.00 m" in out


def test_the_page_holds_verdicts_pictures_and_paths_and_fetches_nothing(drive, tmp_path, capsys):
    page = tmp_path / "check.html"
    assert run(capsys, "check", drive, "-o", page)[0] == 0
    text = page.read_text()
    assert text.count("data:image/jpeg") == 8
    assert (
        len(re.findall(r'class="one-scan"><path d="M-?\d+,-?\d+h0 L', text)) == 1
    )  # no polyline: it takes numbers alone
    assert "://" not in text.replace("http://www.w3.org", "")
    assert "refseq learn" in text


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--topics", "front=/nowhere"], "'/nowhere'"),
        (["--topics", "front"], "valid is a name, '=' and a value"),
        (["--views", "30:10"], "valid is FROM:TO within 0:40"),
        (["--thin", "inf"], "thin inf"),
        (["--tolerance", "nan"], "tolerance"),
        (["-o", "nowhere/check.html"], "no folder nowhere"),
    ],
)
def test_what_does_not_fit_is_told_in_one_line(drive, capsys, words, told):
    code, _, err = run(capsys, "check", drive, *words)
    assert (code, err.count("\n")) == (2, 1)
    assert told in err


def test_what_is_no_log_is_told_in_one_line(tmp_path, capsys):
    path = tmp_path / "noise.bin"
    path.write_bytes(b"\0\1\2" * 100)
    code, _, err = run(capsys, "info", path)
    assert (code, err.count("\n")) == (2, 1)


def test_cut_keeps_a_stretch_and_says_what_it_dropped(drive, tmp_path, capsys):
    out_file = tmp_path / "first.mcap"
    code, out, _ = run(capsys, "cut", drive, "--views", "0:10", "-o", out_file)
    assert code == 0
    assert "10 of 40 views; dropped 0.0 s at the beginning and 60.0 s at the end" in out
    found = json.loads(run(capsys, "info", out_file, "--json")[1])[0]
    assert found["metadata"] == {"robot": "mine", "cut": "views 0:10 of drive.mcap, 0.000 to 18.000 s"}
    assert found["complete"]


def test_trim_and_convert_say_what_they_wrote(drive, tmp_path, capsys):
    assert run(capsys, "trim", drive, "-o", tmp_path / "moving.mcap")[0] == 0
    code, out, _ = run(capsys, "convert", drive, "--thin", "1", "-o", tmp_path / "drive.clf")
    assert code == 0
    assert "10 views as carmen; left out: pictures of forward, pictures of lateral" in out


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["cut", "{drive}", "-o", "{drive}", "--views", "0:3"], "would overwrite"),
        (["convert", "{drive}", "-o", "{drive}"], "would overwrite"),
        (["cut", "{drive}", "-o", "{folder}/o.mcap"], "a stretch is missing"),
        (["cut", "{drive}", "-o", "{folder}/o.mcap", "--views", "0:3", "--times", "1:2"], "exclude each other"),
        (["cut", "{drive}", "-o", "{folder}/o.mcap", "--distances", "90:99"], "valid is FROM:TO within 0:9.8 m"),
        (["cut", "{drive}", "-o", "{folder}/none/o.mcap", "--views", "0:3"], "there is no folder"),
        (["convert", "{drive}", "-o", "{folder}/none/bag", "--format", "rosbag2"], "there is no folder"),
        (["convert", "{drive}", "-o", "{folder}/o.xyz"], "its name tells no format"),
        (["trim", "{folder}/none.mcap", "-o", "{folder}/o.mcap"], "No such file"),
    ],
)
def test_what_cannot_be_cut_or_converted_is_told_in_one_line_and_leaves_nothing(drive, capsys, words, told):
    before = {path: path.read_bytes() for path in drive.parent.iterdir()}
    code, _, err = run(capsys, *(word.format(drive=drive, folder=drive.parent) for word in words))
    assert (code, err.count("\n")) == (2, 1)
    assert told in err
    assert {path: path.read_bytes() for path in drive.parent.iterdir()} == before
