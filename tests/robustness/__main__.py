"""Run the attacks: ``python -m tests.robustness [NAME…]``, or ``./run attacks``."""

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from tests.robustness.attack import Attack, attacks
from tests.robustness.run import Fall, Row, run
from tests.robustness.table import ROOT, as_json, markdown, print_table, read_rows


def main(words: Sequence[str] | None = None) -> int:
    """Run attacks, print their table, and return 1 if anything fell, or 2 for a name that is not there."""
    options = _parser().parse_args(words)
    every = attacks()
    chosen = {one.name: one for one in every.values() if {one.name, one.family} & set(options.names)}
    families = {one.family for one in every.values()}
    for name in options.names:
        if name not in every.keys() | families:
            print(f"unknown attack '{name}'; valid: {', '.join([*sorted(families), *every])}", file=sys.stderr)
            return 2
    if options.tries is not None and options.tries < 1:
        print(f"--tries {options.tries} is not valid; valid is 1 or more", file=sys.stderr)
        return 2
    if options.list:
        for one in (chosen or every).values():
            print(f"{one.name} ({one.family}): {one.promise}.")
        return 0
    rows = _run_all(list((chosen or every).values()), options)
    print_table(rows)
    if options.json:
        options.json.write_text(json.dumps(as_json(rows), indent=1))
    if options.markdown:
        options.markdown.write_text(markdown(rows))
    return int(any(row.falls for row in rows))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        "./run attacks", description="Try to make the bench fall, and print what survived."
    )
    parser.add_argument("names", metavar="NAME", nargs="*", help="an attack or a family of attacks; default all")
    parser.add_argument("--tries", type=int, help="how often each is tried, instead of its own number")
    parser.add_argument("--seed", type=int, default=0, help="the first try's seed; each next one is greater by one")
    parser.add_argument("--short", action="store_true", help="as in the quick test suite: a few tries each")
    parser.add_argument("-j", "--jobs", type=int, default=1, help="attacks at a time")
    parser.add_argument(
        "--kept", type=Path, default=ROOT / "out/robustness", help="folder for inputs that made it fall"
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="the table with everything that fell")
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="the table for a page")
    parser.add_argument("--list", action="store_true", help="only print each name and its promise")
    return parser


def _run_all(chosen: Sequence[Attack], options: argparse.Namespace) -> list[Row]:
    """Run one attack here; several each in a process of its own, which one that dies does not take with it."""
    if len(chosen) == 1:
        return [run(chosen[0], _tries(chosen[0], options), options.seed, options.kept)]
    with ThreadPoolExecutor(options.jobs) as pool:
        return list(pool.map(lambda one: _run_apart(one, options), chosen))


def _tries(one: Attack, options: argparse.Namespace) -> int:
    usual = one.short if options.short else one.tries
    return usual if options.tries is None else options.tries


def _run_apart(one: Attack, options: argparse.Namespace) -> Row:
    if not (tries := _tries(one, options)):
        return run(one, tries, options.seed, options.kept)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "rows.json")
        words = [one.name, "--tries", str(tries), "--seed", str(options.seed), "--kept", options.kept, "--json", file]
        command = [sys.executable, "-m", "tests.robustness", *words]
        done = subprocess.run(command, cwd=ROOT, stdout=subprocess.DEVNULL, check=False)
        if file.exists():
            return read_rows(file)[0]
    fall = Fall(options.seed, f"the attack's own process ended with code {done.returncode}", str(options.kept))
    print(f"{one.name}: {fall.told}", file=sys.stderr)
    return Row(one.name, one.family, one.promise, one.tries, tries, options.seed, [fall])


if __name__ == "__main__":
    sys.exit(main())
