"""Record of the worlds on which each method's parameters were chosen, and the refusal to test a method there."""

from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path

from pydantic import BaseModel, ConfigDict, ValidationError

from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.methods.names import profile_of
from refseq_bench.text_file import TextFileError, read_toml

RECORDS = Path(__file__).with_suffix(".toml")


class ChoiceRecord(BaseModel):
    """Profiles and baselines whose parameters were chosen in some worlds, and where that is told."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    methods: tuple[str, ...]
    worlds: tuple[str, ...]
    source: str


class ChoiceRecords(BaseModel):
    """The file."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    record: tuple[ChoiceRecord, ...]


def refuse_chosen_on(methods: Iterable[str], worlds: Iterable[str]) -> None:
    """Raise ``ScenarioError`` for the first method whose record names one of the ``worlds``; dials make no other world.

    Whoever has no record, such as a user's own localiser, is believed.
    """
    tested = {world.partition(",")[0] for world in worlds}
    for method in methods:
        found = records().get((profile_of(method) or method).partition("+")[0])
        if found and (both := sorted(tested & {*found.worlds})):
            raise ScenarioError(
                f"method {method!r}: its parameters were chosen in {both[0]!r} ({found.source}), which is tested here; "
                "valid are methods that were chosen elsewhere"
            )


def records() -> Mapping[str, ChoiceRecord]:
    """The records by profile or baseline. Raises ``ScenarioError`` for a file that is none."""
    return _read(RECORDS)


@cache
def _read(path: Path) -> Mapping[str, ChoiceRecord]:
    try:
        found = ChoiceRecords.model_validate(read_toml(path))
    except (TextFileError, ValidationError) as error:
        raise ScenarioError(f"{path.name}: {' '.join(str(error).split())}; valid are tables [[record]]") from error
    return {method: one for one in found.record for method in one.methods}
