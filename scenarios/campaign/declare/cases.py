"""Scenario files to cases: finding, reading, expanding, and checking all that can be checked before the first drive."""

from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any

from pydantic import ValidationError

from refseq_bench.scenarios.campaign.declare.case import Case
from refseq_bench.scenarios.campaign.declare.expand import Values, expanded, put
from refseq_bench.scenarios.campaign.declare.schema import ONLY_SEED, kind_of
from refseq_bench.scenarios.campaign.declare.schema_types import schema_type_of
from refseq_bench.scenarios.campaign.declare.validation_errors import first_error
from refseq_bench.scenarios.errors import ScenarioError, input_errors
from refseq_bench.scenarios.library import LIBRARY
from refseq_bench.text_file import TextFileError, read_toml

SOURCE_KEYS = {"world", "log", "images"}
"""Keys of which each says what kind of source a table is; a query of another kind takes over nothing."""
SUFFIX = ".toml"
"""Ending of a scenario's file."""


def names() -> tuple[str, ...]:
    """Scenarios of the library, without the floor plans that lie beside those that drive in them."""
    return tuple(sorted(path.stem for path in LIBRARY.glob(f"*{SUFFIX}") if "reference" in _table(path)))


def find(names_or_files: Sequence[str], *, runnable: bool = True, rejudged: bool = False) -> list[Case]:
    """The cases of scenarios by their names, tags, files, or names of single cases; each once.

    Where they need not be ``runnable``, as in a list, it is not asked whether they can be run, which is half the time.
    Where they are ``rejudged``, as localisers of a user are judged in their stead, it is not asked whether expectations
    decide anything about who is judged by the file: ``with_methods`` gives them their meaning.

    Raises ``ScenarioError`` for a name that is none of these, for a file that is no scenario, and for two files of one
    name, whose cases nobody could tell apart.
    """
    found: dict[str, Case] = {}
    ours = () if all(wanted.endswith(SUFFIX) for wanted in names_or_files) else names()
    for case in (case for wanted in names_or_files for case in _found(wanted, ours, runnable, rejudged)):
        first = found.setdefault(case.name, case)
        if first is not case and first.file.resolve() != case.file.resolve():
            raise ScenarioError(
                f"{first.file} and {case.file}: both make a case {case.name!r}; valid are names that differ"
            )
    return list(found.values())


def _found(wanted: str, ours: Sequence[str], runnable: bool, rejudged: bool) -> list[Case]:
    """The cases that a name, a tag, a file or a case's name means; ``ours`` are the library's scenarios."""
    if wanted.endswith(SUFFIX):
        return load(Path(wanted), runnable=runnable, rejudged=rejudged)
    name, stroke, _ = wanted.partition("/")
    if name in ours:
        cases = load(_ours(name), runnable=runnable, rejudged=rejudged)
        chosen = [case for case in cases if not stroke or case.name == wanted]
        if not chosen:
            raise ScenarioError(f"case {wanted!r} is unknown; valid are {', '.join(case.name for case in cases)}")
        return chosen
    tags = {each: _table(_ours(each)).get("tags", []) for each in ours}
    tagged = [each for each, of_file in tags.items() if wanted in of_file]
    if not tagged:
        valid = ", ".join(sorted({tag for of_file in tags.values() for tag in of_file}))
        raise ScenarioError(
            f"scenario {wanted!r} is unknown; valid are {', '.join(ours)}, a tag ({valid}), or a path "
            f"that ends in {SUFFIX}"
        )
    return [case for each in tagged for case in load(_ours(each), runnable=runnable, rejudged=rejudged)]


def _ours(name: str) -> Path:
    """The file of a scenario of the library."""
    return LIBRARY / f"{name}{SUFFIX}"


def load(path: Path, *, runnable: bool = True, rejudged: bool = False) -> list[Case]:
    """The cases of a scenario file, ``runnable`` and ``rejudged`` as in ``find``.

    Raises ``ScenarioError`` with the file, the key and what is valid.
    """
    table = _table(path)
    of_each = {key: value for key, value in table.items() if key != "vary"}
    try:
        variations = expanded(table.get("vary"))
        cases = [_case(path, name, values, put(of_each, values)) for name, values in variations]
        if runnable:
            # Robots, worlds and sensors, which who lists scenarios does not wait for.
            from refseq_bench.scenarios.campaign.declare.checks.runnable import check_runnable

            check_runnable(cases, rejudged=rejudged)
    except input_errors() as error:
        raise ScenarioError(f"{path}: {' '.join(str(error).split())}") from error
    return cases


def _table(path: Path) -> Mapping[str, Any]:
    """The table of a file, to which nobody writes: of the library's it is shared."""
    try:
        ours = path.parent == LIBRARY and path.is_file()
        return _of_library(path, path.stat().st_mtime_ns) if ours else read_toml(path)
    except TextFileError as error:
        raise ScenarioError(f"{path}: {error}; valid is a scenario in TOML") from None


@cache
def _of_library(path: Path, _changed_ns: int) -> Mapping[str, Any]:
    """Read a file of the library once, as all names are looked for in all of them; again where it was changed."""
    return MappingProxyType(read_toml(path))


def _case(path: Path, name: str, values: Values, table: dict[str, Any]) -> Case:
    for side in ("reference", "query"):
        if not isinstance(table.get(side, {}), dict):
            raise ScenarioError(f"{side}: is no table; valid is [{side}]")
    further = table.get("further", [])
    if not isinstance(further, list) or not all(isinstance(one, dict) for one in further):
        raise ScenarioError("further: is no list of tables; valid is [[further]], once for each further reference")
    reference = table.get("reference", {})
    schema_type = schema_type_of(table)
    table["query"] = {
        **schema_type.query_defaults,
        **_completed(table.get("query", {}), reference, schema_type.not_inherited),
    }
    table["further"] = [_completed(one, reference, ("faults",)) for one in further]
    try:
        scenario = schema_type.model.model_validate(table)
    except ValidationError as error:
        raise ScenarioError(first_error(error, schema_type.model)) from error
    if "seeds" not in scenario.model_fields_set and not scenario.is_drawn:
        scenario = scenario.model_copy(update={"seeds": ONLY_SEED})
    expectations = tuple(schema_type.expectation(text, scenario) for text in scenario.expect)
    full = f"{path.stem}/{name}" if name else path.stem
    return Case(full, path, values, scenario, expectations)


def _completed(source: dict[str, Any], reference: Mapping[str, Any], own: Sequence[str]) -> dict[str, Any]:
    """A source with all that it does not say as in the reference, but its ``own``, if it is of the same kind."""
    if SOURCE_KEYS & set(source) and kind_of(source) != kind_of(reference):
        return source
    return {**{key: value for key, value in reference.items() if key not in own}, **source}
