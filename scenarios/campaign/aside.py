"""Judging in a thread of its own, and leaving while it runs."""

import os
import sys
from collections.abc import Callable
from concurrent.futures import Future
from threading import Thread
from threading import enumerate as threads
from typing import TypeVar

Result = TypeVar("Result")

NAME = "judging"
"""Name of such threads."""


def aside(function: Callable[[], Result]) -> "Future[Result]":
    """Call a function in a thread that, unlike those of Python's pools, keeps nobody from leaving.

    Judging reads whole drives again; meanwhile tasks are handed out and time goes by.
    """
    future: Future[Result] = Future()

    def work() -> None:
        try:
            future.set_result(function())
        except Exception as error:
            future.set_exception(error)

    Thread(target=work, name=NAME, daemon=True).start()
    return future


def leave(code: int) -> None:
    """End the program with ``code`` where something is still judged; else do nothing.

    Python takes itself down beside such a thread, and a library in which that is at the time crashes the program: the
    code would be that of the crash.
    """
    if any(thread.name == NAME for thread in threads()):
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
