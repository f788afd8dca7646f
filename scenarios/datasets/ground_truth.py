"""Ground truth by picture: which reference pictures are right for each query picture."""

import itertools
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from refseq_bench.scenarios.datasets.ground_truth_files import read_right
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.scoring.comparison import Comparison
from refseq_bench.scenarios.scoring.frames import FramePose
from refseq_bench.scenarios.scoring.path_geometry import LengthUnit, Tolerance

RULE = re.compile(r"frame\s*([+-]\s*\d+)?\s*(?:±|\+/?-)\s*(\d+)")
"""A rule as ``frame±2`` or, for a query that begins 30 pictures later, ``frame+30±2``; ``+-`` stands for ``±``."""


def frames(within: float) -> Tolerance:
    """A tolerance in reference pictures."""
    return Tolerance(within, unit=LengthUnit.FRAMES)


def beside(wide: float) -> Tolerance:
    """The narrower tolerance: half as many pictures, or, where the wide one is a single one, the very picture."""
    return frames(max(1.0, wide // 2) if wide > 1 else 0.5)


@dataclass(frozen=True)
class FrameRule:
    """Right are the reference pictures ``within`` so many of the query's number plus ``shift``."""

    within: int
    shift: int = 0

    def check(self, references: int, queries: int) -> None:
        """Nothing: the rule fits any number of pictures; queries beyond the reference are off the map."""

    def marked(self, number: int) -> FramePose:
        """The place of query picture ``number``."""
        return FramePose(float(number + self.shift), 0.0, 0.0)

    @property
    def tolerances(self) -> tuple[Tolerance, Tolerance]:
        """The wide and the narrow one."""
        return frames(float(self.within)), beside(self.within)


@dataclass(frozen=True)
class FrameTable:
    """Right reference pictures of each query picture by its number, as a file lists them; none: off the map."""

    source: Path
    right: Mapping[int, Sequence[int]]
    queries: int | None = None

    def check(self, references: int, queries: int) -> None:
        """Raise ``ScenarioError`` where the table does not fit the pictures."""
        if self.queries is not None and self.queries != queries:
            raise ScenarioError(f"{self.source}: is of {self.queries} queries; valid are {queries}, one a picture")
        if (last := max(self.right, default=0)) >= queries:
            raise ScenarioError(f"{self.source}: names query {last}; valid are 0 to {queries - 1}")
        if (last := max((frame for frames in self.right.values() for frame in frames), default=0)) >= references:
            raise ScenarioError(f"{self.source}: names reference picture {last}; valid are 0 to {references - 1}")

    def marked(self, number: int) -> FramePose:
        """The place of query picture ``number``: the middle of its right ones; far from all where it has none."""
        frames = sorted(self.right.get(number, ()))
        if not frames:
            return FramePose(NOWHERE, 0.0, 0.0, frozenset())
        return FramePose(float(frames[len(frames) // 2]), 0.0, 0.0, frozenset(frames))

    @property
    def tolerances(self) -> tuple[Tolerance, Tolerance]:
        """The widest that the table allows to one side of the middle, and the narrow one; the table itself decides."""
        widest = max(
            (max(abs(frame - self.marked(query).x) for frame in frames) for query, frames in self.right.items())
        )
        return frames(max(1.0, widest)), beside(widest)


NOWHERE = -1e9
"""Frame of a query that has no right picture."""

GroundTruth = FrameRule | FrameTable


def ground_truth(text: str) -> GroundTruth:
    """A rule as ``frame±2``, or the file that lists the right pictures. Raises ``ScenarioError``."""
    if match := RULE.fullmatch(text.strip()):
        within, shift = int(match[2]), int((match[1] or "0").replace(" ", ""))
        if within < 1:
            raise ScenarioError(f"ground truth {text!r}: within {within} pictures is not valid; it should be 1 or more")
        return FrameRule(within, shift)
    path = Path(text)
    if not path.is_file():
        raise ScenarioError(
            f"ground truth {text!r} is no file; valid are frame±N, frame+SHIFT±N, and a file: .csv, .npy or .npz"
        )
    queries, right = read_right(path)
    return FrameTable(path, right, queries)


@dataclass(frozen=True)
class PictureTruth:
    """A ground truth for two drives; ``first`` are the numbers of their first pictures, reference and query."""

    given: GroundTruth
    first: tuple[int, int] = (0, 0)

    @property
    def tolerances(self) -> tuple[Tolerance, Tolerance]:
        """The wide and the narrow one, in pictures."""
        return self.given.tolerances

    def judging(self, comparison: Comparison) -> Comparison:
        """The comparison with its views on a line of reference pictures, a frame from each to the next, for scoring.

        Raises ``ScenarioError`` where the ground truth does not fit the pictures.
        """
        references, queries = comparison.reference_views, comparison.query_views
        self.given.check(self.first[0] + len(references), self.first[1] + len(queries))
        places = (FramePose(float(number), 0.0, 0.0) for number in itertools.count(self.first[0]))
        asked = (self.given.marked(number) for number in itertools.count(self.first[1]))
        return replace(
            comparison,
            reference_views=[replace(view, truth=place) for view, place in zip(references, places, strict=False)],
            query_views=[replace(view, truth=place) for view, place in zip(queries, asked, strict=False)],
        )
