"""The look of the pages, without a browser: contrast by WCAG 2.2, colours seen by the colour-blind, nothing fetched."""

import base64
import hashlib
import itertools
import re
from importlib.resources import files

import numpy as np
import pytest
from numpy.typing import NDArray

from refseq.belief import Stage
from refseq_bench.scenarios.report.page import SCRIPT, STYLE, policy, rendered
from refseq_bench.scenarios.report.plots import style
from refseq_bench.scenarios.report.plots.plan import OUTCOME_STYLES

TEMPLATES = files("refseq_bench.scenarios.report") / "templates"
CSS = (TEMPLATES / STYLE).read_text("utf-8")
PAIRS = {name: (light, dark) for name, light, dark in re.findall(r"--(\w+): light-dark\((#\w{6}), (#\w{6})\);", CSS)}
PRINTED = dict(re.findall(r"--(\w+): (#\w{6});", CSS[CSS.index("@media print") :]))
SCHEMES = {
    "light": {name: pair[0] for name, pair in PAIRS.items()},
    "dark": {name: pair[1] for name, pair in PAIRS.items()},
    "print": {name: pair[0] for name, pair in PAIRS.items()} | PRINTED,
}
TEXT, GRAPHICS = 4.5, 3.0
"""Least contrast of text (criterion 1.4.3) and of what else must be seen (1.4.11)."""


def linear(colour: str) -> NDArray[np.float64]:
    """The light of the three primaries of an sRGB colour."""
    shares = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    return np.where(shares <= 0.04045, shares / 12.92, ((shares + 0.055) / 1.055) ** 2.4)


def contrast(one: str, other: str) -> float:
    low, high = sorted(float(linear(colour) @ (0.2126, 0.7152, 0.0722)) for colour in (one, other))
    return (high + 0.05) / (low + 0.05)


def test_contrast_is_what_wcag_says() -> None:
    assert contrast("#000000", "#ffffff") == pytest.approx(21)
    assert contrast("#777777", "#ffffff") == pytest.approx(4.48, abs=0.005)


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("ground", ["paper", "shade"])
@pytest.mark.parametrize("text", ["ink", "soft", "good", "bad", "broken"])
def test_text_stands_out_from_its_ground(scheme: str, ground: str, text: str) -> None:
    colours = SCHEMES[scheme]
    assert contrast(colours[text], colours[ground]) >= TEXT


def test_paper_is_white_whatever_the_screen_shows() -> None:
    assert SCHEMES["print"]["paper"] == SCHEMES["print"]["shade"] == "#ffffff"
    assert "color-scheme: light !important" in CSS[CSS.index("@media print") :]


def drawn_colours() -> set[str]:
    """All colours that plots name for themselves; ink is the page's."""
    methods = [*style.STAGE_STYLES.values(), *style.OTHER_STYLES]
    found = {colour for colour, _, _ in methods} | {colour for _, colour in OUTCOME_STYLES.values()}
    return found | {style.REFERENCE, style.QUERY, style.WALL, style.FAULTY, *style.DRIVE_COLOURS}


@pytest.mark.parametrize("scheme", SCHEMES)
def test_what_is_drawn_stands_out_from_light_and_dark_paper(scheme: str) -> None:
    weak = {c: contrast(c, SCHEMES[scheme]["paper"]) for c in drawn_colours()}
    assert {colour: found for colour, found in weak.items() if found < GRAPHICS} == {}


BLIND = {
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    "tritanopia": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
}
"""What is left of the primaries' light (G. Machado et al., IEEE Trans. Vis. Comput. Graph. 15(6), 2009, severity 1)."""
TO_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
APART = 20
"""Colours this far apart in CIELAB are told apart at a glance; 2.3 is what can just be told."""


def lab(light: NDArray[np.float64]) -> NDArray[np.float64]:
    share = (TO_XYZ @ np.clip(light, 0, 1)) / (0.9505, 1.0, 1.089)
    x, y, z = np.where(share > (6 / 29) ** 3, np.cbrt(share), share * (29 / 6) ** 2 / 3 + 4 / 29)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


MEANT = {
    "stages": [style.STAGE_STYLES[stage][0] for stage in Stage],
    "both drives": [style.REFERENCE, style.QUERY],
    "belief and truth": [style.BELIEF, style.TRUTH],
    "a mission's first and second order": list(style.DRIVE_COLOURS[:2]),
    "a mission's second and third order": list(style.DRIVE_COLOURS[1:3]),
}
"""What has no mark or word of its own right there; all else is told apart by that too."""


@pytest.mark.parametrize("meant", MEANT)
@pytest.mark.parametrize("blindness", BLIND)
def test_colours_that_mean_different_things_differ_to_the_colour_blind(blindness: str, meant: str) -> None:
    seen = [lab(np.array(BLIND[blindness]) @ linear(colour)) for colour in MEANT[meant]]
    assert min(np.linalg.norm(a - b) for a, b in itertools.combinations(seen, 2)) > APART


def test_drives_and_methods_have_marks_beside_colours() -> None:
    looks = [(n % len(style.DRIVE_COLOURS), n % len(style.DRIVE_MARKERS)) for n in range(56)]
    assert len(set(looks)) == 56
    assert len({marker for _, _, marker in style.OTHER_STYLES}) == len(style.OTHER_STYLES)
    assert len({marker for marker, _ in OUTCOME_STYLES.values()}) == len(OUTCOME_STYLES)


def test_style_asks_for_nothing_and_every_colour_that_is_used_is_there() -> None:
    assert not re.search(r"@import|url\(|@font-face", CSS)
    assert {*re.findall(r"var\(--(\w+)\)", CSS)} <= {*re.findall(r"--(\w+):", CSS)}
    assert set(re.findall(r"--(\w+):", CSS)) == {*PAIRS, "edge"}
    assert not re.search(r"style=|<style|#[0-9a-f]{6}", "".join(_templates()))


def _templates() -> list[str]:
    """All templates but the one that the style is put into."""
    return [t.read_text("utf-8") for t in TEMPLATES.iterdir() if t.name.endswith(".j2") and t.name != "base.html.j2"]


def test_a_page_allows_one_script_and_nothing_from_outside() -> None:
    page = rendered("report.html.j2", title="t", facts=(), details=(), sections=())
    (script,) = re.findall(r"<script>(.*?)</script>", page, re.S)
    assert script == (TEMPLATES / SCRIPT).read_text("utf-8")
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    (told,) = re.findall(r'Content-Security-Policy" content="([^"]*)"', page)
    assert told.replace("&#39;", "'") == policy(script)
    rules = dict(rule.split(" ", 1) for rule in policy(script).split("; "))
    assert rules["default-src"] == "'none'"
    assert rules["script-src"] == f"'sha256-{digest}'"
    assert rules["img-src"] == "data:"
