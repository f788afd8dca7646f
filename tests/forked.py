"""Call a function in a forked child: what it does to its process ends with it, its lines are counted all the same."""

import json
import os
import traceback
from collections.abc import Callable, Iterator
from contextlib import chdir, contextmanager
from pathlib import Path
from typing import Any

from coverage import Coverage, CoverageData

from tests.pages import ROOT


def in_child(function: Callable[[], Any], folder: Path) -> Any:
    """Give what ``function`` returns in a child, which must be fit for JSON; a child that raised or died is an error.

    ``folder`` must stay writable to the child: what was measured there is left in it. A child that ends itself gives
    its exit code as a ``ChildProcessError``.
    """
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        code = 70
        try:
            with measured(folder / "measured"):
                answer = function()
            os.write(writing, json.dumps(answer).encode())
            code = 0
        except BaseException:
            traceback.print_exc()
        finally:
            os._exit(code)
    os.close(writing)
    with os.fdopen(reading, "rb") as stream:
        told = stream.read()
    _, status = os.waitpid(child, 0)
    code = os.waitstatus_to_exitcode(status)
    count(folder / "measured")
    if code != 0:
        raise ChildProcessError(code)
    return json.loads(told)


@contextmanager
def measured(path: Path) -> Iterator[None]:
    """Measure what a child covers, into a file of its own, where its parent is measured."""
    parent = Coverage.current()
    if parent is None:
        yield
        return
    parent.stop()
    with chdir(ROOT):  # the settings are there, and folders are named from there
        own = Coverage(data_file=path)
        own.start()
    try:
        yield
    finally:
        own.stop()
        own.save()


def count(path: Path) -> None:
    """Count the lines that a child has left as covered by this process."""
    if (parent := Coverage.current()) is not None and path.exists():
        data = CoverageData(basename=str(path))
        data.read()
        parent.get_data().update(data)
        path.unlink()
