"""What a map reckons once, before its first view has to wait for it: the calibrations that localising in it needs."""

from refseq.map.blocks.key_block import keys_elsewhere
from refseq.map.blocks.scan_block import known_scans
from refseq.map.map import Map
from refseq.view import LASER


def reckon_once(map_: Map) -> None:
    """Reckon it now: seconds on a map of a hundred places, minutes on one of a hundred thousand."""
    settings = map_.profile.log_ratio
    if not map_.profile.by_log_ratios:
        for sequence in map_.sequences:
            _ = sequence.emissions
        return
    for sequence in map_.sequences:
        _ = sequence.layered_ratios or sequence.log_ratio_model
    if LASER in map_.sensors and max(settings.scans, settings.scans_alone) > 0:
        map_.once(known_scans)
    if settings.geometry > 0:
        map_.once(keys_elsewhere)
