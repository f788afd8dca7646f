"""One scenario again and again, here and under other settings of the machine: all that it makes is the same.

Drives, maps, beliefs and verdicts are compared bit for bit; only what the clock measured is left out.
"""

import atexit
import json
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from unittest import SkipTest

from tests.robustness.attack import HERE, attack

ROOT = HERE.parents[1]
SCENES = HERE / "scenes"
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "LP_NUM_THREADS")


@attack(
    family="repeats",
    promise="Drives, maps, beliefs and verdict of a repeated scenario by laser are the same to the last bit",
    tries=100,
    short=0,
)
def repeat_laser(_seed: int, folder: Path) -> str | None:
    """Repeat it once."""
    return _difference("laser", _repeated("laser", folder))


@attack(
    family="repeats",
    promise="Drives, maps, beliefs and verdict of a repeated scenario with cameras are the same to the last bit",
    tries=100,
    short=0,
)
def repeat_cameras(_seed: int, folder: Path) -> str | None:
    """Repeat it once."""
    return _difference("cameras", _repeated("cameras", folder))


@dataclass(frozen=True)
class Setting:
    """Another way to run the same: words of the command, environment, the kind of folder."""

    name: str
    words: tuple[str, ...] = ()
    environment: Mapping[str, str] = field(default_factory=dict)
    folder: str = "."
    before: tuple[str, ...] = ()


def _threads(count: int) -> Setting:
    return Setting(f"{count} threads", environment=dict.fromkeys(THREADS, str(count)))


def _under(name: str, *values: str) -> list[Setting]:
    return [Setting(f"{name}={value}", environment={name: value}) for value in values]


SETTINGS = (
    _threads(1),
    _threads(2),
    _threads(7),
    Setting("one core", before=("taskset", "-c", "0")),
    *_under("PYTHONHASHSEED", "0", "1", "4294967295", "random"),
    *_under("LANG", "C", "de_DE.UTF-8"),
    *_under("LC_ALL", "C", "C.UTF-8", "tr_TR.UTF-8"),
    *_under("TZ", "Asia/Kathmandu", "Pacific/Apia", "UTC+11:30"),
    *_under("PYTHONOPTIMIZE", "2"),
    Setting("a folder with letters of its own", folder="Ä folder,  with 'quotes' and ☃"),
    Setting("a deep folder", folder="/".join(["deep"] * 40)),
    Setting("two workers", words=("-j", "2")),
    Setting("four workers", words=("-j", "4")),
)


@attack(
    family="repeats",
    promise="Threads, cores, hash seeds, locales, time zones, folders and workers change no bit of them",
    tries=len(SETTINGS),
    short=0,
)
def repeat_elsewhere(seed: int, folder: Path) -> str | None:
    """Run the command line under one of the settings, in an interpreter of its own."""
    setting = SETTINGS[seed % len(SETTINGS)]
    difference = _run_under(setting, folder)
    return difference and f"{setting.name}: {difference}"


@attack(family="repeats", promise="Workers of a Ray cluster give the same to the last bit", tries=3, short=0)
def repeat_ray(_seed: int, folder: Path) -> str | None:
    """Run the command line on a cluster of two nodes on this machine."""
    if find_spec("ray") is None:
        raise SkipTest("Ray is not installed")
    from ray.cluster_utils import Cluster

    os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 0, "include_dashboard": False})
    try:
        for _ in range(2):
            cluster.add_node(num_cpus=1)
        return _run_under(Setting("Ray", words=("--ray", cluster.address)), folder)
    finally:
        cluster.shutdown()


def _run_under(setting: Setting, folder: Path) -> str | None:
    from tests.robustness.fingerprints import CACHE, RESULTS, fingerprints

    inside = folder / setting.folder
    inside.mkdir(parents=True, exist_ok=True)
    for scene in SCENES.iterdir():
        shutil.copy(scene, inside)
    refseq = Path(sysconfig.get_path("scripts"), "refseq")
    told = subprocess.run(
        [*setting.before, refseq, "scenario", "run", "cameras.toml", "-o", RESULTS, "--cache", CACHE, *setting.words],
        cwd=inside,
        env={**os.environ, "PYTHONPATH": str(ROOT), **setting.environment},
        capture_output=True,
        text=True,
        check=False,
    )
    if told.returncode:
        return f"exit code {told.returncode}: {told.stderr.strip()[-300:]}"
    return _difference("cameras", fingerprints(inside))


def _difference(scene: str, found: Mapping[str, str]) -> str | None:
    first = _first(scene)
    differing = [name for name in sorted(first | found) if first.get(name) != found.get(name)]
    return f"differs from the first: {', '.join(differing)}" if differing else None


@cache
def _first(scene: str) -> Mapping[str, str]:
    with tempfile.TemporaryDirectory() as folder:
        found = _repeated(scene, Path(folder))
    assert len(found) == 5, "two drives, two maps and a verdict"
    return found


def _repeated(scene: str, folder: Path) -> Mapping[str, str]:
    return _repeater().ask(SCENES / f"{scene}.toml", folder)


class _Repeater:
    """A process that has imported all, and forks itself for each repeat."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", "tests.robustness.fingerprints"],
            cwd=ROOT,
            env={**os.environ, **dict.fromkeys(THREADS, "1")},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        atexit.register(self._process.kill)

    def ask(self, scenario: Path, folder: Path) -> dict[str, str]:
        """Run a scenario once more."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(f"{scenario}\t{folder.resolve()}\n")
        self._process.stdin.flush()
        found: dict[str, str] = json.loads(self._process.stdout.readline())
        return found


@cache
def _repeater() -> _Repeater:
    return _Repeater()
