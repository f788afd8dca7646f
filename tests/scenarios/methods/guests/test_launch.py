import os
import sys
from typing import Any

import pytest

from refseq_bench.scenarios.methods.guests import confinement, host
from refseq_bench.scenarios.methods.guests.launch import CONFINED, main
from refseq_bench.scenarios.methods.guests.limits import GuestLimits


@pytest.fixture
def done(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Any, ...]]:
    """Steps of the entry, in its order, in place of doing it to this process."""
    steps: list[tuple[Any, ...]] = []
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.setattr(confinement, "confine", lambda *given: steps.append(("confine", *given)))
    monkeypatch.setattr(host, "serve", lambda *given: steps.append(("serve", *given)))
    monkeypatch.setattr(os, "execv", lambda *given: steps.append(("run", *given)))
    return steps


def order(**changed: Any) -> dict[str, Any]:
    plain = {"path": [*sys.path, "/of/the/guest"], "limits": {"memory": 2.0}, "read": ["/lib"], "write": ["/scratch"]}
    return {**plain, "bench": 4711, "program": "", "localiser": "mine:Mine", "threads": 2, **changed}


def test_a_localiser_is_served_after_it_was_confined(done: list[tuple[Any, ...]]) -> None:
    main(order())
    assert done == [("confine", GuestLimits(memory=2.0), ["/lib"], ["/scratch"], 4711), ("serve", "mine:Mine", 2)]
    assert sys.path[-1] == "/of/the/guest"


def test_a_program_takes_the_place_of_the_process_after_it_was_confined(
    done: list[tuple[Any, ...]], monkeypatch: pytest.MonkeyPatch
) -> None:
    def run(*given: Any) -> None:
        done.append(("run", *given))
        raise SystemExit(0)  # nothing comes behind it

    monkeypatch.setattr(os, "execv", run)
    with pytest.raises(SystemExit):
        main(order(program="/bin/mine", localiser=""))
    assert [step[0] for step in done] == ["confine", "run"]
    assert done[1] == ("run", "/bin/mine", ["/bin/mine"])


@pytest.mark.parametrize("error", [OSError(22, "landlock: Invalid argument"), ValueError("not allowed to raise it")])
def test_what_cannot_be_confined_does_not_begin(
    error: Exception,
    done: list[tuple[Any, ...]],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def refused(*_: object) -> None:
        raise error

    monkeypatch.setattr(confinement, "confine", refused)
    with pytest.raises(SystemExit) as caught:
        main(order(program="/bin/mine"))
    assert caught.value.code == CONFINED
    assert capsys.readouterr().err == f"the guest cannot be confined: {error}\n"
    assert done == []
