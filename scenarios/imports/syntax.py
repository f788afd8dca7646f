"""Imports and data reads of one Python file, as its text tells them."""

import ast
import gc
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ALL = "*"
IMPORTERS = ("import_module", "__import__")
LATE = "__getattr__"
FILES = "files"
"""Name of the function of ``importlib.resources`` that gives a package's folder."""


@dataclass(frozen=True)
class LateNames:
    """Names that a package imports only when they are asked for, by its ``__getattr__``.

    Each entry pairs texts that stand for each other: a name and the module that holds it, or a module and its names.
    ``bound`` are the names that the package has from the beginning.
    """

    entries: tuple[tuple[frozenset[str], frozenset[str]], ...] = ()
    bound: frozenset[str] = frozenset()

    def modules_of(self, name: str) -> frozenset[str]:
        """Texts that may name the module of a name; none where no entry tells."""
        told = [texts for keys, texts in self.entries if name in keys]
        return frozenset().union(*told, *(keys for keys, texts in self.entries if name in texts))

    @property
    def texts(self) -> frozenset[str]:
        """All texts that may name a module."""
        return frozenset().union(*(side for entry in self.entries for side in entry))


@dataclass(frozen=True)
class Imports:
    """Imports of a file, in functions too, but for those that only type checkers see.

    ``modules`` are the imported ones, relative ones with their dots. ``uses`` pair modules with names that are asked of
    them, ``ALL`` where a module itself is handed on. ``data`` are packages whose files are read, ``None`` for the
    file's own folder. ``untold`` are the lines that import by a name that is made up.
    """

    modules: tuple[str, ...] = ()
    uses: tuple[tuple[str, str], ...] = ()
    data: tuple[str | None, ...] = ()
    untold: tuple[int, ...] = ()
    late: LateNames = LateNames()


def imports_of(file: Path) -> Imports:
    """Imports of a file, parsed again only where it was changed; none of a file that is no Python."""
    state = file.stat()
    return _parsed(file, state.st_mtime_ns, state.st_size)


@contextmanager
def _without_collection() -> Iterator[None]:
    """Look for no garbage: a tree leaves none, and its many nodes would have all objects looked through again."""
    looked_for = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if looked_for:
            gc.enable()


@cache
@_without_collection()
def _parsed(file: Path, _changed_ns: int, _size: int) -> Imports:
    try:
        tree = ast.parse(file.read_bytes())
    except (SyntaxError, ValueError):
        return Imports()  # whoever imports it will tell
    late = _late_names(tree)
    nodes = list(_nodes(tree, without=LATE))
    calls = [node for node in nodes if isinstance(node, ast.Call)]
    made = {call: _text(call) for call in calls if _last_name(call.func) in IMPORTERS}
    imported = list(_imported(nodes))
    return Imports(
        modules=(*dict.fromkeys(module for module, _, _ in imported), *filter(None, made.values())),
        uses=tuple(dict.fromkeys([*_named(imported), *_used(nodes, _bindings(imported))])),
        data=tuple(dict.fromkeys(_data(nodes, calls))),
        untold=tuple(call.lineno for call, text in made.items() if text is None),
        late=late,
    )


def _nodes(tree: ast.AST, without: str | None = None) -> Iterator[ast.AST]:
    """All nodes but contexts of names, those for type checkers alone and those in a function called ``without``."""
    left: list[ast.AST] = [tree]
    while left:
        node = left.pop()
        if isinstance(node, ast.FunctionDef) and node.name == without:
            continue
        yield node
        if isinstance(node, ast.If) and _last_name(node.test) == "TYPE_CHECKING":
            left.extend(node.orelse)
            continue
        for name in node._fields:
            child = getattr(node, name)
            if isinstance(child, list):
                left.extend(one for one in child if isinstance(one, ast.AST))
            elif isinstance(child, ast.AST) and name != "ctx":
                left.append(child)


def _last_name(node: ast.AST) -> str:
    """``b`` of ``b`` and of ``a.b``."""
    return node.id if isinstance(node, ast.Name) else node.attr if isinstance(node, ast.Attribute) else ""


def _text(call: ast.Call) -> str | None:
    """The first argument where it is a text as it stands."""
    match call.args:
        case [ast.Constant(value=str(text)), *_]:
            return text
    return None


def _imported(nodes: Sequence[ast.AST]) -> Iterator[tuple[str, str | None, str]]:
    """Imported modules, the name that is taken from each (None: itself), and the name that it gets."""
    for node in nodes:
        if isinstance(node, ast.Import):
            yield from ((one.name, None, one.asname or "") for one in node.names)
        elif isinstance(node, ast.ImportFrom):
            module = "." * node.level + (node.module or "")
            yield from ((module, one.name, one.asname or one.name) for one in node.names)


def _named(imported: Sequence[tuple[str, str | None, str]]) -> Iterator[tuple[str, str]]:
    yield from ((module, name) for module, name, _ in imported if name is not None)


def _bindings(imported: Sequence[tuple[str, str | None, str]]) -> Mapping[str, str]:
    """Modules and attributes that each name in the file may stand for."""
    found: dict[str, str] = {}
    for module, name, bound in imported:
        if name is not None:
            found[bound] = f"{module.rstrip('.')}.{name}" if module.strip(".") else f"{module}{name}"
        elif bound:
            found[bound] = module
        else:
            found[module.partition(".")[0]] = module.partition(".")[0]
    return found


def _used(nodes: Sequence[ast.AST], bindings: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    """Modules and attributes that are asked of them, ``ALL`` where a module is handed on as it is."""
    bases = {id(node.value) for node in nodes if isinstance(node, ast.Attribute)}
    for node in nodes:
        if isinstance(node, ast.Attribute) and (base := _dotted(node.value, bindings)):
            yield base, node.attr
        elif isinstance(node, ast.Name) and node.id in bindings and id(node) not in bases:
            yield bindings[node.id], ALL


def _dotted(node: ast.AST, bindings: Mapping[str, str]) -> str | None:
    if isinstance(node, ast.Name):
        return bindings.get(node.id)
    if isinstance(node, ast.Attribute) and (base := _dotted(node.value, bindings)):
        return f"{base}.{node.attr}"
    return None


def _data(nodes: Sequence[ast.AST], calls: Sequence[ast.Call]) -> Iterator[str | None]:
    if any(isinstance(node, ast.Name) and node.id == "__file__" for node in nodes):
        yield None
    yield from (_text(call) for call in calls if _last_name(call.func) == FILES and call.args)


def _late_names(tree: ast.Module) -> LateNames:
    """Names that a module's ``__getattr__`` imports: from all tables of texts in the file, and from its own imports."""
    late = next((node for node in tree.body if isinstance(node, ast.FunctionDef) and node.name == LATE), None)
    if late is None:
        return LateNames()
    entries = [
        (frozenset(_texts(key)), frozenset(_texts(value)))
        for node in _nodes(tree)
        if isinstance(node, ast.Dict)
        for key, value in zip(node.keys, node.values, strict=True)
        if key is not None
    ]
    own = _imported(list(_nodes(late)))
    entries += [(frozenset({module}), frozenset({name} if name else ())) for module, name, _ in own]
    return LateNames(tuple(entries), frozenset(_bound(tree)))


def _bound(tree: ast.Module) -> Iterator[str]:
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.name
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            yield from (one.id for target in targets for one in ast.walk(target) if isinstance(one, ast.Name))
    yield from _bindings(list(_imported(tree.body)))


def _texts(node: ast.AST) -> set[str]:
    constants = (one.value for one in ast.walk(node) if isinstance(one, ast.Constant))
    return {one.partition(":")[0] for one in constants if isinstance(one, str)}
