"""Write a floor plan as TOML that a person can go on with; ``parse_plan`` reads the same plan from it."""

from collections.abc import Iterator, Mapping
from typing import Any

from refseq_bench.text_file import is_list, toml_key, toml_value
from refseq_bench.worlds.plans.schema import FloorPlan


def plan_text(plan: FloorPlan, comment: str = "") -> str:
    """Return a plan as TOML, without what is a default; ``comment`` is its first line."""
    found = plan.model_dump(exclude_defaults=True)
    lines = [f"# {comment}"] if comment else []
    lines += [line for key, value in found.items() if not isinstance(value, Mapping) for line in _entry(key, value)]
    for key, value in found.items():
        if isinstance(value, Mapping):
            lines += ["", f"[{key}]", *(f"{toml_key(k)} = {toml_value(v)}" for k, v in value.items())]
    return "\n".join(lines) + "\n"


def _entry(key: str, value: Any) -> Iterator[str]:
    """A key of the plan itself; of a list of tables each has a line."""
    if not is_list(value):
        yield f"{key} = {toml_value(value)}"
        return
    yield from ("", f"{key} = [", *(f"  {toml_value(one)}," for one in value), "]")
