"""Where a campaign runs: what figures of time and memory are worth nothing without."""

import os
import platform
from pathlib import Path

from refseq_bench.scenarios.campaign.store.result_file import MachineRecord
from refseq_bench.scenarios.campaign.store.views import drawing_device
from refseq_bench.scenarios.methods.guests.confinement import holds, in_words
from refseq_bench.sim.rendering.renderer import DEFAULT_RENDERER

CPU, MEMORY = Path("/proc/cpuinfo"), Path("/proc/meminfo")


def this_machine() -> MachineRecord:
    """The machine that this runs on, as far as the system tells."""
    draws = drawing_device(DEFAULT_RENDERER)
    return MachineRecord(
        system=f"{platform.system()} {platform.release()} {platform.machine()}",
        processor=_line(CPU, "model name") or platform.processor() or "unknown",
        cores=os.cpu_count() or 1,
        memory_gb=_memory(),
        device=draws[0] if draws else None,
        guests=in_words(holds()),
    )


def _memory() -> float | None:
    words = (_line(MEMORY, "MemTotal") or "").split()
    return round(int(words[0]) * 1024 / 1e9, 1) if words else None


def _line(path: Path, key: str) -> str | None:
    """Value of a key in one of the system's own tables."""
    try:
        lines = path.read_text().splitlines()
    except OSError:
        return None
    return next((line.partition(":")[2].strip() for line in lines if line.startswith(key)), None)
