"""Where a user's localiser comes from: its files, found without running any of them, and a digest of them."""

import ast
import hashlib
import sys
from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from importlib.machinery import ModuleSpec, PathFinder
from importlib.metadata import packages_distributions, version
from pathlib import Path

BENCH = ("refseq", "worlds", "robots", "sim", "scenarios")
"""The bench's own packages. ``refseq`` is among the sources of all answers."""
FROM_BENCH = "scenarios.methods.baselines"
"""What of the bench counts where a localiser imports any of ``scenarios``: what one would build on."""


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


def top_names(file: Path) -> tuple[str, ...] | None:
    """Names that a module's source binds at its top; None where only running it could tell.

    Raises ``SyntaxError``, ``ValueError`` for what is no Python.
    """
    found: dict[str, None] = {}
    for node in _top_nodes(ast.parse(file.read_bytes()).body):
        match node:
            case ast.ClassDef(name=name) | ast.FunctionDef(name=name):
                found[name] = None
            case ast.ImportFrom() | ast.Import():
                found |= dict.fromkeys(one.asname or one.name.partition(".")[0] for one in node.names)
            case ast.Name(id=name, ctx=ast.Store()):
                found[name] = None
            case ast.Call(func=ast.Name(id="globals" | "setattr" | "exec")):
                return None
    return None if {"*", "__getattr__"} & set(found) else tuple(found)


def _top_nodes(body: Sequence[ast.AST]) -> Iterator[ast.AST]:
    """All nodes of a module but for what is inside its functions and classes."""
    for node in body:
        yield node
        if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef | ast.Lambda):
            yield from _top_nodes(list(ast.iter_child_nodes(node)))


def digest_of(module: str) -> str:
    """Digest of all that a module is made of, as far as its text tells.

    These are: all files of the package that it is in, data among them, or the module alone; the same of other modules
    that any of them imports, where they were not installed with a version, else that version. What is imported by a
    name that is made up, and files that are read from elsewhere, are not seen.
    """
    digest = hashlib.sha256()
    files, distributions = _closure(module)
    for file, name in files.items():
        digest.update(f"{name}\n".encode())
        digest.update(_content(file, file.stat().st_mtime_ns, file.stat().st_size))
    digest.update(repr(sorted(distributions)).encode())
    return digest.hexdigest()


@cache
def _content(file: Path, changed_ns: int, size: int) -> bytes:
    """Digest of a file, read again when it was changed: weights may be large, and many tasks have the same."""
    with file.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").digest()


def _closure(module: str) -> tuple[dict[Path, str], set[tuple[str, str]]]:
    """Files that a module is made of, in an order that is the same everywhere, and (package, version) of others."""
    first = module.partition(".")[0]
    files: dict[Path, str] = {}
    distributions: set[tuple[str, str]] = set()
    seen, left = set(BENCH), [first]
    while left:
        name = left.pop()
        if name == "scenarios":
            files |= _files(FROM_BENCH)
        if name in seen or name in sys.stdlib_module_names:
            continue
        seen.add(name)
        # What was installed has a version; the rest is what the user wrote.
        if name == first or name not in _distributions():
            of_module = _files(name)
            files |= of_module
            left.extend(sorted(_imports(of_module)))
        else:
            distributions.update((one, version(one)) for one in _distributions()[name])
    return files, distributions


@cache
def _distributions() -> dict[str, list[str]]:
    return dict(packages_distributions())


def _places(name: str) -> list[Path]:
    """A package's folders, or a module's file."""
    spec = spec_of(name)
    if spec is None:
        return []
    if spec.submodule_search_locations is not None:
        return [Path(place) for place in spec.submodule_search_locations]
    return [Path(spec.origin)] if spec.has_location and spec.origin else []


def _files(name: str) -> dict[Path, str]:
    """A module's files in the order of their names, each with its name from the module's folder on."""
    found: dict[Path, str] = {}
    for place in _places(name):
        inside = place.rglob("*") if place.is_dir() else [place]
        kept = (path for path in inside if path.is_file() and "__pycache__" not in path.parts)
        named = {path: path.relative_to(place.parent).as_posix() for path in kept}
        found |= dict(sorted(named.items(), key=lambda one: one[1]))
    return found


def _imports(files: Iterable[Path]) -> set[str]:
    """Top names of all modules that some Python files import, wherever in them."""
    found: set[str] = set()
    for file in files:
        if file.suffix != ".py":
            continue
        try:
            tree = ast.parse(file.read_bytes())
        except (SyntaxError, ValueError):
            continue  # importing it will tell
        for node in ast.walk(tree):
            if isinstance(node, ast.Import):
                found |= {one.name.partition(".")[0] for one in node.names}
            elif isinstance(node, ast.ImportFrom) and not node.level and node.module:
                found.add(node.module.partition(".")[0])
    return found
