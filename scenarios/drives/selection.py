"""Select views of a recording, sensors of a view, and names of topics."""

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from refseq.view import LASER, View
from refseq_bench.scenarios.errors import ScenarioError

SPAN = re.compile(r"(\d*):(\d*)")
"""``FROM:TO``, each of which may be left out."""


def stretch(text: str | None, count: int, path: Path) -> slice:
    """``FROM:TO`` as a slice of the ``count`` views of ``path`` that holds at least one."""
    match = SPAN.fullmatch(text or ":")
    wanted = slice(int(match[1] or 0), int(match[2] or count)) if match else slice(0, 0)
    if not 0 <= wanted.start < wanted.stop <= count:
        raise ScenarioError(f"{path}: views {text!r} is no stretch of it; valid is FROM:TO within 0:{count}")
    return wanted


def first_kept(text: str | None) -> int:
    """Number of the first view of ``FROM:TO``, of which ``stretch`` has seen that it is one."""
    match = SPAN.fullmatch(text or ":")
    return int(match[1] or 0) if match else 0


def only(view: View, sensors: tuple[str, ...] | None) -> View:
    """A view with some of its sensors; None: all."""
    if sensors is None:
        return view
    images = {name: image for name, image in view.images.items() if name in sensors}
    return replace(view, images=images, scan=view.scan if LASER in sensors else None)


def names_by_topic(topics: Mapping[str, str]) -> dict[str, str]:
    """Names of sensors by their topics, of topics by name. Raises ``ScenarioError`` for a topic of two sensors."""
    for topic, number in Counter(topics.values()).items():
        if number > 1:
            sensors = " and ".join(name for name in topics if topics[name] == topic)
            raise ScenarioError(f"topics: {topic} is of {sensors}; valid is a topic for each sensor")
    return {topic: name for name, topic in topics.items()}
