"""Maps that a merged map was made of: found again beside it, and recorded in it."""

import hashlib
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from refseq.atlas.decision import Decision
from refseq.map.growth.record import GrowthRecord
from refseq.map.map import Map
from refseq.map.merge_record import Member, MergeRecord, Ruling
from refseq_bench.scenarios.drives.inputs import read_map
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.maps.joins import BY_A_PERSON

if TYPE_CHECKING:  # members are looked for before anything is merged
    from refseq.atlas.merge import Merged
    from refseq.atlas.overlap import OverlapSettings


KEEPING = ", or --keep-joins to add to the places that are left"
"""Advice where members are not what was merged, for a command that can do without them."""


class TakenApart(NamedTuple):
    """Maps to merge by their ``files``, a person's ``decisions`` about them, and those ``loaded`` on the way.

    ``min_overlaps`` [m] are those that a person asked for when maps were merged before, each once.
    """

    files: list[Path]
    decisions: list[Decision]
    loaded: Mapping[Path, Map]
    min_overlaps: Sequence[float] = ()

    def min_overlap(self, asked: float | None = None) -> float | None:
        """The one ``asked`` for now, or before; None for the usual. Raises ``ScenarioError`` where several were."""
        if asked is None and len(self.min_overlaps) > 1:
            told = " and ".join(f"{metres:g}" for metres in self.min_overlaps)
            raise ScenarioError(f"the maps were merged with --min-overlap {told}; valid is to give one for all of them")
        return next(iter(self.min_overlaps), None) if asked is None else asked


def overlap_settings(min_overlap: float | None) -> "OverlapSettings":
    """Settings of the search for overlaps with the shortest one [m] that a person asked for, if any."""
    from refseq.atlas.overlap import OverlapSettings

    return OverlapSettings() if min_overlap is None else OverlapSettings(least=min_overlap)


def with_members(paths: Sequence[Path], otherwise: str = KEEPING) -> TakenApart:
    """Maps to merge, in place of each merged one those that it was made of; and a person's decisions about these.

    So all joins are decided about anew, whatever was merged before. A merged map that has no record stays. Raises
    ``ScenarioError`` for a member that is not there, or is not the map any more that was merged, and for drives that
    were added to a merged map alone: its members do not have them. ``otherwise`` ends its advice.
    """
    found, rulings, loaded, least = list[Path](), list[Decision](), dict[Path, Map](), set[float]()
    for path in paths:
        if not path.exists():
            found.append(path)
            continue
        whole = read_map(path)
        members = {
            file: read_map(file) for file in (_found(path, member, otherwise) for member in whole.record.members)
        }
        _check_growth(path, whole, list(members.values()), otherwise)
        loaded |= members or {path: whole}
        found += members or [path]
        rulings += [_decision(ruling) for ruling in whole.record.rulings]
        if whole.record.min_overlap is not None:
            least.add(whole.record.min_overlap)
    return TakenApart(found, rulings, loaded, sorted(least))


def _check_growth(merged: Path, whole: Map, members: Sequence[Map], otherwise: str) -> None:
    if not members:
        return
    known = GrowthRecord.joined(member.grown for member in members)
    lost = [drive for drive in whole.grown.drives if known.drive(drive.sha256) is None]
    if lost:
        raise ScenarioError(
            f"{merged}: drive {lost[0].name!r} was added to it and not to its members, and would be lost; valid is to "
            f"add drives to the members{otherwise}"
        )


def _found(merged: Path, member: Member, otherwise: str) -> Path:
    path = Path(os.path.normpath(merged.resolve().parent / member.file))
    if not path.is_file():
        raise ScenarioError(f"{merged}: its member {path} is not there; valid is to put it back{otherwise}")
    if _digest(path) != member.sha256:
        raise ScenarioError(
            f"{path}: is not the map any more that was merged into {merged}; valid is that one, or to merge the "
            f"members themselves{otherwise}"
        )
    return path


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def with_record(
    merged: "Merged",
    read: Sequence[Map],
    files: Sequence[Path],
    output: Path,
    wishes: Sequence[Decision],
    min_overlap: float | None,
) -> Map:
    """The merged map with a record of its members and a person's wishes, where each member is a map of one path."""
    if not all(one.has_one_path for one in read):
        return merged.map
    answers = [decision for decision in merged.decisions if decision.why == BY_A_PERSON]
    rulings = tuple(_ruling(decision) for decision in newest(answers, wishes))
    return replace(merged.map, record=MergeRecord(_seen_from(output, files), rulings, min_overlap))


def _seen_from(output: Path, paths: Sequence[Path]) -> tuple[Member, ...]:
    """Files that a map is made of, as seen from where it is written."""
    folder = output.resolve().parent
    return tuple(Member(Path(os.path.relpath(path.resolve(), folder)).as_posix(), _digest(path)) for path in paths)


def newest(decisions: Sequence[Decision], before: Sequence[Decision]) -> list[Decision]:
    """Decisions of a person, and those of before about other stretches."""
    return [*decisions, *(one for one in before if not any(one.about(new) for new in decisions))]


def _ruling(decision: Decision) -> Ruling:
    return Ruling(decision.one, decision.other, decision.first, decision.second, decision.joined)


def _decision(ruling: Ruling) -> Decision:
    return Decision(ruling.one, ruling.other, ruling.first, ruling.second, (0.0, 0.0), ruling.joined, BY_A_PERSON)
