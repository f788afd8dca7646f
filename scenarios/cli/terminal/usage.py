"""Mistakes in commands and options, each told in one line: the option, its value, and the valid ones."""

from collections.abc import Collection, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any, get_args

import typer
from typer.core import TyperCommand, TyperGroup

UsageError: Any = typer.BadParameter.__base__
"""The family of errors for words that the command line does not take."""

RENAMED_COMMANDS = {
    "ablation": "scenario run fig-2.11-2.13-sensors",
    "similarity": "map similarity",
    "merge": "map merge",
    "route": "map route",
    "matrix": "map matrix",
    "worlds": "world",
    "robots": "robot",
    "worlds sheet": "world contact-sheet",
    "world sheet": "world contact-sheet",
    "robots strip": "robot filmstrip",
    "robot strip": "robot filmstrip",
    "robots drive": "robot try",
    "robot drive": "robot try",
}
RENAMED_OPTIONS = {
    "record --every": "--distance METRES",
    "drive --every": "--time SECONDS",
    "drive --by-hand": "--on-request",
    "drive --script": "record --script FILE",
    "live --every": "--distance METRES",
    "live --drive-seed": "--seed N",
    "live --record": "--recording FILE",
    "live --save": "--rrd FILE",
    "view --save": "--output FILE",
    "compare --start": "--first-view VIEW",
    "compare --table": "--output FILE",
    "demo --from": "--light LIGHT",
    "demo --to": "--query-light LIGHT",
    "demo --seeds": "--runs N",
    "map merge --least": "--min-overlap METRES",
    "map merge --log": "--write-decisions FILE",
    "map similarity --least": "--min-overlap METRES",
    "mission run --every": "--distance METRES",
    "mission run --at": "--start METRES",
    "mission run --strip": "--filmstrip SECONDS",
    "mission run --odometry": "--by-odometry",
    "robot try --at": "--pose X,Y,DEGREES",
    "world lux --hour": "--light LIGHT",
    "world day --every": "--step MINUTES",
    "world day --from": "--first-hour HOUR",
    "world day --to": "--last-hour HOUR",
    "world day --reference": "--light LIGHT",
    "world day --with": "--conditions TEXT",
    "scenario report --table": "--across FIGURE",
}
"""Old spellings, behind the names of their commands, and the new ones."""

LIVE = ("live", "light", "change", "robot", "route", "drive-seed", "every", "script", "keys", "record")
LIVE_SCREENS = ("save", "connect", "serve")
for name in (*LIVE, *LIVE_SCREENS):
    RENAMED_OPTIONS[f"localise --{name}"] = "live MAP WORLD"


class BenchCommand(TyperCommand):
    """A command whose help shows no type for flags, and that takes no empty word, and no option, for a path."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """As Typer's. Raises ``UsageError`` for an empty path, which would stand for the folder that one is in.

        So it does for one that is the name of an option, as in ``-o --help``: the path was forgotten.
        """
        given, *_ = self.make_parser(ctx).parse_args(args=list(args))
        parameters: list[Any] = list(self.get_params(ctx))
        options = {name for parameter in parameters for name in parameter.opts if name.startswith("-")}
        for parameter in filter(_is_path, parameters):
            values = given.get(str(parameter.name))
            for value in [values] if isinstance(values, str) else values or ():
                # Behind a bare -- an argument may well begin with a dash.
                if told := _no_path(value, options if parameter.param_type_name == "option" else ()):
                    raise typer.BadParameter(told, ctx, parameter)
        return super().parse_args(ctx, args)

    def get_help_option(self, ctx: Any) -> Any:
        """As Typer's, without a placeholder."""
        return _plain(super().get_help_option(ctx))


def _no_path(value: str, options: Collection[str]) -> str | None:
    """Tell why a word is no path, if it is none."""
    if not value:
        return "'' is no name; valid is that of a file or folder: is a variable of the shell not set?"
    if value in options:
        return f"{value!r} is an option, not the name that is missing; a file of that name is ./{value}"
    return None


def _is_path(parameter: Any) -> bool:
    """Tell whether a parameter takes paths, some of which may be names of something else as well."""
    taken = getattr(getattr(parameter, "type_descriptor", None), "annotation", None)
    return Path in (taken, *get_args(taken)) or parameter.metavar in ("FILE", "WORLD")


class BenchGroup(TyperGroup):
    """Commands that tell the new name of one that is asked for by its old name."""

    def get_help_option(self, ctx: Any) -> Any:
        """As Typer's, without a placeholder."""
        return _plain(super().get_help_option(ctx))

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Find the command of the first word. Raises ``UsageError``."""
        if args[0] not in self.commands:
            raise UsageError(_unknown_command(" ".join([*_path(ctx), args[0]]), args, self.commands), ctx)
        return super().resolve_command(ctx, args)


def group(summary: str) -> typer.Typer:
    """Make a group of commands."""
    return typer.Typer(
        cls=BenchGroup,
        help=summary,
        no_args_is_help=True,
        rich_markup_mode="markdown",
        pretty_exceptions_enable=False,
        add_completion=False,
        context_settings={"help_option_names": ["--help", "-h"]},
    )


def _plain(option: Any) -> Any:
    if option is not None:
        option.metavar = ""
    return option


def _path(ctx: Any) -> list[str]:
    """The names of the commands, without the program's."""
    return [] if ctx is None else str(ctx.command_path).split()[1:]


def _unknown_command(name: str, words: Sequence[str], known: Collection[str]) -> str:
    longer = f"{name} {words[1]}" if len(words) > 1 else name
    new = RENAMED_COMMANDS.get(longer, RENAMED_COMMANDS.get(name))
    if new is not None:
        old = longer if longer in RENAMED_COMMANDS else name
        return f"'refseq {old}' is called 'refseq {new}' now"
    if name.startswith("-"):
        return f"option {name!r:.80} goes behind a command; valid are {', '.join(known)}"
    return f"command {name!r:.80} is unknown; {_nearest(words[0], known)}"


def _nearest(word: str, known: Collection[str]) -> str:
    by_letters = {one.lstrip("-"): one for one in known}  # dashes are alike in all options
    near = get_close_matches(word.lstrip("-")[:80], by_letters, 1)  # of long words it takes long
    return f"the nearest is {by_letters[near[0]]!r}" if near else f"valid are {', '.join(known)}"


def asks_for_help(error: Any) -> bool:
    """True for a group of commands without any word behind it, whose help Typer has printed."""
    return type(error).__name__ == "NoArgsIsHelpError"


def in_one_line(error: Any) -> str:
    """Tell a ``UsageError`` in one line: the option, its value, the valid ones, and the command for help."""
    ctx = getattr(error, "ctx", None)
    told = _told(error, ctx)
    return told if told.endswith(" now") else f"{told}; '{' '.join(['refseq', *_path(ctx), '--help'])}' tells more"


def _told(error: Any, ctx: Any) -> str:
    parameter = getattr(error, "param", None)
    command = " ".join(["refseq", *_path(ctx)])
    if type(error).__name__ == "NoSuchOption":
        return _unknown_option(error.option_name, ctx)
    if type(error).__name__ == "MissingParameter" and parameter is not None:
        return f"{_spelling(parameter)} of '{command}' is missing: {_sentence(parameter.help)}"
    if parameter is not None:
        return _invalid(error, parameter)
    message = str(error.message).rstrip(".")
    if message.startswith("Got unexpected extra"):
        extra = message.rpartition("(")[2].rstrip(")")
        return f"'{command}' takes no {extra!r:.80}"
    return message[:1].lower() + message[1:]


def _unknown_option(name: str, ctx: Any) -> str:
    command = " ".join(_path(ctx))
    new = RENAMED_OPTIONS.get(f"{command} {name}")
    if new is not None:
        return f"{name} of 'refseq {command}' is called {new!r} now"
    known = [one for parameter in ctx.command.params for one in parameter.opts if one.startswith("--")]
    of = f" of 'refseq {command}'" if command else ""
    return f"option '{name:.80}'{of} is unknown; {_nearest(name, [*known, '--help'])}"


def _spelling(parameter: Any) -> str:
    """``--output FILE`` of an option, the placeholder of an argument."""
    metavar = parameter.metavar or str(parameter.name).upper()
    return f"{parameter.opts[0]} {metavar}" if parameter.param_type_name == "option" else str(metavar)


def _sentence(text: str | None) -> str:
    return (text or "").partition(" [default")[0].rstrip(".")


def _invalid(error: Any, parameter: Any) -> str:
    """A value that is not valid: from pydantic's reason where there is one, else in Typer's words."""
    reasons: Any = getattr(error.__cause__, "errors", list)()
    if not reasons:
        return f"{_spelling(parameter)}: {error.message.rstrip('.')}"
    value, kind = reasons[0]["input"], str(reasons[0]["type"])
    name = parameter.opts[0] if parameter.param_type_name == "option" else _spelling(parameter)
    unit = f" [{parameter.metavar}]" if parameter.metavar else ""
    if kind == "value_error":
        choices = str(reasons[0]["msg"]).partition(" is not one of ")[2].rstrip(".").replace("'", "")
        return f"{name} {value!r:.80} is not valid; valid are {choices or _sentence(parameter.help)}"
    number = "a whole number" if "int" in str(parameter.type_descriptor.annotation) else "a number"
    return f"{name} {value!r:.80} is not valid; valid is {number}{_range(parameter)}{unit}"


def _range(parameter: Any) -> str:
    low, high = parameter.min, parameter.max
    if low is None:
        return "" if high is None else f" up to {high:g}"
    return f" of {low:g} or more" if high is None else f" from {low:g} to {high:g}"
