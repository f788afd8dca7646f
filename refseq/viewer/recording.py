"""A Rerun recording: one layout with a tab each, and the data of all tabs, streamed to wherever it goes."""

import hashlib
import os
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import IO, TypeVar

import rerun as rr
import rerun.blueprint as rrb

from refseq.files import replacing
from refseq.viewer.tab import Tab
from refseq.viewer.timelines import VIEW

APPLICATION = "refseq"
Stream = TypeVar("Stream", bound=rr.RecordingStream)
BATCH = rr.ChunkBatcherConfig(flush_tick=3600.0, flush_num_bytes=1 << 20)
"""Rows go out when a megabyte of them is there, not with the clock: the same drive makes the same chunks."""


def new_stream(recording: str) -> rr.RecordingStream:
    """A stream of one recording; streams with the same ``recording`` are layers that the viewer puts together.

    Nothing of the machine or the hour is in it: neither when it was written, nor a random number.
    """
    return new_stream_of(rr.RecordingStream, recording, BATCH)


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
    """A stream into a ``.rrd`` file, which replaces ``path`` in one step when the block ends well.

    Raises ``OSError`` where the file cannot be written.
    """
    with replacing(path) as file, _pipe_into(file) as pipe, new_stream(recording) as stream:
        stream.save(pipe)
        try:
            yield stream
            stream.flush()
        finally:
            stream.disconnect()


@contextmanager
def _pipe_into(file: IO[bytes]) -> Iterator[str]:
    """A path whose bytes are written to ``file``; at the end, raises the ``OSError`` that this met.

    Rerun's own writer leaves half a file without a word when a disk is full at its end, and waits for ever where it is
    full at its beginning. It never meets one here: what cannot be written is read on, and dropped.
    """
    output, entrance = os.pipe()
    failure: list[OSError] = []

    def copy() -> None:
        while piece := os.read(output, 1 << 20):
            if not failure:
                try:
                    file.write(piece)
                except OSError as error:
                    failure.append(error)

    copier = threading.Thread(target=copy, daemon=True)
    copier.start()
    try:
        yield f"/dev/fd/{entrance}"
    finally:
        os.close(entrance)  # the other end sees the end of it once Rerun has closed its own
        copier.join()
        os.close(output)
    if failure:
        raise failure[0]


def write_recording(path: Path, tabs: Sequence[Tab], *, name: str, active: int = 0, timeline: str = VIEW) -> None:
    """Write a ``.rrd`` file that opens with its own layout, replacing ``path`` in one step.

    It is written as the data come: memory does not grow with the drive.
    """
    with saved(path, name) as stream:
        send(stream, tabs, name=name, active=active, timeline=timeline)
