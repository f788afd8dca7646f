"""The command line's assembly, its one-line errors and its exit codes.

Exit codes: 0 all went well; 1 it ran, but the result is below what was asked; 2 bad input, in one line; 130
interrupted. A command imports what it needs when it runs, so that ``refseq doctor`` answers on a machine where half of
it is missing, and ``--help`` comes at once.
"""

import errno
import os
import signal
import sys
from collections.abc import Callable
from functools import cache
from importlib.metadata import version as package_version
from typing import Annotated

import typer

from refseq_bench.scenarios.cli import log, module, robot, scenario, world
from refseq_bench.scenarios.cli.compare import COMPARE_HELP, compare
from refseq_bench.scenarios.cli.live import LIVE_HELP, live
from refseq_bench.scenarios.cli.localise import LOCALISE_HELP, localise
from refseq_bench.scenarios.cli.maps import LEARN_HELP, learn
from refseq_bench.scenarios.cli.maps import app as maps
from refseq_bench.scenarios.cli.record import DRIVE_HELP, RECORD_HELP, drive, record
from refseq_bench.scenarios.cli.report import REPORT_HELP, report
from refseq_bench.scenarios.cli.scene import app as missions
from refseq_bench.scenarios.cli.serve import SERVE_HELP, serve
from refseq_bench.scenarios.cli.terminal.console import err, out, settle_terminal
from refseq_bench.scenarios.cli.terminal.options import flag
from refseq_bench.scenarios.cli.terminal.usage import BenchCommand, UsageError, asks_for_help, group, in_one_line
from refseq_bench.scenarios.cli.view import VIEW_HELP, view
from refseq_bench.scenarios.cli.workshop import DEMO_HELP, DOCTOR_HELP, demo, doctor
from refseq_bench.scenarios.errors import input_errors
from refseq_bench.scenarios.tables import say

BELOW, BAD_INPUT, INTERRUPTED = 1, 2, 130

SUMMARY = """Test bench for robots that find their place along a path.

Lengths are in metres, angles in degrees, times in seconds. `refseq COMMAND --help` shows examples."""

app = group(SUMMARY)
PANELS: dict[str, dict[Callable[..., None] | typer.Typer, str]] = {
    "Log": {log.app: "log"},
    "Drive": {record: RECORD_HELP, drive: DRIVE_HELP},
    "Map": {learn: LEARN_HELP, maps: "map"},
    "Localise": {localise: LOCALISE_HELP, live: LIVE_HELP, serve: SERVE_HELP, missions: "mission"},
    "Several processes": {module.app: "module"},
    "Judge": {compare: COMPARE_HELP, scenario.app: "scenario"},
    "Look": {report: REPORT_HELP, view: VIEW_HELP},
    "Workshop": {demo: DEMO_HELP, doctor: DOCTOR_HELP, world.app: "world", robot.app: "robot"},
}
for panel, commands in PANELS.items():
    for command, text in commands.items():
        if isinstance(command, typer.Typer):
            app.add_typer(command, name=text, rich_help_panel=panel)
        else:
            app.command(cls=BenchCommand, epilog=text, rich_help_panel=panel)(command)


@app.callback(invoke_without_command=True, help=SUMMARY)
def version(
    shown: Annotated[bool, flag("--version", "Print the version.", is_eager=True)] = False,
) -> None:
    """Print the version where that is asked for."""
    if shown:
        say(out, package_version("refseq-bench"))
        raise typer.Exit


def main() -> None:
    """Run the command line: a known error is one line and an exit code, an unknown one comes with its trace."""
    settle_terminal()
    # Systems and CI servers end a job by SIGTERM, a terminal by SIGINT: either leaves behind what Ctrl-C does. What a
    # shell without job control puts in the background ignores SIGINT, and does so here too.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    sys.exit(exit_code(sys.argv[1:]))


@cache
def command_tree() -> typer.core.TyperGroup:
    """All commands with their options, as Typer made them of the functions: once, for it takes as long as a command."""
    return typer.main.get_group(app)


def exit_code(words: list[str]) -> int:
    """Run one command; what went wrong is told in one line."""
    try:
        with command_tree().make_context("refseq", words) as context:
            context.command.invoke(context)
    except typer.Exit as leave:
        return leave.exit_code
    except typer.Abort:
        return _told("aborted", BELOW)
    except KeyboardInterrupt as stop:
        return _told(": ".join(["interrupted", *map(str, stop.args), *_notes(stop)]), INTERRUPTED)
    except UsageError as error:
        if asks_for_help(error):
            return 0
        return _told(f"error: {in_one_line(error)}", BAD_INPUT)
    except MemoryError:
        return _told("error: the memory of this machine is not enough for what was asked", BAD_INPUT)
    except BrokenPipeError:  # whoever read our output has enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return BELOW
    except Exception as error:
        # Whoever asks the system for a file by such a name is told so, even if only whether it is there.
        if isinstance(error, OSError) and error.errno == errno.ENAMETOOLONG:
            return _told(f"error: {str(error.filename)[:80]!r}…: is too long for a file's name", BAD_INPUT)
        for module, (family, prefix) in FAILURES.items():
            # A module that was never imported has raised nothing.
            if module in sys.modules and isinstance(error, getattr(sys.modules[module], family)):
                return _told("; ".join([f"{prefix}{error}", *_notes(error)]), BELOW)
        if isinstance(error, input_errors()):
            return _told("; ".join([f"error: {error}", *_notes(error)]), BAD_INPUT)
        raise
    return 0


FAILURES = {
    "refseq_bench.scenarios.methods.plugins": ("MisbehavedError", "failed: "),
    "refseq_bench.scenarios.drives.record": ("NoViewError", ""),
    "refseq_bench.sim.teleop.session": ("AbortedError", ""),
}
"""Errors of what ran, not of what was asked for, by their modules, and what is put before their message."""


def _notes(error: BaseException) -> list[str]:
    """Lines that were added to an error: where the views lie of a drive that ended before its time."""
    return [" ".join(note.split()) for note in getattr(error, "__notes__", ())]


LONGEST_LINE = 1000
"""Characters of a mistake that are told: a value in a file may be as long as the file."""


def _told(line: str, code: int) -> int:
    say(err, line if len(line) <= LONGEST_LINE else f"{line[: LONGEST_LINE - 200]} … {line[-200:]}")
    return code
