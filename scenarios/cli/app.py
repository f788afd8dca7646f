"""The command line's assembly, its one-line errors and its exit codes.

Exit codes: 0 all went well; 1 it ran, but the result is below what was asked; 2 bad input, in one line; 130
interrupted; 141 whoever read the output has gone. The module of a command is imported when the command is asked for,
and what it needs when it runs, so that ``--help`` comes at once, and ``refseq doctor`` answers on a machine where half
of it is missing.
"""

import errno
import os
import signal
import sys
from functools import cache
from importlib import import_module
from typing import Annotated

import typer

from refseq.freed_memory import keep_freed_memory
from refseq.threads import sum_in_one_thread
from refseq_bench.scenarios.cli.terminal.console import err, out, settle_terminal
from refseq_bench.scenarios.cli.terminal.options import flag
from refseq_bench.scenarios.cli.terminal.usage import BenchCommand, UsageError, asks_for_help, group, in_one_line
from refseq_bench.scenarios.errors import input_errors
from refseq_bench.scenarios.tables import say

BELOW, BAD_INPUT, INTERRUPTED, UNREAD = 1, 2, 130, 141

SUMMARY = """Test bench for robots that find their place along a path.

Lengths are in metres, angles in degrees, times in seconds. `refseq COMMAND --help` shows examples."""

COMMANDS = {
    "Log": {
        "log": (
            "log",
            "Look at logs of any robot, convert and cut them; `refseq log check FILE` is the first thing to run.",
        )
    },
    "Drive": {
        "record": ("drives.record", "Record a robot that follows a route, behaviours or a script."),
        "drive": ("drives.record", "Record drives of a robot that you set up and lead in the browser."),
    },
    "Map": {
        "learn": ("maps", "Learn a map, a reference sequence, from a first drive."),
        "map": ("maps", "Merge, compact and compare maps, find routes in them, look into them."),
    },
    "Localise": {
        "localise": ("drives.localise", "Localise a recorded drive in a map, view by view."),
        "live": ("drives.live", "Localise while the robot drives, and show what it believes."),
        "serve": ("serve", "Localise a robot while it drives: sensors in over a socket, beliefs out."),
        "mission": ("scene", "Plan missions along what a map knows, and run them."),
    },
    "Several processes": {
        "module": ("module", "Run the modules of a robot as processes that find each other, on one or several hosts."),
    },
    "Judge": {
        "compare": ("drives.compare", "Compare methods on the same views, baselines among them."),
        "scenario": ("scenario", "Run declared experiments, and read their verdicts."),
    },
    "Look": {
        "report": ("drives.report", "Write a page about a localised drive."),
        "view": ("drives.view", "Show a drive, a map, or a localised drive in the Rerun viewer."),
    },
    "Workshop": {
        "demo": ("workshop", "Record two drives, learn, localise and report, all at once."),
        "doctor": ("workshop", "Tell what this machine lacks for the bench, and how to mend it."),
        "world": ("world", "List, check, draw and measure the worlds to drive in."),
        "robot": ("robot", "List, show, try and check the robots."),
    },
}
"""Names by the panel of the help that has them, each with its module and its line there.

A command is the function of its name, with its examples in a constant: ``record`` and ``RECORD_HELP``. A group has no
such function: it is the module's ``app``."""
NAMES = tuple(name for panel in COMMANDS.values() for name in panel)


def assembled(*asked: str) -> typer.Typer:
    """All commands by name; of those that are not asked for, which are not imported, only the line in the help."""
    app = group(SUMMARY)
    app.callback(invoke_without_command=True, help=SUMMARY)(version)
    for panel, commands in COMMANDS.items():
        for name, (module, summary) in commands.items():
            if name not in asked:
                app.command(name, help=summary, rich_help_panel=panel)(_not_asked_for)
                continue
            home = import_module(f"{__package__}.{module}")
            if command := getattr(home, name, None):
                epilog = getattr(home, f"{name.upper()}_HELP")
                app.command(name, cls=BenchCommand, epilog=epilog, rich_help_panel=panel)(command)
            else:
                app.add_typer(home.app, name=name, rich_help_panel=panel)
    return app


def _not_asked_for() -> None:
    """Stand for a command in the help of all."""


def version(
    shown: Annotated[bool, flag("--version", "Print the version.", is_eager=True)] = False,
) -> None:
    """Print the version where that is asked for."""
    if shown:
        from importlib.metadata import version as package_version

        say(out, package_version("refseq-bench"))
        raise typer.Exit


def main() -> None:
    """Run the command line: a known error is one line and an exit code, an unknown one comes with its trace."""
    settle_terminal()
    sum_in_one_thread()
    keep_freed_memory()
    # Systems and CI servers end a job by SIGTERM, a terminal by SIGINT: either leaves behind what Ctrl-C does. What a
    # shell without job control puts in the background ignores SIGINT, and does so here too.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    code = exit_code(sys.argv[1:])
    if campaign := sys.modules.get("refseq_bench.scenarios.campaign.aside"):
        campaign.leave(code)
    sys.exit(code)


@cache
def command_tree(*asked: str) -> typer.core.TyperGroup:
    """All commands, with the options of those that are asked for: made once, for it takes as long as a command."""
    return typer.main.get_group(assembled(*asked))


def exit_code(words: list[str]) -> int:
    """Run one command; what went wrong is told in one line, and nothing where nobody reads it."""
    try:
        return _carried_out(words)
    except (BrokenPipeError, SystemExit) as leave:
        # Rich's own consoles, which print the help, end the program with 1 there: a verdict.
        if isinstance(leave, SystemExit) and not isinstance(leave.__context__, BrokenPipeError):
            raise
        _print_nothing_more()
        return UNREAD  # as a shell tells of those whom the system ends for it


def _carried_out(words: list[str]) -> int:
    """The exit code of one command. Raises ``BrokenPipeError`` where whoever read the output has enough."""
    if why := _hindrance(words):
        return _told(f"error: {why}", BAD_INPUT)
    asked = [word for word in words if not word.startswith("-")][:1]
    try:
        code = _invoked(command_tree(*(name for name in asked if name in NAMES)), words)
        sys.stdout.flush()
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
    except BrokenPipeError:
        raise
    except Exception as error:
        if isinstance(error, OSError) and error.errno in FULL and error.filename is None:
            _print_nothing_more()
            return _told(f"error: the output, or a file, cannot be written: {error.strerror}", BAD_INPUT)
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
    return code


def _invoked(tree: typer.core.TyperGroup, words: list[str]) -> int:
    """The exit code that a command leaves with."""
    try:
        with tree.make_context("refseq", words) as context:
            context.command.invoke(context)
    except typer.Exit as leave:
        return leave.exit_code
    return 0


def _hindrance(words: list[str]) -> str:
    """The reason why no command can be carried out; empty where there is none.

    Names become parts of pages, metadata and results, which hold UTF-8 alone: better told now than after the work.
    """
    try:
        os.getcwd()  # noqa: PTH109 - as a path it would be looked up again
    except FileNotFoundError:
        return "the folder that this was typed in is no more; valid is one that is there: cd to it"
    for word in words:
        try:
            word.encode()
        except UnicodeEncodeError:
            return f"{word}: is no UTF-8; valid are words and names that are: copy the file, or name a link to it"
    return ""


FAILURES = {
    "refseq_bench.scenarios.methods.plugins": ("MisbehavedError", "failed: "),
    "refseq_bench.scenarios.drives.record": ("NoViewError", ""),
    "refseq_bench.sim.errors": ("StuckError", ""),
    "refseq_bench.sim.teleop.session": ("AbortedError", ""),
}
"""Errors of what ran, not of what was asked for, by their modules, and what is put before their message."""


FULL = (errno.ENOSPC, errno.EDQUOT)
"""Errors of a device that takes no more. Who writes a file names it; the output has no name."""


def _print_nothing_more() -> None:
    """Send what is still in the buffer of the standard output nowhere."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _notes(error: BaseException) -> list[str]:
    """Lines that were added to an error: where the views lie of a drive that ended before its time."""
    return [" ".join(note.split()) for note in getattr(error, "__notes__", ())]


LONGEST_LINE = 1000
"""Characters of a mistake that are told: a value in a file may be as long as the file."""


def _told(line: str, code: int) -> int:
    say(err, line if len(line) <= LONGEST_LINE else f"{line[: LONGEST_LINE - 200]} … {line[-200:]}")
    return code
