"""What a recording holds, read back from its file."""

import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import rerun.blueprint as rrb
from numpy.typing import NDArray
from rerun.chunk import RrdReader

from refseq.viewer.sinks import PROGRAM


def entities(path: Path) -> set[str]:
    """All entities with data."""
    return {chunk.entity_path for chunk in RrdReader(path).stream()}


def rows(path: Path, entity: str, component: str, line: str | None = None) -> list[tuple[Any, Any]]:
    """Pairs of a moment on a time ``line`` and a component's value, in the order of time; None: what is static."""
    found = []
    for chunk in RrdReader(path).stream():
        batch = chunk.to_record_batch()
        names = batch.schema.names
        if chunk.entity_path == entity and chunk.is_static == (line is None) and component in names:
            moments = range(batch.num_rows) if line is None else batch.column(line).to_pylist()
            found += zip(moments, batch.column(component).to_pylist(), strict=True)
    return sorted(found, key=lambda pair: pair[0])


def values(path: Path, entity: str, component: str, line: str | None = None) -> list[Any]:
    """A component's values in the order of a time ``line``; None: what is static."""
    return [value for _, value in rows(path, entity, component, line)]


def picture(path: Path, entity: str) -> NDArray[np.uint8]:
    """A picture that does not change, (h, w, 3), red, green and blue."""
    (blob,) = values(path, entity, "EncodedImage:blob")
    image = cv2.imdecode(np.array(blob[0], np.uint8), cv2.IMREAD_COLOR)
    assert image is not None
    return np.asarray(image[:, :, ::-1])


def views_of(layout: rrb.Container | rrb.View) -> Iterator[rrb.View]:
    """All views of a layout."""
    if isinstance(layout, rrb.View):
        yield layout
        return
    for part in layout.contents:
        assert isinstance(part, rrb.Container | rrb.View)
        yield from views_of(part)


def empty_views(layout: rrb.Container, path: Path) -> list[str]:
    """Names of views that no entity of a recording goes into."""
    there = entities(path)
    return [
        str(view.name)
        for view in views_of(layout)
        if not any(f"{entity}/".startswith(f"/{str(view.origin).strip('/')}/") for entity in there)
    ]


def verified(path: Path) -> bool:
    """Whether Rerun's own check finds nothing."""
    return _rrd("verify", path)


def same(one: Path, other: Path) -> bool:
    """Whether two recordings hold the same."""
    return _rrd("compare", one, other)


def _rrd(*words: str | Path) -> bool:
    run = subprocess.run([*PROGRAM, "rrd", *words], capture_output=True, check=False)
    return run.returncode == 0
