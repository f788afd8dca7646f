"""Resolved configuration of a drive, as the metadata of its recording hold it."""

import json
from collections.abc import Mapping

from refseq_bench.text_file import LONGEST_TEXT


def recorded_config(metadata: Mapping[str, object]) -> Mapping[str, object]:
    """The first drive's, where the metadata are those of several; empty where there is none that can be read."""
    text = str(metadata.get("config", ""))
    if len(text) > LONGEST_TEXT:
        return {}
    try:
        told, _ = json.JSONDecoder().raw_decode(text)
    except (ValueError, RecursionError):
        return {}
    return told if isinstance(told, dict) else {}
