"""Import closure of modules, with its digest: equal only where all code that they can reach is equal.

A module of the bench counts by itself, with the packages that it lies in and the data files beside it or in the package
that it reads; READMEs do not count. A user's package, which has no version, counts with all its files. Of an installed
package the version counts.
"""

import hashlib
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.machinery import ModuleSpec, PathFinder
from importlib.metadata import packages_distributions, version
from pathlib import Path
from platform import python_version
from types import MappingProxyType

from refseq_bench.scenarios.imports.syntax import ALL, imports_of

PACKAGES = ("refseq", "refseq_bench")
"""The bench's own packages."""
ROOT = Path(__file__).parents[3]
"""Folder that holds them; as they are imported, for a checkout links to most of what ``refseq_bench`` holds."""
CODE, PROSE = ".py", ".md"
ABSENT = "absent"
"""Stands for the version of a package that is imported but not installed."""


@dataclass(frozen=True)
class Closure:
    """``files`` by name, from the folder on that holds their package; ``versions`` of Python and installed packages.

    ``untold`` are the places in the bench that import by a name that is made up: no walk can follow these.
    """

    files: Mapping[str, Path]
    versions: Mapping[str, str]
    untold: tuple[str, ...] = ()

    @property
    def digest(self) -> str:
        """Digest of all files and versions."""
        digest = hashlib.sha256(repr(sorted(self.versions.items())).encode())
        for name, file in sorted(self.files.items()):
            state = file.stat()
            digest.update(f"{name}\n".encode())
            digest.update(_content(file, state.st_mtime_ns, state.st_size))
        return digest.hexdigest()


@cache
def _content(file: Path, _changed_ns: int, _size: int) -> bytes:
    """Digest of a file, read again where it was changed: weights may be large, and many tasks have the same."""
    with file.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").digest()


def closure_of(*modules: str, alone: Sequence[str] = (), root: Path = ROOT) -> Closure:
    """All that some modules can reach; of those ``alone`` their own files. ``root`` holds the bench's packages.

    Raises ``ModuleNotFoundError`` for a module that there is not. What is imported by a name that is made up, and data
    that is read from elsewhere, is not seen.
    """
    walk = _Walk(root)
    for module in modules:
        if not walk.reach(module, whole=True):
            raise _not_found(module)
    walk.follow_all()
    for module in alone:
        walk.add_alone(module)
    return Closure(MappingProxyType(walk.files), MappingProxyType(walk.versions), tuple(walk.untold))


def _not_found(module: str) -> ModuleNotFoundError:
    return ModuleNotFoundError(f"No module named {module!r}", name=module)


class _Walk:
    """Walk along imports: ``reach`` takes a module in, ``follow_all`` takes in all that these import."""

    def __init__(self, root: Path) -> None:
        self._root = root
        self._left: list[tuple[str, Path]] = []
        self._seen: set[str] = set()
        self._found: dict[str, Path | None] = {}  # files of the bench's modules that were asked for
        self.files: dict[str, Path] = {}
        self.versions = {"python": python_version()}
        self.untold: list[str] = []

    def reach(self, module: str, *, whole: bool = False) -> bool:
        """Take a module in; ``whole``: by its files, even where it is installed. False where there is no such one."""
        first = module.partition(".")[0]
        if first in PACKAGES:
            return self._reach_own(module)
        if first in self._seen or first in sys.stdlib_module_names:
            return True
        self._seen.add(first)
        if not whole and (named := _distributions().get(first)):
            self.versions |= {name: version(name) for name in named}
            return True
        files = {file.relative_to(place.parent): file for place in _places(first) for file in _files_in(place)}
        for name, file in files.items():
            self.files[name.as_posix()] = file
            if file.suffix == CODE:
                self._left.append((".".join(name.with_suffix("").parts), file))
        if not files:
            self.versions[first] = ABSENT
        return bool(files)

    def _reach_own(self, module: str) -> bool:
        if module in self._seen:
            return True
        file, package = self._file_of(module), module.rpartition(".")[0]
        if file is None or (package and not self._reach_own(package)):
            return False
        self._seen.add(module)
        self._left.append((module, file))
        self._add(file)
        return True

    def _file_of(self, module: str) -> Path | None:
        if module not in self._found:
            place = self._root.joinpath(*module.split("."))
            files = (place / "__init__.py", place.with_suffix(CODE))
            self._found[module] = next((file for file in files if file.is_file()), None)
        return self._found[module]

    def add_alone(self, module: str) -> None:
        """Take in the file of a module of the bench, and nothing that it imports."""
        if (file := self._file_of(module)) is None:
            raise _not_found(module)
        self._add(file)

    def _add(self, file: Path) -> None:
        self.files[file.relative_to(self._root).as_posix()] = file

    def follow_all(self) -> None:
        """Take in what all modules that were reached import and read."""
        while self._left:
            module, file = self._left.pop()
            found = imports_of(file)
            package = module if file.name == "__init__.py" else module.rpartition(".")[0]
            for name in found.modules:
                self.reach(_absolute(name, package))
            for name, attribute in found.uses:
                self._ask(_absolute(name, package), attribute)
            if module.partition(".")[0] in PACKAGES:
                self._read_data(file, found.data)
                self.untold += [f"{file.relative_to(self._root)}:{line}" for line in found.untold]

    def _ask(self, package: str, name: str) -> None:
        """Take in what a name of a package stands for: a module in it, or one that it imports when it is asked."""
        file = self._file_of(package) if package.partition(".")[0] in PACKAGES else None
        if file is None or file.name != "__init__.py" or f"{package}:{name}" in self._seen:
            return
        self._seen.add(f"{package}:{name}")
        late = imports_of(file).late
        known = name in late.bound or (name != ALL and self._reach_own(f"{package}.{name}"))
        for text in late.modules_of(name) or (() if known else late.texts):
            for module in (text, f"{package}.{text.lstrip('.')}"):
                if module.partition(".")[0] in PACKAGES and self._reach_own(module):
                    self._ask(module, name)

    def _read_data(self, file: Path, packages: tuple[str | None, ...]) -> None:
        folders = (file.parent if one is None else self._root.joinpath(*one.split(".")) for one in packages)
        for found in (found for folder in folders for found in _files_in(folder)):
            if found.suffix not in (CODE, PROSE):
                self._add(found)


def _absolute(module: str, package: str) -> str:
    """A module by its full name, as a file in ``package`` names it: with dots in front, or in full."""
    dots = len(module) - len(module.lstrip("."))
    if not dots:
        return module
    parts = package.split(".")
    return ".".join((*parts[: len(parts) - dots + 1], *filter(None, [module[dots:]])))


def _files_in(place: Path) -> Iterator[Path]:
    """A file, or all files below a folder."""
    inside = sorted(place.rglob("*")) if place.is_dir() else [place]
    return (file for file in inside if file.is_file() and "__pycache__" not in file.parts)


@cache
def _distributions() -> Mapping[str, list[str]]:
    return packages_distributions()


def _places(name: str) -> list[Path]:
    """A package's folders, or a module's file."""
    spec = spec_of(name)
    if spec is None:
        return []
    if spec.submodule_search_locations is not None:
        return [Path(place) for place in spec.submodule_search_locations]
    return [Path(spec.origin)] if spec.has_location and spec.origin else []


def spec_of(module: str) -> ModuleSpec | None:
    """Where a module lies, None where there is none. Unlike ``importlib.util.find_spec`` it imports no parent."""
    first, *inner = module.split(".")
    specs = (finder.find_spec(first, None, None) for finder in sys.meta_path if hasattr(finder, "find_spec"))
    found = next((spec for spec in specs if spec is not None), None)
    for name in inner:
        if found is None or found.submodule_search_locations is None:
            return None
        # By its last name alone: by its full one a folder without __init__.py would ask for its parent to be imported.
        found = PathFinder.find_spec(name, list(found.submodule_search_locations))
    return found
