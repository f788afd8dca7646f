"""The installed command: Ctrl-C while the command line is still being imported ends it in a line as well."""

import sys


def main() -> None:
    """Run the command line."""
    try:
        from refseq_bench.scenarios.cli.app import main as run

        run()
    except KeyboardInterrupt:
        sys.stderr.write("interrupted\n")
        sys.exit(130)
