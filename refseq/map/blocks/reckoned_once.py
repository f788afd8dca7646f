"""Calibrations of a map, reckoned when they are first asked for; or beforehand, so that no robot waits for them."""

from collections.abc import Sequence

from refseq.belief import Stage
from refseq.map.blocks.key_block import keys_elsewhere
from refseq.map.blocks.scan_block import ScanBlock, known_scans, scores_screened
from refseq.map.map import Map
from refseq.map.matcher import wanted_of
from refseq.map.poses_beside import PosesBeside
from refseq.view import LASER


def reckon_once(map_: Map, *, stage: Stage = Stage.CHAIN, sensors: Sequence[str] | None = None) -> None:
    """Reckon now what a ``Localiser`` of a stage and sensors asks for at its first view, and nothing else.

    That is seconds on a map of a hundred places, minutes on one of a hundred thousand. Raises ``MapError`` for a sensor
    that the map does not have.
    """
    wanted = wanted_of(map_, sensors)
    if not map_.profile.by_log_ratios:
        for sequence in map_.sequences if stage is Stage.CHAIN else ():
            _ = sequence.emissions
        return
    for sequence in map_.sequences:
        _ = sequence.layered_ratios or sequence.log_ratio_model
    if LASER in wanted and (scans := ScanBlock(map_, PosesBeside(map_), wanted)).most > 0:
        map_.once(known_scans)
        if scans.screened:
            map_.once(scores_screened)
    if map_.profile.log_ratio.geometry > 0 and wanted - {LASER}:
        map_.once(keys_elsewhere)
