"""A process that has imported the whole command line, and forks itself for each command that it is asked to run.

``python -m tests.robustness.worker`` reads requests, a line each, ``{"words": […], "folder": …, "aside": …}``, and
answers by lines. A command runs in ``folder``, under limits; its output and its temporary files go ``aside``. With
``"arms"``, functions of ``sudden`` and their arguments, something happens to it, and its time is not limited.
"""

import gc
import importlib
import json
import os
import pkgutil
import resource
import signal
import sys
import tempfile
import traceback
from pathlib import Path
from typing import Any

CPU_SECONDS = 5
"""A command may use so much [s]; the system ends it then."""
WALL_SECONDS = 120
"""A command that waits for so long waits for ever [s]: far more than one takes on a busy machine."""
MEMORY = 1 << 30
"""A command may take so much more memory than the worker has [bytes]; the system refuses twice as much of addresses."""

PACKAGES = ("refseq", "refseq_bench.scenarios", "refseq_bench.robots", "refseq_bench.worlds")


def main() -> None:
    """Import everything, then serve requests until the input ends."""
    replies = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    _import_all()
    gc.collect()
    gc.freeze()
    replies.write("ready\n")
    replies.flush()
    for line in sys.stdin:
        replies.write(json.dumps(_forked(json.loads(line))) + "\n")
        replies.flush()


def _import_all() -> None:
    """Import every module of ours, so that a command pays for its own work alone."""
    for name in PACKAGES:
        package = importlib.import_module(name)
        for found in pkgutil.walk_packages(package.__path__, f"{name}.", onerror=lambda _: None):
            if not found.name.endswith("__main__"):
                importlib.import_module(found.name)
    from refseq.logs.ros.decoder import Serialization, known_types
    from refseq_bench.scenarios.cli.app import NAMES, command_tree

    for one in Serialization:
        known_types(one)
    command_tree(*NAMES)


def _forked(request: dict[str, Any]) -> dict[str, Any]:
    """Run one command in a child, and tell how it ended and what it took."""
    child = os.fork()
    if not child:
        _become(request)
    _, status, used = os.wait4(child, 0)
    code = os.waitstatus_to_exitcode(status)
    size = Path(request["aside"], "size")
    own = int(size.read_text()) if size.exists() else 0
    peak = max(0, used.ru_maxrss * 1024 - own)
    return {"code": code, "cpu": used.ru_utime + used.ru_stime, "peak": peak}


def _resident() -> int:
    """Bytes of memory that this process has; a child begins with less than its parent, without pages of files."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()


def _become(request: dict[str, Any]) -> None:
    """Run the command line as a user would, in this process, and end with its exit code."""
    code = 3
    try:
        Path(request["aside"], "size").write_text(str(_resident()))
        arms = request.get("arms", {})
        _enter(Path(request["folder"]), Path(request["aside"]), limited=not arms)
        from refseq_bench.scenarios.cli import app
        from tests.robustness import sudden

        sys.argv = ["refseq", *request["words"]]
        for name, given in arms.items():
            getattr(sudden, name)(**given)
        app.main()
        code = 0
    except SystemExit as leave:
        code = leave.code if isinstance(leave.code, int) else 3
    except BaseException:
        traceback.print_exc()
    finally:
        gc.collect()  # temporary folders go with their objects
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def _enter(folder: Path, aside: Path, *, limited: bool) -> None:
    """Go to the folder, turn the streams and temporary files aside, and take the limits."""
    os.chdir(folder)
    os.environ["TMPDIR"] = str(aside / "tmp")
    tempfile.tempdir = None
    for stream, name in ((0, os.devnull), (1, str(aside / "out")), (2, str(aside / "err"))):
        flags = os.O_RDONLY if stream == 0 else os.O_WRONLY | os.O_CREAT | os.O_TRUNC
        opened = os.open(name, flags, 0o600)
        os.dup2(opened, stream)
        os.close(opened)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if limited:
        resource.setrlimit(resource.RLIMIT_CPU, (CPU_SECONDS, CPU_SECONDS + 1))
    own = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (own + 2 * MEMORY, own + 2 * MEMORY))
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    signal.setitimer(signal.ITIMER_REAL, WALL_SECONDS)


if __name__ == "__main__":
    main()
