"""Check what this machine offers the bench, tell the cost of each missing piece, and the one line that mends it."""

import importlib.metadata
import importlib.util
import os
import platform
import shutil
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from rich.console import Console
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from refseq_bench.scenarios.methods.guests.confinement import holds, in_words
from refseq_bench.sim.rendering.drivers import VULKAN_PACKAGES, gl_device, vulkan_device

DISTRIBUTION = "refseq-bench"
GL_PACKAGES = ("libegl1", "libopengl0", "libgl1-mesa-dri")
"""Debian packages for the baked and the classic renderer: EGL, functions that are looked up by name, Mesa's drivers."""

DISK_GIB = 1.0
"""Free disk that the demo's recordings, map and report fit into with room to spare [GiB]; a choice."""
MEMORY_GIB = 2.0
"""Memory below which two cameras (about 0.8 GiB by Filament), the map and the report get tight [GiB]; a choice."""
FRAMES_OF = ("hallway", "16:00")
"""World and light whose pictures are timed: the demo's."""

COSTS = {
    "numpy": "nothing runs: every array of the bench is one of numpy's",
    "scipy": "no localisation and no drive: likelihoods and odometry use it",
    "opencv-python-headless": "no features from images: localise with the laser only",
    "foxglove-sdk": "no recording: nothing writes the .mcap file",
    "mcap": "no recording can be read; CARMEN logs still can",
    "mcap-protobuf-support": "no recording can be read; CARMEN logs still can",
    "protobuf": "no recording can be read; CARMEN logs still can",
    "rosbags": "no ROS bag can be read or written; MCAP and CARMEN logs still can",
    "ruamel.yaml": "no rosbag2 can be read or written",
    "zstandard": "no packed ROS bag can be read",
    "lz4": "no packed ROS bag can be read",
    "apsw": "no ROS bag that is an SQLite file can be read",
    "aiohttp": "no page of controls and no viewer's page: nothing stands before them that asks for a token",
    "websockets": "no server for a robot: `refseq serve`",
    "faiss-cpu": "no index: vocabularies of more than 20 000 words cannot be searched",
    "pyarrow": "no beliefs.parquet: results cannot be kept",
    "rerun-sdk": "no viewer: the report still shows the result",
    "mujoco": "no simulated drives: only logs of real robots can be learnt and localised",
    "moderngl": "no camera images but by --renderer filament and classic",
    "optuna": "no `refseq scenario search`",
    "embreex": "no --renderer baked, and no simulated drives: the bench imports it",
    "pydantic": "no floor plans, routes and profiles: the files that people write are not read",
    "astral": "no daylight: nobody knows where the sun stands",
    "typer": "no command line",
    "rich": "no progress bars and no tables on the terminal",
    "jinja2": "no report page",
    "matplotlib": "no plots in the report",
    "packaging": "no doctor: versions cannot be compared",
    "pebble": "no campaigns: scenarios have no processes to run in",
    "junitparser": "no JUnit XML for a CI server; campaigns cannot be run",
    "networkx": "no routes over an atlas",
    "gymnasium": "no environments to train a robot in",
}

SPARED = ("optuna", "gymnasium", "networkx", "junitparser", "websockets")
"""Packages that the demo runs without: other commands import them."""


@dataclass(frozen=True, slots=True)
class Check:
    """One thing that the bench wants from the machine.

    ``found`` is what is there, ``cost`` what the user goes without when it is missing, ``remedy`` the line to type;
    ``needed`` tells what the demo cannot do without, and ``packages`` are the Debian packages that bring it.
    """

    name: str
    found: str
    ok: bool
    cost: str = ""
    remedy: str = ""
    needed: bool = True
    packages: tuple[str, ...] = ()


def checks(*, frames: bool = False) -> list[Check]:
    """Look at everything once; takes a second or two, since the graphics drivers are really started.

    With ``frames``, where nothing needed is missing, each renderer draws pictures of a world: half a minute more.
    """
    here = Path.cwd()
    machine = [_guests(), _write_access(here), _disk(here), _memory()]
    found = [_python(), *_packages(), *_graphics(), *_key_network(), *machine]
    return [*found, *_frames()] if frames and not any(check.needed and not check.ok for check in found) else found


def missing_packages() -> tuple[str, ...]:
    """Debian packages that would bring the graphics that are not there; empty when both renderers can start."""
    return tuple(package for check in _graphics() if not check.ok for package in check.packages)


def report(console: Console, *, frames: bool = False) -> int:
    """Print every check; the exit code is 1 when something that the demo needs is missing, 0 otherwise."""
    with console.status("Looking at this machine"):
        found = checks(frames=frames)
    console.print(_table(found))
    missing = [check for check in found if not check.ok]
    for check in missing:
        console.print(Text(check.name, style="bold red" if check.needed else "yellow"))
        console.print(Padding(f"costs  {check.cost}", (0, 0, 0, 2), expand=False), highlight=False)
        # A line to type is copied: the terminal may fold it, a line break of ours would cut it in two.
        console.print(Text(f"  type   {check.remedy}\n"), soft_wrap=True)
    console.print(_summary(missing))
    return int(any(check.needed for check in missing))


def _table(found: list[Check]) -> Padding:
    table = Table(box=None, show_header=False, pad_edge=False)
    table.add_column(no_wrap=True)
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    for check in found:
        table.add_row(_mark(check), check.name, Text(check.found))
    return Padding(table, (1, 0), expand=False)


def _mark(check: Check) -> Text:
    if check.ok:
        return Text("ok", style="green")
    return Text("missing", style="bold red") if check.needed else Text("absent", style="yellow")


def _summary(missing: list[Check]) -> Text:
    if not missing:
        return Text("All is there.", style="green")
    needed = [check.name for check in missing if check.needed]
    if needed:
        return Text(f"The demo cannot run without {', '.join(needed)}.", style="bold red")
    return Text("The demo can run: it does without what is absent.", style="yellow")


def _python() -> Check:
    version = platform.python_version()
    try:
        wanted = importlib.metadata.metadata(DISTRIBUTION)["Requires-Python"]
    except importlib.metadata.PackageNotFoundError:
        wanted = ""
    return Check(
        "Python",
        f"{version}, {_short(Path(sys.executable))}",
        SpecifierSet(wanted).contains(version, prereleases=True),
        f"nothing is promised: the packages are locked for Python {wanted}",
        _apt(("python3", "python3-venv")),
    )


def _packages() -> list[Check]:
    try:
        demands = [Requirement(line) for line in importlib.metadata.requires(DISTRIBUTION) or []]
    except importlib.metadata.PackageNotFoundError:
        cost = "no refseq command, and nobody knows which packages to look for"
        return [Check(DISTRIBUTION, "not installed", False, cost, _pip("-e ."))]
    return [_package(demand) for demand in demands if demand.marker is None or demand.marker.evaluate({"extra": ""})]


def _package(demand: Requirement) -> Check:
    cost = COSTS.get(demand.name, "whatever imports it stops")
    remedy, needed = _pip(f"'{demand.name}{demand.specifier}'"), demand.name not in SPARED
    try:
        version = importlib.metadata.version(demand.name)
    except importlib.metadata.PackageNotFoundError:
        return Check(demand.name, f"not installed, wants {demand.specifier}", False, cost, remedy, needed)
    ok = demand.specifier.contains(version, prereleases=True)
    told = version if ok else f"{version}, wants {demand.specifier}"
    return Check(demand.name, told, ok, cost, remedy, needed)


def _graphics() -> list[Check]:
    vulkan, classic = vulkan_device(), gl_device()
    return [
        Check(
            "Vulkan",
            vulkan or "no device",
            vulkan is not None,
            "no --renderer filament; the others need no Vulkan",
            _apt(tuple(VULKAN_PACKAGES.split())),
            needed=False,
            packages=tuple(VULKAN_PACKAGES.split()),
        ),
        Check(
            "OpenGL",
            f"{classic.renderer}, {classic.backend}" if classic else "no device",
            classic is not None,
            "no camera images but by --renderer filament: baked, the default, and classic draw by OpenGL",
            _apt(GL_PACKAGES),
            packages=GL_PACKAGES,
        ),
    ]


def _frames() -> list[Check]:
    """Cost of pictures here; a renderer that does not start is told of by its driver."""
    from refseq_bench.scenarios.world_survey.frame_rates import frame_rates

    return [
        Check(
            f"Frames, {rate.renderer}",
            f"{1e3 * rate.frame:.0f} ms, {1 / rate.frame:.0f} a second, the first view after {rate.first:.0f} s",
            ok=True,
        )
        for rate in frame_rates(*FRAMES_OF)
    ]


def _key_network() -> list[Check]:
    """The user's neural network that finds keys, where one is named and OpenCV is there to run it."""
    if importlib.util.find_spec("cv2") is None:
        return []
    import numpy as np

    from refseq.errors import RefseqError
    from refseq.features.neural.network import FILE, key_network
    from refseq.features.neural.words import NeuralSettings

    if not os.environ.get(FILE):
        return []
    width, height = NeuralSettings().width, NeuralSettings().height
    try:
        network = key_network((width, height))
    except RefseqError as error:
        return [Check("Key network", str(error), False, "no profile neural", f"export {FILE}=FILE.onnx", needed=False)]
    began = time.perf_counter()
    network.maps(np.zeros((height, width), np.uint8))
    took = time.perf_counter() - began
    told = f"sha256 {network.digest[:12]}…, {network.depth} values a key, {1e3 * took:.0f} ms a picture"
    return [Check("Key network", told, ok=True)]


def _guests() -> Check:
    """Confinement of users' localisers."""
    found = holds()
    missing = ", ".join(one.kept_from for one in found if not one.by)
    return Check(
        "Guests",
        in_words(found),
        not missing,
        f"a localiser of your own, or somebody's, is not kept from {missing}: run only code that you trust",
        "uname -r  # Linux 5.13 or later with Landlock and seccomp keeps it from all",
        needed=False,
    )


def _write_access(folder: Path) -> Check:
    try:
        with tempfile.TemporaryFile(dir=folder):
            ok = True
    except OSError:
        ok = False
    found = f"yes, in {_short(folder)}" if ok else f"none in {_short(folder)}"
    return Check("Write access", found, ok, "no recordings, maps and reports in this folder", "cd ~")


def _disk(folder: Path) -> Check:
    free = shutil.disk_usage(folder).free / 2**30
    return Check(
        "Free disk",
        f"{free:.1f} GiB",
        free >= DISK_GIB,
        f"a recording may end early: the demo wants {DISK_GIB:g} GiB",
        f"du -xh {_short(folder)} | sort -h | tail",
    )


def _memory() -> Check:
    cores = len(os.sched_getaffinity(0))
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    return Check(
        "Cores and memory",
        f"{cores} {'core' if cores == 1 else 'cores'}, {memory:.1f} GiB",
        memory >= MEMORY_GIB,
        f"rendering may be killed: two cameras want {MEMORY_GIB:g} GiB",
        "refseq demo --renderer none",
        needed=False,
    )


def _short(path: Path) -> str:
    """Write the path as a person would type it: relative to where they are, or to their home."""
    for base, prefix in ((Path.cwd(), ""), (Path.home(), "~/")):
        if path != base and path.is_relative_to(base):
            return prefix + str(path.relative_to(base))
    return str(path)


def _pip(what: str) -> str:
    return f"{_short(Path(sys.executable))} -m pip install {what}"


def _apt(packages: tuple[str, ...]) -> str:
    line = f"apt-get install -y {' '.join(packages)}"
    if os.geteuid() == 0:
        return line
    return f"sudo {line}" if shutil.which("sudo") else f"su -c '{line}'"
