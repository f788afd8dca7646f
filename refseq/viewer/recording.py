"""A Rerun recording: one layout with a tab each, and the data of all tabs, streamed to wherever it goes."""

import hashlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar

import rerun as rr
import rerun.blueprint as rrb

from refseq.files import replacing_at
from refseq.viewer.tab import Tab
from refseq.viewer.timelines import VIEW

APPLICATION = "refseq"
Stream = TypeVar("Stream", bound=rr.RecordingStream)
BATCH = rr.ChunkBatcherConfig(flush_tick=3600.0, flush_num_bytes=1 << 20)
"""Rows go out when a megabyte of them is there, not with the clock: the same drive makes the same chunks."""


def new_stream(recording: str, batches: rr.ChunkBatcherConfig = BATCH) -> rr.RecordingStream:
    """A stream of one recording; streams with the same ``recording`` are layers that the viewer puts together.

    Nothing of the machine or the hour is in it: neither when it was written, nor a random number.
    """
    return new_stream_of(rr.RecordingStream, recording, batches)


def new_stream_of(kind: type[Stream], recording: str, batches: rr.ChunkBatcherConfig) -> Stream:
    """The same, of a class derived from Rerun's."""
    identity = hashlib.sha256(recording.encode()).hexdigest()[:32]
    stream = kind(APPLICATION, recording_id=identity, send_properties=False, batcher_config=batches)
    stream.set_log_tick_enabled(False)
    stream.set_log_time_enabled(False)
    return stream


def blueprint(tabs: Sequence[Tab], *, active: int = 0, timeline: str = VIEW) -> rrb.Blueprint:
    """All tabs beside each other, ``active`` on top; it opens at the drive's end, and plays five views a second.

    A viewer shows nothing on a ``timeline`` that the recording does not have.
    """
    layouts = []
    for tab in tabs:
        layout = tab.layout()
        layout.name = tab.name
        layouts.append(layout)
    return rrb.Blueprint(
        rrb.Tabs(*layouts, active_tab=active) if len(layouts) > 1 else layouts[0],
        rrb.TimePanel(state="collapsed", timeline=timeline, play_state="following", fps=5),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
    )


def send_layout(
    stream: rr.RecordingStream, tabs: Sequence[Tab], *, name: str, active: int = 0, timeline: str = VIEW
) -> None:
    """Send the recording's name and the layout alone, for data that other streams bring."""
    stream.send_recording_name(name)
    stream.send_blueprint(blueprint(tabs, active=active, timeline=timeline))


def send(stream: rr.RecordingStream, tabs: Sequence[Tab], *, name: str, active: int = 0, timeline: str = VIEW) -> None:
    """Send the layout, then the data of one tab after the other; ``name`` is the recording's in the viewer."""
    send_layout(stream, tabs, name=name, active=active, timeline=timeline)
    for tab in tabs:
        tab.send(stream)
    stream.reset_time()


@contextmanager
def saved(path: Path, recording: str) -> Iterator[rr.RecordingStream]:
    """A stream into a ``.rrd`` file, which replaces ``path`` in one step when the block ends well."""
    with replacing_at(path) as temporary, new_stream(recording) as stream:
        stream.save(temporary)
        yield stream
        stream.flush()
        stream.disconnect()


def write_recording(path: Path, tabs: Sequence[Tab], *, name: str, active: int = 0, timeline: str = VIEW) -> None:
    """Write a ``.rrd`` file that opens with its own layout, replacing ``path`` in one step.

    It is written as the data come: memory does not grow with the drive.
    """
    with saved(path, name) as stream:
        send(stream, tabs, name=name, active=active, timeline=timeline)
