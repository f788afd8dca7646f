"""Libraries that add up in one thread, told by one of them in a process of its own."""

import os
import subprocess
import sys

import pytest

from refseq.threads import ONE_THREAD

ASK = """
from refseq.threads import sum_in_one_thread
sum_in_one_thread()
import faiss
print(faiss.omp_get_max_threads())
"""


@pytest.mark.parametrize(("told", "threads"), [({}, 1), ({"OMP_NUM_THREADS": "3"}, 3)])
def test_one_thread_unless_the_environment_says_otherwise(told: dict[str, str], threads: int) -> None:
    environment = {name: value for name, value in os.environ.items() if name not in ONE_THREAD} | told
    found = subprocess.run([sys.executable, "-c", ASK], env=environment, capture_output=True, text=True, check=True)
    assert int(found.stdout) == threads
