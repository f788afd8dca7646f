"""HTML pages from templates, and the tables on them."""

import base64
import hashlib
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files

import jinja2

from refseq_bench.scenarios.report.images import SCAN_REACH

STYLE, SCRIPT = "style.css", "page.js"
"""The style sheet and the script that sorts tables: files beside the templates, put into every page."""


def rendered(template: str, script_file: str = SCRIPT, /, **content: object) -> str:
    """Fill in a template; text is escaped, and the page's policy lets a browser fetch nothing and run our script."""
    return _environment(script_file).get_template(template).render(**content)


@lru_cache(maxsize=8)
def _environment(script_file: str) -> jinja2.Environment:
    """Templates, each compiled once: a campaign writes its index after every case."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("refseq_bench.scenarios.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
    )
    style, script = _beside(STYLE), _beside(script_file)
    environment.globals |= {"reach": f"{SCAN_REACH:g}", "style": style, "script": script, "policy": policy(script)}
    return environment


def policy(script: str) -> str:
    """The page's Content Security Policy, level 2: nothing from outside, and one script."""
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    allowed = "img-src data:; style-src 'unsafe-inline'"  # matplotlib styles each line of a drawing where it stands
    return f"default-src 'none'; {allowed}; script-src 'sha256-{digest}'; base-uri 'none'; form-action 'none'"


def _beside(name: str) -> str:
    """Read a file beside the templates."""
    return files("refseq_bench.scenarios.report").joinpath("templates", name).read_text("utf-8")


@dataclass(frozen=True)
class PageRow:
    """A row of figures in words; ``judged`` marks the method that the verdicts are about."""

    label: str
    cells: tuple[str, ...]
    judged: bool = False


@dataclass(frozen=True)
class PageTable:
    """A table with a heading above the rows' labels and above each of their cells."""

    headings: tuple[str, ...]
    rows: tuple[PageRow, ...]
