"""Select views of a recording, and sensors of a view."""

import re
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
