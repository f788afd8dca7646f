"""Write a floor plan as TOML that a person can go on with; ``parse_plan`` reads the same plan from it."""

import datetime
import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from refseq_bench.worlds.plans.schema import FloorPlan


def plan_text(plan: FloorPlan, comment: str = "") -> str:
    """Return a plan as TOML, without what is a default; ``comment`` is its first line."""
    found = plan.model_dump(exclude_defaults=True)
    lines = [f"# {comment}"] if comment else []
    lines += [line for key, value in found.items() if not isinstance(value, Mapping) for line in _entry(key, value)]
    for key, value in found.items():
        if isinstance(value, Mapping):
            lines += ["", f"[{key}]", *(f"{_key(k)} = {_value(v)}" for k, v in value.items())]
    return "\n".join(lines) + "\n"


def _entry(key: str, value: Any) -> Iterator[str]:
    """A key of the plan itself; of a list of tables each has a line."""
    if not _is_list(value):
        yield f"{key} = {_value(value)}"
        return
    yield from ("", f"{key} = [", *(f"  {_value(one)}," for one in value), "]")


def _is_list(value: Any) -> bool:
    return isinstance(value, Sequence) and not isinstance(value, str)


def _value(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(k)} = {_value(v)}" for k, v in value.items()) + " }"
    if _is_list(value):
        return "[" + ", ".join(_value(one) for one in value) + "]"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")  # the one that JSON leaves as it is
    if isinstance(value, datetime.date):
        return value.isoformat()
    return repr(value)


def _key(key: str) -> str:
    return json.dumps(key) if "." in key else key
