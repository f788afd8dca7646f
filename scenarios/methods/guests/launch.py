"""Entry of a guest's process: confine it, then run the user's localiser. It is given the path of an order, in JSON.

Until it is confined only Python's own library is imported: a thread that began before would stay free.
"""

import json
import os
import sys
from pathlib import Path
from typing import Any

CONFINED = 3
"""Exit code of a guest that could not be confined."""
NOT_STARTED = 126
"""Exit code of a guest whose program the system does not start, as a shell has it."""


def main(order: dict[str, Any]) -> None:
    """Carry out an order of ``refseq_bench.scenarios.methods.guests.folder``."""
    sys.path[:] = order["path"]
    from refseq_bench.scenarios.methods.guests.confinement import confine
    from refseq_bench.scenarios.methods.guests.limits import GuestLimits

    try:
        confine(GuestLimits(**order["limits"]), order["read"], order["write"], order["bench"])
    except (OSError, ValueError) as error:
        print(f"the guest cannot be confined: {error}", file=sys.stderr)
        sys.exit(CONFINED)
    if program := order["program"]:
        _become(program)
    from refseq_bench.scenarios.methods.guests.host import serve

    serve(order["localiser"], order["threads"])


def _become(program: str) -> None:
    """Go on as the program."""
    try:
        os.execv(program, [program])
    except OSError as error:
        print(f"{Path(program).name} cannot be started: {error.strerror}", file=sys.stderr)
        sys.exit(NOT_STARTED)


if __name__ == "__main__":
    main(json.loads(Path(sys.argv[1]).read_text(encoding="utf-8")))
