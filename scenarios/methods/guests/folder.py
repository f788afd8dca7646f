"""Folder of a guest: links to the user's code, a place to write, and the order that its process begins with.

The guest may read the files that its key in the cache is made of, and no others of the user's: links to them lie in a
folder of their own, since Python lists the folders that it looks for modules in.
"""

import json
import os
import subprocess
import sys
import sysconfig
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from refseq_bench.scenarios.imports.closure import PACKAGES, ROOT
from refseq_bench.scenarios.methods.guests.limits import GuestLimits

SHARED = (Path("/usr"), Path("/usr/local"), Path("/"))
"""Prefixes of Python under which much else lies too."""


@dataclass(frozen=True)
class GuestCode:
    """A guest's code: a ``localiser`` in Python by ``package.module:Class``, or the ``program`` of another language.

    ``files`` are the user's own that it needs, by their names below the folder where the guest finds them.
    """

    localiser: str
    program: Path | None
    files: Mapping[str, Path]


class GuestFolder:
    """A folder for one guest; ``close`` removes it with all that the guest wrote."""

    def __init__(self, code: GuestCode, limits: GuestLimits) -> None:
        self._kept = TemporaryDirectory(prefix="refseq-guest-", ignore_cleanup_errors=True)
        top = Path(self._kept.name)
        self.scratch, self.order = top / "scratch", top / "order.json"
        bench, own = top / "bench", top / "code"
        for folder in (self.scratch, bench, own):
            folder.mkdir()
        packages = [(ROOT / name).resolve() for name in PACKAGES]
        for package in packages:
            (bench / package.name).symlink_to(package)
        for name, file in code.files.items():
            (own / name).parent.mkdir(parents=True, exist_ok=True)
            (own / name).symlink_to(file.resolve())
        folders = [*_others(), *_beneath(packages)]
        read = [*folders, bench, own, *(file.resolve() for file in code.files.values())]
        order = {
            "bench": os.getpid(),
            "limits": asdict(limits),
            "read": list(map(str, read)),
            "write": [str(self.scratch)],
            "path": list(map(str, (bench, *_path(), own))),
            "localiser": code.localiser,
            "program": code.program and str(code.program.resolve()),
            "threads": _threads(),
        }
        self.order.write_text(json.dumps(order), encoding="utf-8")

    def close(self) -> None:
        """Remove it, however deep the guest has nested folders in it."""
        try:
            self._kept.cleanup()
        except RecursionError:
            subprocess.run(["rm", "-rf", "--", self._kept.name], check=False)


def _path() -> list[Path]:
    """Folders in which Python looks for modules, but for the bench's checkout and where the user stands.

    A bench that is installed lies among all other packages, which stay.
    """
    checkout = {ROOT.resolve()} if (ROOT / "pyproject.toml").exists() else set()
    left_out = {*checkout, Path.cwd().resolve()}
    return [path for path in map(Path, filter(None, sys.path)) if path.resolve() not in left_out]


def _others() -> Iterator[Path]:
    """Folders of Python and of installed packages."""
    yield from (Path(sysconfig.get_path(name)) for name in ("stdlib", "platstdlib", "purelib", "platlib"))
    prefixes = {Path(sys.prefix), Path(sys.base_prefix)} - set(SHARED)
    yield from (prefix / name for prefix in prefixes for name in ("bin", "lib", "lib64"))
    private = (Path.cwd().resolve(), Path.home().resolve())
    may = [path for path in (*prefixes, *_path()) if not any(one.is_relative_to(path.resolve()) for one in private)]
    yield from may


def _beneath(packages: list[Path]) -> Iterator[Path]:
    """Packages of the bench, and the folders that they link to in a checkout."""
    for package in packages:
        yield package
        yield from (link.resolve() for link in package.iterdir() if link.is_symlink())


def _threads() -> int:
    """Threads that OpenCV may filter images with here: guests share the cores as their workers do."""
    opencv = sys.modules.get("cv2")
    return opencv.getNumThreads() if opencv else os.cpu_count() or 1
