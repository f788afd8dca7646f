"""Overlaps checked by the laser's scans: cut to what lies on each other, refused, or doubted."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from refseq.atlas.beyond import beyond
from refseq.atlas.found import FoundOverlap
from refseq.atlas.look_alikes import LookAlike, told_inside
from refseq.atlas.overlap import OverlapSettings
from refseq.atlas.scans import LaidScans, ScannedPath, laid_on, scale_between
from refseq.atlas.sharing import views_of
from refseq.map.map import Map


def lie(share: float) -> str:
    """Agreement of scans that are laid on each other, in words, never rounded up to what would be valid."""
    return f"lie on each other to {np.floor(1000 * share) / 1000:.1%}"


class ScanCheck:
    """The scans of a map's paths, whose ``tracks`` (V, 3) are by odometry; nothing is told where one is not known."""

    def __init__(self, map_: Map, tracks: Sequence[NDArray[np.float64]], settings: OverlapSettings) -> None:
        self._map = map_
        self._settings = settings
        self._scans = [ScannedPath.of(track, path.scans) for track, path in zip(tracks, map_.paths, strict=True)]

    def checked(self, found: FoundOverlap) -> FoundOverlap:
        """The part of an overlap whose scans lie on each other, with the views that they lay beside each other.

        It is objected to where none do, and where its paths go on beside each other past walls that are not the same.
        """
        one, other = self._scans[found.one], self._scans[found.other]
        if found.overlap.objection or one is None or other is None:
            return found
        laid, scale = self._laid(found, one, other)
        found = replace(found, scale=scale)
        if laid.share < self._settings.alike or not len(laid.pairs):
            overlap = replace(found.overlap, alike=laid.share, objection=f"its scans {lie(laid.share)}")
            return replace(found, overlap=overlap)
        cut = self._cut(found, laid)
        objection = "" if found.is_loop or cut.overlap.objection else self._going_on(one, other.scaled(scale), laid)
        return replace(cut, overlap=replace(cut.overlap, objection=objection)) if objection else cut

    def _laid(self, found: FoundOverlap, one: ScannedPath, other: ScannedPath) -> tuple[LaidScans, float]:
        """The scans laid on each other, and the scale of the other's odometer by which they lie best."""
        scales = [1.0]
        if not found.is_loop and (its := scale_between(*found.overlap.lengths)):
            scales.append(its)
        valid = self._settings
        tried = [(laid_on(one, other.scaled(scale), found.views, valid.alike, valid.same), scale) for scale in scales]
        return max(tried, key=lambda each: each[0].share)

    def _going_on(self, one: ScannedPath, other: ScannedPath, laid: LaidScans) -> str:
        """An objection to scans that lie on each other, but not beyond the stretch.

        Rooms so full that scans of one place hardly agree tell nothing by that: there an overlap is doubtful anyhow.
        """
        past = beyond(one, other, laid) if laid.share >= self._settings.same else None
        if past is None or past.share >= laid.share - self._settings.worse:
            return ""
        return (
            f"its scans {lie(laid.share)}, but only to {past.share:.1%} where both paths go on for {past.metres:.1f} m"
        )

    def _cut(self, found: FoundOverlap, laid: LaidScans) -> FoundOverlap:
        """An overlap cut to what scans lay on each other, and doubted where they leave room for it."""
        valid, overlap = self._settings, found.overlap
        held = [views_of(self._map, self._map.paths[path].name) for path in (found.one, found.other)]
        views = laid.pairs[np.isin(laid.pairs[:, 0], held[0]) & np.isin(laid.pairs[:, 1], held[1])]
        along = [self._map.paths[path].along for path in (found.one, found.other)]
        lengths = [float(np.ptp(way[side])) if len(side) else 0.0 for way, side in zip(along, views.T, strict=True)]
        if min(lengths) < (least := valid.held * valid.least):
            objection = f"its scans lie on each other for {min(lengths):.1f} m only; valid is {least:g} m"
            return replace(found, overlap=replace(overlap, alike=laid.share, objection=objection))
        evidence = overlap.evidence * sum(lengths) / max(sum(overlap.lengths), 1e-9)
        doubt = overlap.doubt
        plain = evidence < valid.weighty or evidence < valid.vivid * max(lengths)
        if laid.share < valid.same and plain:
            doubt = doubt or f"of scans that {lie(laid.share)}; valid is {valid.same:.0%}"
        elif laid.share >= valid.exact and evidence >= valid.walled:
            doubt = ""
        cut = replace(
            overlap,
            pairs=np.column_stack([np.searchsorted(its, side) for its, side in zip(held, views.T, strict=True)]),
            lengths=(lengths[0], lengths[1]),
            doubt=doubt,
            evidence=evidence,
            alike=laid.share,
        )
        # Joins' bars were chosen with the mean of their pairs; of a loop scans tell more, where they lie well.
        told = laid.middles if found.is_loop and laid.share >= valid.same else None
        return replace(found, views=views, overlap=cut, laid=told)

    def doubted(self, found: FoundOverlap, known: Sequence[LookAlike]) -> FoundOverlap:
        """An overlap of two paths, with a doubt where it tells of hardly more than a look-alike of those ``known``."""
        if found.is_loop:
            return found
        for path, views in zip((found.one, found.other), found.views.T, strict=True):
            its = self._map.paths[path]
            if twin := told_inside(path, views, its.along, known, self._settings.least):
                first, last = twin.again
                doubt = f"inside a stretch that views {first} to {last} of {its.name!r} look like"
                return replace(found, overlap=replace(found.overlap, doubt=found.overlap.doubt or doubt))
        return found
