"""Start-up of commands, by the packages that they import: each of these takes a twentieth of a second and more."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from refseq.logs import RecordingWriter
from refseq_bench.scenarios.cli.app import NAMES
from tests.support import corridor_drive

SCIPY = {f"scipy.{part}" for part in ("linalg", "ndimage", "optimize", "sparse", "spatial", "special", "stats")}
SLOW = {"cv2", "foxglove", "matplotlib", "mujoco", "networkx", "numpy", "pandas", "pyarrow", "ray", "rerun", "zenoh"}
SLOW |= {"mcap", "rosbags", "torch", *SCIPY}
PROGRAM = """
import json, sys
from refseq_bench.scenarios.cli.app import exit_code
for words in json.loads(sys.argv[1]):
    exit_code(words)
print(json.dumps(sorted(sys.modules)))
"""


def imported(folder: Path, *lines: str) -> set[str]:
    """Modules that one process has imported after these commands."""
    words = json.dumps([line.split() for line in lines])
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, words], cwd=folder, capture_output=True, text=True, check=True
    )
    return set(json.loads(done.stdout.splitlines()[-1]))


def test_no_help_imports_what_is_slow(tmp_path):
    found = imported(tmp_path, "--help", *(f"{name} --help" for name in NAMES), "log info --help", "map merge --help")
    assert found & SLOW == set()
    assert "refseq_bench.scenarios.cli.drives.localise" in found


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """A folder with a recording of two views."""
    made = tmp_path_factory.mktemp("startup")
    with RecordingWriter(made / "drive.mcap", {"world": "made"}) as writer:
        for view in corridor_drive(np.random.default_rng(1), count=2, size=48):
            writer.write(view, view.truth)
    return made


@pytest.mark.parametrize(
    ("line", "used", "needless"),
    [
        ("log info drive.mcap", {"mcap"}, {"mujoco", "networkx", "pyarrow", *SCIPY}),
        ("world list", {"numpy"}, {"cv2", "mujoco", "pyarrow", *SCIPY}),
        ("robot list", {"mujoco"}, {"foxglove", "pyarrow", *SCIPY}),
        ("record nowhere -o x.mcap", {"mujoco"}, {"networkx", "pyarrow", "rerun", *SCIPY}),
        ("learn none.mcap -o x.refseq", {"cv2"}, {"mujoco", "networkx", "pyarrow", "scipy.optimize", "scipy.stats"}),
        ("localise none.refseq drive.mcap", {"scipy.special"}, {"mujoco", "networkx", "pyarrow", "scipy.stats"}),
        ("scenario list smoke", {"numpy"}, SLOW - {"numpy"}),
    ],
)
def test_a_command_imports_no_slow_package_that_it_does_not_use(folder, line, used, needless):
    found = imported(folder, line)
    assert used <= found
    assert found & needless == set()


@pytest.mark.parametrize("name", ["refseq_bench.scenarios.cli.app", "typer"])
def test_ctrl_c_during_the_imports_is_one_line(name: str) -> None:
    """Half of a command's start-up are imports: nobody who stops it there wants to see where."""
    program = f"""
import sys
class Stop:
    def find_spec(self, name, *others):
        if name == {name!r}:
            raise KeyboardInterrupt
sys.meta_path.insert(0, Stop())
from refseq_bench.scenarios.cli.start import main
main()
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "interrupted\n")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full, which is as full as a disk can be")
@pytest.mark.parametrize("line", ["--version", "world list", "log info drive.mcap --json"])
def test_output_that_nobody_can_take_is_one_line(folder: Path, line: str) -> None:
    """As where a program's --json goes to a disk that is full."""
    command = [sys.executable, "-c", "from refseq_bench.scenarios.cli.start import main; main()", *line.split()]
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(command, cwd=folder, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    told = "error: the output, or a file, cannot be written: No space left on device\n"
    assert (done.returncode, done.stderr) == (2, told)
