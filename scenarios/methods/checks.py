"""Checks of methods that are named, before any is loaded: ours with their settings, baselines, users' own."""

from collections.abc import Iterable, Sequence

from refseq.map.names import PROFILE_NAMES
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.methods.names import GROUPS, IN_HINDSIGHT, METHODS, profile_of, written_out
from refseq_bench.scenarios.methods.plugins import check_plugin, installed, is_plugin


def methods_named(names: Sequence[str] | None) -> tuple[str, ...]:
    """Methods by their names, each once; without names all there are. ``ScenarioError`` for an unknown one."""
    wanted = written_out(names or METHODS)
    check_methods(wanted)
    return wanted


def check_methods(names: Iterable[str]) -> None:
    """Raise ``ScenarioError`` for the first name that is no method's, ``MapError`` for a setting that is not valid."""
    for name in names:
        if is_plugin(name):
            check_plugin(name)
        elif (profile := profile_of(name)) is not None:
            check_profile(profile)
        elif name not in METHODS:
            valid = ", ".join((*METHODS, *GROUPS, *IN_HINDSIGHT, *installed(), "package.module:Class"))
            raise ScenarioError(f"method {name!r} is unknown; valid are {valid}, ./program")


def check_profile(name: str) -> None:
    """Raise ``MapError`` for a profile that there is not, and for a setting of one that is not valid."""
    if name not in PROFILE_NAMES:
        from refseq.map.profile import profile_named  # all that has settings takes a tenth of a second to import

        profile_named(name)
