"""Ask the package index for known weaknesses of what ``requirements.lock`` pins: ``./run audit``.

It ends in one line and an exit code: 0, none is known; 1, some are; 2, nobody could be asked, or not about all.
"""

import json
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
LOCK = ROOT / "requirements.lock"
NONE, FOUND, UNASKED = 0, 1, 2


def main() -> int:
    """Audit the lock, and print what is known."""
    # The lock is complete and has hashes, so nothing is left to resolve or to install.
    words = ["--requirement", str(LOCK), "--require-hashes", "--disable-pip", "--format", "json"]
    done = subprocess.run(
        [sys.executable, "-m", "pip_audit", *words, "--progress-spinner", "off"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    try:
        packages = json.loads(done.stdout)["dependencies"]
    except (ValueError, KeyError):
        reason = (done.stderr.strip().splitlines() or ["it said nothing"])[-1]
        print(f"audit: could not ask: {reason[:300]}")
        return UNASKED
    lines, code = verdict(packages)
    print("\n".join(lines))
    return code


def verdict(packages: Sequence[dict[str, Any]]) -> tuple[list[str], int]:
    """Lines about pip-audit's packages, the last one for all, and the exit code.

    A package that the index does not know is no finding for pip-audit: where it knows none, nobody was asked.
    """
    asked = [package for package in packages if "skip_reason" not in package]
    found = [_line(package, flaw) for package in asked for flaw in package["vulns"]]
    unasked = len(packages) - len(asked)
    if found:
        missing = f"; {unasked} of {len(packages)} packages could not be asked about" if unasked else ""
        return [*found, f"audit: {len(found)} known weaknesses in {len(packages)} packages{missing}"], FOUND
    if unasked or not packages:
        return [
            f"audit: could not ask about {unasked} of {len(packages)} packages: the index does not know them"
        ], UNASKED
    return [f"audit: no known weakness in {len(packages)} packages"], NONE


def _line(package: dict[str, Any], flaw: dict[str, Any]) -> str:
    fixed = ", ".join(flaw["fix_versions"]) or "no version yet"
    return f"{package['name']} {package['version']}: {flaw['id']}, mended in {fixed}"


if __name__ == "__main__":
    sys.exit(main())
