"""One drive after another, each as a person sets it up on the page of captures (thesis 5.3.1)."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

from refseq.logs.writing import OutputFormat
from refseq_bench.scenarios.drives.drive import Drive
from refseq_bench.scenarios.drives.record import OWN_FORMAT, NoViewError, sensors_of
from refseq_bench.scenarios.drives.teleop import TeleopDrive, TeleopResult, record_by_hand
from refseq_bench.scenarios.tables import plural
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.teleop.capture.desk import Offer
from refseq_bench.sim.teleop.capture.setup import CaptureSetup
from refseq_bench.sim.teleop.session import AbortedError
from refseq_bench.sim.teleop.viewer import CapturePage


@dataclass
class CaptureFiles:
    """Files of drives by their names: the first name's is ``output``, others lie beside it and replace nothing."""

    output: Path
    name: str
    kept: list[Path] = field(default_factory=list)

    def path_of(self, name: str) -> Path:
        """File of a drive."""
        return self.output if name == self.name else self.output.with_name(name + self.output.suffix)

    def check(self, setup: CaptureSetup) -> None:
        """Raise ``SimError`` for the name of a drive that is there already."""
        if self._is_taken(setup.name):
            path, other = self.path_of(setup.name), self.free_name()
            raise SimError(f"name {setup.name!r}: {path} is there already; valid is another name, as {other!r}")

    def free_name(self) -> str:
        """The first name, or with the first number behind it that is free."""
        name, number = self.name, 1
        while self._is_taken(name):
            number += 1
            name = f"{self.name}-{number}"
        return name

    def _is_taken(self, name: str) -> bool:
        path = self.path_of(name)
        return path in self.kept or (path != self.output and path.exists())


def record_captures(
    page: CapturePage, drive: Drive, files: CaptureFiles, first: CaptureSetup, form: OutputFormat = OWN_FORMAT
) -> Iterator[tuple[Path, TeleopResult]]:
    """Record drives as they are set up and led on the page, until a person has finished.

    One that is aborted, or has no view, is told of on the page, and the next set-up follows. Raises ``NoViewError`` or
    ``AbortedError`` where none was recorded, and as ``record_by_hand`` does.
    """
    valid = sensors_of(replace(drive, sensors=None))
    offer, failed = Offer(first, valid, files.check), NoViewError(f"{files.output} is not written: no drive was begun")
    failure: Exception = failed
    while (setup := page.desk.next_setup(offer)) is not None:
        path = files.path_of(setup.name)
        session = TeleopDrive(setup.name, replace(drive, sensors=setup.sensors), setup.sampling, setup.notes)
        try:
            led = record_by_hand(session, path, page.leading, form=form, notes=lambda: page.desk.notes)
        except (AbortedError, NoViewError) as error:
            failure, last = error, str(error)
        else:
            files.kept.append(path)
            last = f"{path.name}: {plural(len(led.recording.views), 'view')}, {led.way:.1f} m in {led.time:.1f} s"
            yield path, led
        offer = Offer(replace(setup, name=files.free_name(), notes=page.desk.notes), valid, files.check, last)
    if not files.kept:
        raise failure
