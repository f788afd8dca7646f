import importlib.metadata
import io
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from rich.console import Console

from refseq.features.neural.network import FILE
from refseq_bench.scenarios.cli import doctor
from refseq_bench.scenarios.cli.doctor import Check, checks, missing_packages, report
from refseq_bench.scenarios.world_survey import frame_rates
from refseq_bench.scenarios.world_survey.frame_rates import FrameRate
from refseq_bench.sim.rendering.drivers import GlDevice
from refseq_bench.sim.rendering.renderer import RendererKind

ROOT = Path(__file__).resolve().parents[3]
DEPENDENCIES = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["dependencies"]
FINE = Check("Disk", "plenty", True)
OPTIONAL = Check("Vulkan", "no device", False, "no images from Filament", "apt-get install -y libvulkan1", needed=False)
NEEDED = Check("OpenGL", "no device", False, "no camera images", "apt-get install -y libegl1")


@pytest.fixture
def machine(monkeypatch):
    """A machine with this project installed and graphics that start, whatever the tests run on."""
    monkeypatch.setattr(doctor, "vulkan_device", lambda: "a card")
    monkeypatch.setattr(doctor, "gl_device", lambda: GlDevice("a card", "4.6", "egl"))
    monkeypatch.setattr(importlib.metadata, "requires", lambda _: DEPENDENCIES)
    monkeypatch.setattr(importlib.metadata, "metadata", lambda _: {"Requires-Python": ">=3.11,<3.14"})
    return monkeypatch


def named(name: str) -> Check:
    return next(check for check in checks() if check.name == name)


def printed(found: list[Check], monkeypatch) -> tuple[int, str]:
    monkeypatch.setattr(doctor, "checks", lambda *, frames: found)
    console = Console(file=io.StringIO(), width=80)
    return report(console), console.file.getvalue()


def test_every_dependency_has_its_cost():
    assert set(doctor.COSTS) == {Requirement(line).name for line in DEPENDENCIES}


def test_every_dependency_is_looked_for(machine):
    assert {Requirement(line).name for line in DEPENDENCIES} <= {check.name for check in checks()}


def test_a_missing_package_tells_its_cost_and_the_line_to_type(machine):
    real = importlib.metadata.version

    def without_mujoco(name):
        if name == "mujoco":
            raise importlib.metadata.PackageNotFoundError(name)
        return real(name)

    machine.setattr(importlib.metadata, "version", without_mujoco)
    found = named("mujoco")
    assert (found.ok, found.found, found.needed) == (False, "not installed, wants <5,>=4.0", True)
    assert found.cost == doctor.COSTS["mujoco"]
    assert found.remedy.endswith("-m pip install 'mujoco<5,>=4.0'")
    assert named("numpy").ok


def test_the_demo_does_without_what_other_commands_need(machine):
    def none(name):
        raise importlib.metadata.PackageNotFoundError(name)

    machine.setattr(importlib.metadata, "version", none)
    assert {check.name for check in checks() if not check.needed} >= set(doctor.SPARED)
    program = (
        "import sys; sys.modules.update(dict.fromkeys(sys.argv[1:]))\n"  # whoever imports one of them is told
        "from refseq_bench.scenarios.cli import demo, workshop"
    )
    subprocess.run([sys.executable, "-c", program, *doctor.SPARED], check=True)


@pytest.mark.parametrize(("version", "ok"), [("3.9", False), ("4.0", True), ("4.7.1", True), ("5.0", False)])
def test_a_package_must_lie_within_the_bounds(machine, version, ok):
    machine.setattr(importlib.metadata, "version", lambda _: version)
    assert named("mujoco").ok is ok


def test_a_checkout_that_is_not_installed_says_so(machine):
    def requires(name):
        raise importlib.metadata.PackageNotFoundError(name)

    machine.setattr(importlib.metadata, "requires", requires)
    assert not named("refseq-bench").ok


def test_an_optional_package_of_an_extra_is_not_asked_for(machine):
    machine.setattr(importlib.metadata, "requires", lambda _: ["ray>=2; extra == 'cluster'", "numpy>=2"])
    assert "ray" not in {check.name for check in checks()}


def test_a_network_that_finds_keys_is_told_where_one_is_named(machine, tmp_path):
    assert re.match(r"sha256 [0-9a-f]{12}…, 16 values a key, \d+ ms a picture$", named("Key network").found)
    machine.setenv(FILE, str(tmp_path))
    found = named("Key network")
    assert not found.ok
    assert not found.needed
    assert found.found == f"{FILE}: {tmp_path}: cannot be read: is a folder; valid is the path of an ONNX file"
    machine.delenv(FILE)
    assert "Key network" not in {check.name for check in checks()}


def test_a_python_outside_the_bounds_is_told(machine):
    machine.setattr(importlib.metadata, "metadata", lambda _: {"Requires-Python": ">=4"})
    assert not named("Python").ok


@pytest.mark.quick_cases("variables1-lost1", "variables2-lost2")
@pytest.mark.parametrize(
    ("variables", "lost"),
    [
        ({}, set()),
        ({"VK_DRIVER_FILES": "none.json", "VK_ICD_FILENAMES": "none.json"}, {"libvulkan1", "mesa-vulkan-drivers"}),
        ({"__EGL_VENDOR_LIBRARY_FILENAMES": "none.json"}, {"libegl1", "libopengl0", "libgl1-mesa-dri"}),
    ],
)
def test_a_driver_that_does_not_start_is_missing(monkeypatch, variables, lost):
    here = set(missing_packages())
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    # The loaders read these variables once a process, so a new one looks again.
    program = "from refseq_bench.scenarios.cli.doctor import missing_packages; print(*missing_packages())"
    told = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True)
    assert set(told.stdout.split()) == here | lost


def test_a_folder_that_cannot_be_written_to_is_told(machine, tmp_path):
    machine.chdir(tmp_path)
    assert named("Write access").ok
    tmp_path.rmdir()
    machine.setattr(Path, "cwd", lambda: tmp_path)
    machine.setattr(doctor.shutil, "disk_usage", lambda _: doctor.shutil._ntuple_diskusage(9, 9, 2**29))
    assert not named("Write access").ok
    assert named("Free disk").found == "0.5 GiB"
    assert not named("Free disk").ok


@pytest.mark.parametrize(
    ("found", "code", "verdict"),
    [
        ([FINE], 0, "All is there."),
        ([FINE, OPTIONAL], 0, "The demo can run: it does without what is absent."),
        ([FINE, NEEDED, OPTIONAL], 1, "The demo cannot run without OpenGL."),
    ],
)
def test_the_exit_code_is_one_only_when_the_demo_cannot_run(monkeypatch, found, code, verdict):
    told, text = printed(found, monkeypatch)
    assert told == code
    assert text.rstrip().endswith(verdict)


def test_each_missing_piece_is_told_with_its_cost_and_an_unbroken_line_to_type(monkeypatch):
    remedy = "apt-get install -y " + " ".join(f"package-{i}" for i in range(12))
    missing = Check("Vulkan", "no device", False, "no camera images from Filament " * 5, remedy)
    _, text = printed([FINE, missing, OPTIONAL], monkeypatch)
    assert remedy in text
    assert OPTIONAL.cost in text
    assert OPTIONAL.remedy in text
    assert max(len(line) for line in text.splitlines() if remedy not in line) <= 80


def test_the_real_report_fits_a_terminal(machine):
    console = Console(file=io.StringIO(), width=80)
    report(console)
    text = console.file.getvalue()
    assert "mujoco" in text
    assert max(len(line.rstrip()) for line in text.splitlines() if "type" not in line) <= 80


def test_pictures_of_each_renderer_that_starts_are_timed_on_request(machine):
    timed = [FrameRate(RendererKind.BAKED, 4.2, 0.05), FrameRate(RendererKind.CLASSIC, 3.0, 0.1)]
    machine.setattr(frame_rates, "frame_rates", lambda *_: iter(timed))
    told = {check.name: check.found for check in checks(frames=True) if check.name.startswith("Frames")}
    assert told == {
        "Frames, baked": "50 ms, 20 a second, the first view after 4 s",
        "Frames, classic": "100 ms, 10 a second, the first view after 3 s",
    }
    assert not any(check.name.startswith("Frames") for check in checks())


def test_no_pictures_are_drawn_where_something_needed_is_missing(machine):
    machine.setattr(importlib.metadata, "metadata", lambda _: {"Requires-Python": ">=4"})
    assert not any(check.name.startswith("Frames") for check in checks(frames=True))
