"""Threads of the libraries that add up large sums: one each.

A sum that is split among threads is rounded otherwise, and answers must not depend on the cores. It is the faster way
as well where something else runs: threads that wait for each other's share of a view take five times as long for its
words then.
"""

import os

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""Variables of the environment that tell them so, read by each when it is loaded."""


def sum_in_one_thread() -> None:
    """Have libraries that are loaded from now on add up in one thread, unless the environment says otherwise."""
    for name, count in ONE_THREAD.items():
        os.environ.setdefault(name, count)
