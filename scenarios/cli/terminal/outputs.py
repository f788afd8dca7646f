"""Options that name a file to write, each with the endings that its name may have.

A name that ends otherwise is refused before anything is read: a slip of the hand would put a map where a recording was.
"""

from pathlib import Path
from typing import Any, NamedTuple

from refseq_bench.scenarios.cli.terminal.options import option
from refseq_bench.scenarios.errors import ScenarioError


class FileKind(NamedTuple):
    """A kind of file that is written: its name in a sentence, and the endings that its files may have."""

    noun: str
    endings: tuple[str, ...]

    @property
    def listed(self) -> str:
        """The endings, as a sentence has them."""
        *others, last = self.endings
        return f"{', '.join(others)} or {last}" if others else last

    def check(self, path: Path | None) -> None:
        """Raise ``ScenarioError`` for a name that ends otherwise; None: no file is asked for.

        A folder is told as such by ``check_output``.
        """
        if path is not None and not path.is_dir() and path.suffix.lower() not in self.endings:
            raise ScenarioError(f"{path}: is no name of {self.noun}; valid is one that ends in {self.listed}")


MAP = FileKind("a map", (".refseq",))
DRIVE = FileKind("a recording", (".mcap",))
ANSWERS = FileKind("beliefs", (".parquet",))
SCREENING = FileKind("a file for the viewer", (".rrd",))
PAGE = FileKind("a page", (".html",))
DECISIONS = FileKind("decisions", (".toml",))
LAYOUT = FileKind("a layout", (".json",))
ARRAYS = FileKind("arrays", (".npz",))
TABLE = FileKind("a table", (".csv",))
SCENE = FileKind("a scene", (".scene",))
PLAN = FileKind("a plan", (".toml",))
DRAWING = FileKind("a picture", (".svg",))
SHOT = FileKind("a picture", (".svg", ".png"))
FIGURE = FileKind("a picture", (".png", ".svg", ".pdf"))


def file_to_write(kind: FileKind, text: str, *names: str, **more: Any) -> Any:
    """Declare an option for a file of a kind; its help is ``text`` and the endings."""

    def checked(path: Path | None) -> Path | None:
        kind.check(path)
        return path

    return option("FILE", f"{text} ({kind.listed}).", *names, callback=checked, **more)


def output_file(kind: FileKind, text: str) -> Any:
    """Declare a command's main result, as ``--output`` or ``-o``."""
    return file_to_write(kind, text, "--output", "-o")


BELIEFS = output_file(ANSWERS, "Beliefs to write")
PICTURE = output_file(SHOT, "Picture to write")
CHART = output_file(FIGURE, "Picture to write")
MAP_TO_WRITE = output_file(MAP, "Map to write")
PAGE_TO_WRITE = output_file(PAGE, "Page to write")
