"""The wheel and the source archive: which files they hold, and a bench installed from one, in another folder."""

import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import venv
import zipfile
from pathlib import Path

import pytest

from refseq_bench.scenarios.cli.doctor import GL_PACKAGES
from refseq_bench.sim.rendering.drivers import VULKAN_PACKAGES
from tests.test_house import LINKED, ROOT, tracked

pytest.importorskip("pip")
pytest.importorskip("hatchling")


def build(source: Path, target: Path) -> None:
    subprocess.run([sys.executable, "-m", "hatchling", "build", "-d", target], cwd=source, check=True)


@pytest.fixture(scope="module")
def archives(tmp_path_factory) -> Path:
    """A folder with a wheel and a source archive of this checkout."""
    folder = tmp_path_factory.mktemp("archives")
    build(ROOT, folder)
    return folder


def files_of(wheel: Path) -> dict[str, int]:
    """Names of a wheel's files, and their checksums; without what tells of the wheel itself."""
    with zipfile.ZipFile(wheel) as archive:
        return {one.filename: one.CRC for one in archive.infolist() if ".dist-info/" not in one.filename}


def only(folder: Path, pattern: str) -> Path:
    (found,) = folder.glob(pattern)
    return found


def test_the_wheel_holds_each_tracked_file_of_the_rooms_once_and_nothing_else(archives):
    names = [path.relative_to(ROOT) for path in tracked()]
    expected = {str(name) for name in names if name.parts[0] in {"refseq", "refseq_bench"}}
    expected |= {f"refseq_bench/{name}" for name in names if name.parts[0] in LINKED}
    assert set(files_of(only(archives, "*.whl"))) == expected


def test_a_wheel_of_the_source_archive_is_the_same(archives, tmp_path):
    shutil.unpack_archive(only(archives, "*.tar.gz"), tmp_path)  # tarfile's own filter is not in Debian's 3.11.2
    build(only(tmp_path, "refseq_bench-*"), tmp_path / "again")
    assert files_of(only(tmp_path / "again", "*.whl")) == files_of(only(archives, "*.whl"))


@pytest.fixture(scope="module")
def installed(archives, tmp_path_factory) -> Path:
    """An environment with the wheel in it, and this one's packages behind it."""
    folder = tmp_path_factory.mktemp("installed")
    venv.create(folder, symlinks=True)
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--python", folder / "bin" / "python"]
    wheel = only(archives, "*.whl")
    subprocess.run([*pip, "install", "--quiet", "--no-deps", "--no-index", "--no-compile", wheel], check=True)
    # A .pth file in a folder that one names is not read: this checkout is not on the path.
    paths = {sysconfig.get_path(name) for name in ("purelib", "platlib")}
    (site_packages(folder) / "behind.pth").write_text("\n".join(paths))
    return folder


def site_packages(folder: Path) -> Path:
    return only(folder, "lib/python*/site-packages")


def call(installed: Path, *words: str, cwd: Path) -> subprocess.CompletedProcess:
    """Run a program of the environment as somebody would who knows nothing of the checkout."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    environment |= {"REFSEQ_CACHE": str(cwd / "cache"), "OMP_NUM_THREADS": "1"}
    program, *rest = words
    return subprocess.run(
        [installed / "bin" / program, *rest], cwd=cwd, env=environment, capture_output=True, text=True, check=False
    )


def test_two_names_lie_at_the_top_of_site_packages(installed):
    names = {path.name for path in site_packages(installed).iterdir() if path.suffix not in {".dist-info", ".pth"}}
    assert names == {"refseq", "refseq_bench"}


LOOK = """
import importlib.util, json, gymnasium, refseq, refseq_bench.sim.envs
from refseq_bench import robots, worlds
from refseq_bench.scenarios.methods.templates import MY_LOCALISER
from refseq_bench.scenarios.report import page
from refseq_bench.sim.cameras.library import load_camera
print(json.dumps({
    "rooms": [name for name in ("sim", "worlds", "robots", "scenarios", "tests") if importlib.util.find_spec(name)],
    "places": sorted({refseq.__file__, refseq_bench.sim.envs.__file__, robots.__file__}),
    "worlds": worlds.world_names(),
    "geoms": [robots.load(name).spec.compile().ngeom for name in robots.names()],
    "camera": str(load_camera("fire-i")),
    "page": bool(page),
    "template": all(one.is_file() for one in MY_LOCALISER.values()),
    "ids": [name for name in gymnasium.registry if name.lower().startswith("refseq/")],
}))
"""


def test_it_is_found_by_its_own_names_with_all_its_data(installed, tmp_path):
    told = call(installed, "python", "-c", LOOK, cwd=tmp_path)
    assert told.returncode == 0, told.stderr
    found = json.loads(told.stdout)
    assert found["rooms"] == []
    assert all(Path(place).is_relative_to(installed) for place in found["places"])
    assert {"hallway", "laboratory"} <= set(found["worlds"])
    assert len(found["geoms"]) >= 2
    assert min(found["geoms"]) > 5
    assert found["template"]
    assert len(found["ids"]) >= 8


def test_the_command_line_answers_from_another_folder(installed, tmp_path):
    for words, told in (
        (("--help",), "Workshop"),
        (("scenario", "list"), "smoke"),
    ):
        said = call(installed, "refseq", *words, cwd=tmp_path)
        assert said.returncode == 0, said.stderr
        assert told in said.stdout
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_the_doctor_finds_all_packages_and_the_demo_runs_to_its_end(installed, tmp_path):
    doctor = call(installed, "refseq", "doctor", cwd=tmp_path)
    assert "not installed" not in doctor.stdout
    demo = call(installed, "refseq", "demo", cwd=tmp_path)
    assert demo.returncode == 0, demo.stderr
    assert (tmp_path / "out" / "demo" / "report.html").is_file()


# The image


def test_the_image_has_the_drivers_that_the_doctor_asks_for():
    text = (ROOT / "Dockerfile").read_text().replace("\\\n", " ")
    (line,) = re.findall(r"apt-get install (.*?)&&", text)
    packages = [word for word in line.split() if not word.startswith("-")]
    assert packages == sorted({*GL_PACKAGES, *VULKAN_PACKAGES.split()})


def test_the_image_is_built_of_what_the_wheel_is_built_of():
    lines = (ROOT / ".dockerignore").read_text().splitlines()
    kept = {line[1:] for line in lines if line.startswith("!")}
    assert "*" in lines
    assert kept == {*LINKED, "refseq", "refseq_bench", "LICENSE", "README.md", "pyproject.toml", "requirements.lock"}
