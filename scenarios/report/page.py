"""Pages: templates filled in, and figures and pictures as they stand there."""

import base64
import hashlib
import math
from collections.abc import Sequence
from importlib.resources import files

import cv2
import jinja2
import numpy as np
from numpy.typing import NDArray

from refseq.view import Scan
from scenarios.scoring.recovery import DistanceOrNever
from scenarios.scoring.tables import NONE

FRAME_WIDTH = 320
"""Width of a frame [pixels]."""
SCAN_REACH = 12.0
"""How far a drawn scan reaches [m]."""


STYLE, SCRIPT = "style.css", "page.js"
"""What all pages look like, and what sorts their tables: beside the templates, and put into every page."""


def rendered(template: str, **content: object) -> str:
    """A page from one of the templates; all text that is put in is escaped.

    A browser is told to fetch nothing for it, and to run no other script than ours.
    """
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("scenarios.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
    )
    style, script = _beside(STYLE), _beside(SCRIPT)
    environment.globals |= {"reach": f"{SCAN_REACH:g}", "style": style, "script": script, "policy": policy(script)}
    return environment.get_template(template).render(**content)


def policy(script: str) -> str:
    """What a browser may do for a page (Content Security Policy, level 2): nothing from outside, and one script."""
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    allowed = "img-src data:; style-src 'unsafe-inline'"  # matplotlib styles each line of a drawing where it stands
    return f"default-src 'none'; {allowed}; script-src 'sha256-{digest}'; base-uri 'none'; form-action 'none'"


def _beside(name: str) -> str:
    """The text of a file that lies beside the templates."""
    return files("scenarios.report").joinpath("templates", name).read_text("utf-8")


def metres(value: float) -> str:
    """A length [m]."""
    return NONE if math.isnan(value) else f"{value:.2f} m"


def number(value: float | None) -> str:
    """A figure without a unit."""
    return NONE if value is None or math.isnan(value) else f"{value:.3f}"


def size_text(count: float) -> str:
    """A number of bytes in the unit that leaves one to three digits before the point."""
    for unit in ("B", "kB", "MB"):
        if count < 1000:
            return f"{count:.0f} {unit}" if unit == "B" else f"{count:.3g} {unit}"
        count /= 1000
    return f"{count:.3g} GB"


def duration_text(seconds: float) -> str:
    """A time on the wall clock."""
    if seconds < 60:
        return f"{seconds:.1f} s"
    minutes, left = divmod(round(seconds), 60)
    return f"{minutes} min {left:02d} s" if minutes < 60 else f"{minutes // 60} h {minutes % 60:02d} min"


def ways(found: Sequence[DistanceOrNever]) -> str:
    """Median of some ways, and how many never got there."""
    there = [way for way in found if way is not None]
    never = len(found) - len(there)
    return (metres(float(np.median(there))) if there else NONE) + (f" ({never} never)" if never else "")


def picture(image: NDArray[np.uint8]) -> str:
    """A frame as a small JPEG data URI."""
    height, width = image.shape
    small = cv2.resize(image, (FRAME_WIDTH, round(FRAME_WIDTH * height / width)), interpolation=cv2.INTER_AREA)
    _, data = cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, 80])
    return "data:image/jpeg;base64," + base64.b64encode(data.tobytes()).decode()


def scan_outline(scan: Scan) -> str:
    """A scan as the points of an SVG polyline, the robot in the middle at (0, 0) looking up, in decimetres."""
    ranges = np.minimum(scan.ranges, SCAN_REACH).astype(float)
    left, ahead = ranges * np.sin(scan.bearings), ranges * np.cos(scan.bearings)
    points = np.round(np.stack([-left, -ahead], axis=1) * 10).astype(int)
    # Beams next to each other often end in the same decimetre.
    kept = np.concatenate([[True], (np.diff(points, axis=0) != 0).any(axis=1)])
    return " ".join(f"{x},{y}" for x, y in points[kept])
