import importlib
import subprocess
import sys

import pytest

from refseq_bench.scenarios.errors import FAMILIES, ScenarioError, input_errors

ONLY_OWN = """
import sys
from refseq_bench.scenarios.errors import input_errors
print(len(input_errors()), "mujoco" in sys.modules)
"""


@pytest.mark.parametrize(("room", "family"), FAMILIES.items())
def test_one_clause_catches_every_room_s_errors(room: str, family: str) -> None:
    error = getattr(importlib.import_module(f"{room}.errors"), family)
    assert issubclass(error, input_errors())
    with pytest.raises(input_errors(), match=r"^speed 9 m/s is not valid$"):
        raise error("speed 9 m/s is not valid")


def test_one_clause_lets_faults_of_the_code_pass() -> None:
    assert issubclass(ScenarioError, input_errors())
    assert not issubclass(ValueError, input_errors())


def test_rooms_that_were_never_imported_are_left_out() -> None:
    said = subprocess.run([sys.executable, "-c", ONLY_OWN], capture_output=True, text=True, check=True).stdout
    assert said == "1 False\n"
