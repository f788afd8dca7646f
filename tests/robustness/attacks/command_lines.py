"""Command lines: every command and option with odd, missing and extra words; mission strings and LAMP programs."""

import json
import os
import random
import shutil
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

from typer.core import TyperGroup

from refseq_bench.scenarios.cli.app import NAMES, command_tree
from refseq_bench.scenarios.library import LIBRARY
from tests.robustness.attack import attack
from tests.robustness.attacks.cases import replays
from tests.robustness.damage import damaged_bytes, damaged_text
from tests.robustness.fuzzing import fell
from tests.robustness.samples import samples

ODD_WORDS = (
    "", " ", "-", "--", "-1", "0", "nan", "inf", "1e400", "9" * 5000, "x", "a,b", ",", "=", "a=", "=b", "a=b", "1:2",
    ":", "a" * 50_000, "\udcff\udcfe", "é\u202e", "\x1b[2J", "a\nb", "'", '"', "[bold]", "%s", "../..", "/", ".", "9:1",
    "0x10", "/dev/zero", "/dev/full", "pipe", "folder", "link", "nothing.toml", "text.txt", "--help", "-h", "100%",
)  # fmt: skip
FILES = ("thesis.refseq", "drive.mcap", "beliefs.parquet")
SLOW = {
    *("demo", "doctor", "live", "drive", "serve", "robot serve", "robot check", "robot umbmark", "robot filmstrip"),
    *("mission page", "module control", "module localiser", "module mission", "module robot", "module viewer"),
}
"""Commands that work or wait for long when nothing is wrong: they are only given words that are wrong."""
STEPS = ("LD", "LI0", "LO3", "LA7", "LDMC", "LA1MW", "LDMT90", "LA2MT180", "LDMN", "LDMA")


@cache
def commands() -> dict[str, Any]:
    """Every command by its words."""
    return dict(_commands(command_tree(*NAMES)))


def _commands(command: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[str, Any]]:
    yield " ".join(path), command
    if isinstance(command, TyperGroup):
        for name, inner in command.commands.items():
            yield from _commands(inner, (*path, name))


@attack(family="files", promise="Any command line is refused in one line, or carried out", tries=10_000, short=12)
def odd_command_line(seed: int, folder: Path) -> str | None:
    rng = random.Random(seed)
    words = _words(rng)
    (folder / "words.json").write_text(json.dumps(words))
    return try_words(folder / "words.json", folder)


@replays("words")
def try_words(case: Path, folder: Path) -> str | None:
    for name in FILES:
        shutil.copy(samples() / name, folder)
    (folder / "folder").mkdir(exist_ok=True)
    (folder / "text.txt").write_text("no such file\n")
    (folder / "link").symlink_to("nowhere")
    (folder / "pipe").unlink(missing_ok=True)
    os.mkfifo(folder / "pipe")
    told = fell(json.loads(case.read_text()), folder, codes=(0, 1, 2))
    (folder / "pipe").unlink()  # who looks at what is kept must not wait for it
    return told


def _words(rng: random.Random) -> list[str]:
    """The words of a command, of which one at least is wrong, or that asks for help."""
    path = rng.choice(sorted(commands()))
    command, words = commands()[path], path.split()
    options = [parameter for parameter in command.params if parameter.param_type_name == "option"]
    arguments = [parameter for parameter in command.params if parameter.param_type_name != "option"]
    if rng.random() < 0.05:
        return [*words, "--help"]
    if rng.random() < 0.1:
        words = [*words[:-1], *([damaged_text(rng, words[-1])] if words else [])]
    words += [rng.choice((*ODD_WORDS, *FILES)).replace("\0", "") for _ in arguments if rng.random() < 0.8]
    for option in rng.sample(options, min(len(options), rng.randrange(4))):
        name = rng.choice(option.opts)
        words += [name if rng.random() < 0.9 else damaged_text(rng, name)]
        if not option.is_flag and rng.random() < 0.9:
            words.append(rng.choice((*ODD_WORDS, *FILES)))
    if rng.random() < 0.3 or path in SLOW:
        words.insert(rng.randrange(len(words) + 1), rng.choice(("--no-such-option", "--seed=x", "-Z")))
    return [word.replace("\0", "") for word in words]


@attack(family="files", promise="Any mission string is refused in one line, or planned", tries=10_000, short=6)
def odd_mission_string(seed: int, folder: Path) -> str | None:
    rng = random.Random(seed)
    text = f"[{'_'.join(rng.choice(STEPS) for _ in range(rng.choice((1, 2, 3, 9, 2000))))}]"
    if rng.random() < 0.8:
        text = damaged_text(rng, text, (*STEPS, "_", "M", "L", "LD9999999", "²", "MT91"))
    (folder / "words.json").write_text(
        json.dumps(["mission", "plan", "thesis.refseq", text.replace("\0", "")[:100_000]])
    )
    return try_words(folder / "words.json", folder)


@attack(family="files", promise="Any LAMP program is refused in one line", tries=10_000, short=6)
def odd_lamp_program(seed: int, folder: Path) -> str | None:
    """Programs that are right are refused as well, for the world is not there."""
    rng = random.Random(seed)
    text = (LIBRARY / "fig-1.6.lamp").read_text("utf-8")
    words = (
        "MOVE",
        "MOVP",
        "CROSS",
        "LV",
        "AV 10 ANL 90",
        "SEN 99",
        "USL",
        "1.",
        "\n",
        "\t",
        "\r",
        "-",
        "+",
        "²",
        "1e3",
    )
    content = damaged_text(rng, text, words).encode() if rng.random() < 0.8 else damaged_bytes(rng, text.encode())
    (folder / "input.lamp").write_bytes(content)
    return try_lamp(folder / "input.lamp", folder)


@replays("lamp")
def try_lamp(case: Path, folder: Path) -> str | None:
    if case.parent != folder:
        shutil.copy(case, folder / "input.lamp")
    return fell(["mission", "lamp", "input.lamp", "--world", "nowhere"], folder)
