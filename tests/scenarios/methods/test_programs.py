"""Localisers that are programs: the template in C++, compiled, beside the same method in NumPy."""

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from refseq.view import View
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.methods.by_name import answers_of_each
from refseq_bench.scenarios.methods.checks import check_methods
from refseq_bench.scenarios.methods.plugins import PluginLocaliser, is_plugin, plugin_digest
from refseq_bench.scenarios.methods.templates import MY_LOCALISER


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The template, compiled as it says."""
    if (compiler := shutil.which("g++")) is None:
        pytest.skip("there is no g++ to compile the template with")
    program = tmp_path_factory.mktemp("program") / "my_localiser"
    words = [
        compiler,
        "-O2",
        "-std=c++17",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-o",
        str(program),
        str(MY_LOCALISER[".cpp"]),
    ]
    subprocess.run(words, check=True)
    return program


def places_of(view: View, reference: list[View]) -> np.ndarray:
    """The template's method."""
    assert view.scan is not None
    unlike = [np.abs(np.fmin(view.scan.ranges, 10) - np.fmin(one.scan.ranges, 10)).mean() for one in reference]
    weights = np.exp(-np.array(unlike) / 0.1)
    return weights / weights.sum()


def test_the_template_in_cpp_localises(compiled: Path, views: list[View]) -> None:
    rng = np.random.default_rng(0)
    for view in views:
        view.scan.ranges[:] = rng.uniform(0.5, 12, 361)
    localiser = PluginLocaliser(str(compiled), views)
    localiser.reset()
    beliefs = [localiser.update(view) for view in views]
    localiser.close()
    assert [belief.best for belief in beliefs] == list(range(len(views)))
    for view, belief in zip(views, beliefs, strict=True):
        np.testing.assert_allclose(belief.places, places_of(view, views), atol=1e-5)
        assert belief.lost == 0.02
        assert belief.timings.matching > 0


def test_the_template_is_about_forty_lines() -> None:
    lines = MY_LOCALISER[".cpp"].read_text().splitlines()
    assert len([line for line in lines if line and not line.startswith(("//", "#include"))]) <= 45


@pytest.mark.parametrize(
    ("name", "told"),
    [
        (
            "./nowhere",
            "there is no such program; valid is an executable file, or a folder that holds one named localiser",
        ),
        ("./empty", "there is no such program; valid is an executable file: empty/localiser"),
        ("./text", "text is not executable; valid is a program (chmod +x)"),
        (
            "./script",
            "script is no program: its first line tells no interpreter; valid is a binary, or a script that begins as "
            "#!/usr/bin/env python3",
        ),
    ],
)
def test_what_is_no_program_is_told_before_anything_runs(here: Path, name: str, told: str) -> None:
    (here / "empty").mkdir()
    (here / "text").write_text("x")
    (here / "script").write_text("print('hello')\n")
    (here / "script").chmod(0o755)
    assert is_plugin(name)
    with pytest.raises(ScenarioError) as caught:
        check_methods(["vlad", name])
    assert str(caught.value) == f"localiser {name!r}: {told}"


@pytest.mark.parametrize(
    ("first", "missing"),
    [
        ("#!/usr/bin/nonexist", "'/usr/bin/nonexist', which is not there"),
        ("#! /usr -x", "'/usr', which is not there"),
        ("#!python3", "'python3', which is not there"),
        ("#!", "'', which is not there"),
        ("#!/bin/sh\r", r"'/bin/sh\r', which is not there (its lines end as on Windows)"),
        ("#!/usr/bin/env python3\r", r"'python3\r', which is not there (its lines end as on Windows)"),
        ("#!/usr/bin/env python3 -u", "'python3 -u', which is not there"),
    ],
)
def test_an_interpreter_that_is_not_there_is_told_before_anything_runs(here: Path, first: str, missing: str) -> None:
    (here / "script").write_bytes(f"{first}\nprint('hello')\n".encode())
    (here / "script").chmod(0o755)
    with pytest.raises(ScenarioError) as caught:
        check_methods(["./script"])
    assert str(caught.value) == (
        f"localiser './script': script: its first line names {missing}; valid is a binary, or a script that begins as "
        "#!/usr/bin/env python3"
    )


@pytest.mark.parametrize(
    "first", [f"#!{sys.executable}", "#!  /bin/sh -e", "#!/usr/bin/env sh", "#!/usr/bin/env -S sh -e"]
)
def test_an_interpreter_that_is_there_is_taken(here: Path, first: str) -> None:
    (here / "script").write_text(f"{first}\n")
    (here / "script").chmod(0o755)
    check_methods(["./script"])


def test_a_file_that_is_no_program_fails_alone(here: Path, views: list[View]) -> None:
    (here / "text").write_bytes(b"\x7fELF" + bytes(99))
    (here / "text").chmod(0o755)
    found = answers_of_each(["./text", "hamming"], views, views)
    assert list(found.beliefs) == ["hamming"]
    assert str(found.failures["./text"]).startswith("./text, being started: the localiser ended with code")
    assert found.failures["./text"].said == "text cannot be started: Exec format error\n"


def test_a_digest_follows_the_program_and_what_lies_in_its_folder(here: Path) -> None:
    for name in ("./one/localiser", "./one"):
        (here / "one").mkdir(exist_ok=True)
        (here / "one/localiser").write_bytes(b"#!/bin/sh\n#1")
        (here / "one/localiser").chmod(0o755)
        before = plugin_digest(name)
        (here / "one/weights.bin").write_bytes(b"2")
        assert (plugin_digest(name) != before) == (name == "./one")
        before = plugin_digest(name)
        (here / "one/localiser").write_bytes(b"#!/bin/sh\n#3")
        assert plugin_digest(name) != before
        (here / "one/weights.bin").unlink()


GUEST = """#!{python}
import json, struct, sys

def told(header, payload=b""):
    text = json.dumps(header).encode()
    sys.stdout.buffer.write(struct.pack("<II", len(text), len(payload)) + text + payload)
    sys.stdout.buffer.flush()

while prefix := sys.stdin.buffer.read(8):
    header, payload = struct.unpack("<II", prefix)
    asked = json.loads(sys.stdin.buffer.read(header))
    sys.stdin.buffer.read(payload)
    if asked["type"] == "hello":
        places = asked["places"]
        told({{"type": "hello", "protocol": 1, "sensors": {sensors}}})
    elif asked["type"] == "localise":
        belief = {{"type": "belief", "places": "float32"}} | {more}
        told(belief, struct.pack(f"<{{places}}f", *[1 / places] * places))
    elif asked["type"] != "learn":
        told({{"type": "ok"}})
"""


@pytest.mark.parametrize(
    ("sensors", "more", "mistake"),
    [
        ('["laser"]', "{}", ""),
        ('["lidar"]', "{}", "hello: wants sensors lidar, none of which is there; valid are forward, laser, lateral"),
        (
            '["laser"]',
            '{"lots": 0.2}',
            "view 0: answered a belief with 'lots'; valid are best, covariance, entropy, lost, lost_after, "
            "odometer_scale, path, places, pose, timings, type",
        ),
        (
            '["laser"]',
            '{"path": [0, 0]}',
            "view 0: path has 2 places; valid are up to 1, one a view of the drive",
        ),
    ],
)
def test_what_a_program_means_otherwise_is_told(
    here: Path, views: list[View], sensors: str, more: str, mistake: str
) -> None:
    (here / "mine").write_text(GUEST.format(python=sys.executable, sensors=sensors, more=more))
    (here / "mine").chmod(0o755)
    failures = answers_of_each(["./mine"], views, views).failures
    assert [str(failure) for failure in failures.values()] == ([f"./mine, {mistake}"] if mistake else [])
