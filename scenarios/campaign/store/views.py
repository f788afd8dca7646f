"""Views of sources: their keys, and reading those of drives from the store."""

import hashlib
from contextlib import suppress
from dataclasses import asdict
from functools import cache
from pathlib import Path

from refseq.errors import LogError
from refseq.logs import Recording
from refseq_bench.scenarios.campaign.declare import real_recordings
from refseq_bench.scenarios.campaign.declare.real_recordings import read_real, real_paths
from refseq_bench.scenarios.campaign.declare.sources import Source
from refseq_bench.scenarios.campaign.store.cache import RECORDING, DamagedError, Store
from refseq_bench.scenarios.campaign.store.contents import content_digest
from refseq_bench.scenarios.campaign.store.keys import LENGTH, code_digest, key_of
from refseq_bench.scenarios.campaign.store.recordings import read_kept
from refseq_bench.scenarios.drives.drive import Drive
from refseq_bench.scenarios.drives.record import record
from refseq_bench.sim.rendering.drivers import GlDevice, VulkanDriver, gl_device, vulkan_driver
from refseq_bench.sim.rendering.renderer import RendererKind


def source_key(source: Source) -> str:
    """Key of a source's views: of a real recording its content counts, wherever it lies and whenever it was copied.

    Raises ``AbsentError`` for a recording that is not on this machine.
    """
    if isinstance(source, Drive):
        return recording_key(source)
    paths, found = real_paths(source), None
    with suppress(OSError):  # whoever is to read it will tell
        found = [content_digest(path) for path in paths]
    told = {key: value for key, value in asdict(source).items() if key != "beside"}
    return key_of(type(source).__name__, told, found, code_digest(real_recordings.__name__))


def recording_key(drive: Drive) -> str:
    """Key of a drive's recording: the drive, files that it names, the code that makes it, the device that renders.

    Another device rounds otherwise, and so may another version of its driver.
    """
    fields = asdict(drive)
    fields["world"] = _content(drive.world)
    fields["cameras"] = {camera: _content(model) for camera, model in drive.cameras.items()}
    return key_of("recording", fields, code_digest(record.__module__), drawing_device(drive.renderer))


@cache
def drawing_device(renderer: RendererKind) -> GlDevice | VulkanDriver | None:
    """Device and driver that draw for a renderer, asked once a process; None: draws nothing, has none."""
    match renderer:
        case RendererKind.FILAMENT:
            return vulkan_driver()
        case RendererKind.CLASSIC | RendererKind.BAKED:
            return gl_device()
        case RendererKind.NONE:
            return None


def _content(name: str) -> str:
    """A name of the library as it is; of a file a digest of its content, wherever it lies."""
    if not name.endswith(".toml"):
        return name
    try:
        return hashlib.sha256(Path(name).read_bytes()).hexdigest()[:LENGTH]
    except OSError:
        return name  # whoever is to read it will tell


def read_views(source: Source, key: str, store: Store) -> Recording:
    """The views of a source; those of a drive must be in the store, under its ``key``.

    Raises ``DamagedError`` for what the store holds, ``LogError`` and ``AbsentError`` for what was never put there.
    """
    if not isinstance(source, Drive):
        return read_real(source)
    path = store.path(key, RECORDING)
    try:
        recording = read_kept(path)
    except (LogError, OSError) as error:
        raise DamagedError(key, str(error)) from error
    if not recording.complete:
        raise DamagedError(key, f"{path}: is damaged behind its first {len(recording.views)} views")
    return recording
