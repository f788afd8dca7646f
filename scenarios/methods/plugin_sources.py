"""Names that the module of a user's localiser binds, found without running it."""

import ast
from collections.abc import Iterator, Sequence
from pathlib import Path


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
