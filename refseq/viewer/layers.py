"""A recording in layers: the drive in one file, each localiser's answers in another; the viewer puts them together."""

from collections.abc import Sequence
from pathlib import Path

from refseq.errors import RefseqError
from refseq.viewer.localise_tab import LocaliseTab
from refseq.viewer.recording import saved, send_layout
from refseq.viewer.tab import Tab

DRIVE = "drive"
"""Name of the layer that is no localiser's."""


def write_layers(folder: Path, tab: LocaliseTab, others: Sequence[Tab] = (), *, name: str) -> list[Path]:
    """Write the drive and each localiser's answers to files of their own, which the viewer shows as one recording.

    ``drive.rrd`` has the layout of all and what ``others`` show; ``NAME.rrd`` nothing but what that localiser answered,
    so that it can be made again, or taken away, without the others. Gives back the files, the drive's first. Raises
    ``RefseqError`` for a localiser whose name makes no file's.
    """
    for layer in tab.layers:
        if layer.name == DRIVE or not layer.name or Path(layer.name).name != layer.name:
            raise RefseqError(f"localiser {layer.name!r}: cannot name a layer; valid is a file's name, not {DRIVE!r}")
    tabs = [*others, tab]
    paths = [folder / f"{DRIVE}.rrd"]
    with saved(paths[0], name) as stream:
        send_layout(stream, tabs, name=name, active=len(others))
        for other in others:
            other.send(stream)
        tab.send_drive(stream)
    for layer in tab.layers:
        paths.append(folder / f"{layer.name}.rrd")
        with saved(paths[-1], name) as stream:
            tab.send_layer(stream, layer)
    return paths
