"""Pages of this process' own behind the proxy: files, answers in JSON, pictures; mistakes are told in a line.

A page asks for what has changed, and shows it. Nothing in it comes from outside, and no text becomes markup.
"""

import asyncio
import json
import traceback
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from http import HTTPMethod, HTTPStatus
from importlib.resources import files
from typing import Any

from aiohttp import web

from refseq.access.proxy import OwnAnswer, ProxyRoute
from refseq.errors import RefseqError

KINDS = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".json": "application/json",
}
COMMON = ("own_page.css", "own_page.js")
"""Files beside this one, for all such pages: how they look, and how they ask."""
LONGEST_LINE = 600
"""Characters of a mistake that are told."""

Query = Mapping[str, str]
"""Words behind the question mark of an address."""
Known = Callable[[], tuple[type[Exception], ...]]
"""Families of errors that are a person's mistakes, and so told."""


def file_routes(package: str, names: Sequence[str], start: str) -> tuple[ProxyRoute, ...]:
    """Serve files of a package under their names, the common ones beside them, and the file ``start`` at ``/page``."""
    own = [ProxyRoute(f"/{name}", _file(package, name)) for name in names]
    common = [ProxyRoute(f"/{name}", _file(__package__ or "", name)) for name in COMMON]
    return (ProxyRoute("/page", _file(package, start)), *own, *common)


def told(path: str, answer: Callable[[Query], object], known: Known = tuple) -> ProxyRoute:
    """Answer GET with what a function says, as JSON."""

    async def handle(request: web.BaseRequest, _: bytes) -> OwnAnswer:
        return await _answered(lambda: answer(dict(request.query)), known)

    return ProxyRoute(path, handle)


def asked(path: str, work: Callable[[dict[str, Any]], object], known: Known = tuple) -> ProxyRoute:
    """Answer POST of a JSON object with what a function makes of it, as JSON."""

    async def handle(_: web.BaseRequest, body: bytes) -> OwnAnswer:
        return await _answered(lambda: work(_object_in(body)), known)

    return ProxyRoute(path, handle, HTTPMethod.POST)


def shown(path: str, picture: Callable[[Query], bytes | None]) -> ProxyRoute:
    """Answer GET with a picture (JPEG), where there is one."""

    async def handle(request: web.BaseRequest, _: bytes) -> OwnAnswer:
        found = await asyncio.to_thread(picture, dict(request.query))
        return OwnAnswer(found or b"", "image/jpeg", 200 if found else 404)

    return ProxyRoute(path, handle)


async def _answered(work: Callable[[], object], known: Known) -> OwnAnswer:
    """Work beside the loop, so that others are served meanwhile; what is nobody's mistake but ours is traced, too."""
    try:
        return _in_json(await asyncio.to_thread(work), HTTPStatus.OK)
    except Exception as error:
        line = " ".join(str(error).split())[:LONGEST_LINE]
        if isinstance(error, (RefseqError, *known())):
            return _in_json({"error": line}, HTTPStatus.BAD_REQUEST)
        traceback.print_exc()
        told = f"a fault of this page, {type(error).__name__}: {line}"
        return _in_json({"error": told}, HTTPStatus.INTERNAL_SERVER_ERROR)


def _in_json(answer: object, status: HTTPStatus) -> OwnAnswer:
    return OwnAnswer(json.dumps(answer, allow_nan=False).encode(), KINDS[".json"], status)


def _object_in(body: bytes) -> dict[str, Any]:
    try:
        found = json.loads(body)
    except (ValueError, RecursionError):
        found = None
    if not isinstance(found, dict):
        raise RefseqError("the request is no object in JSON")
    return found


def _file(package: str, name: str) -> Callable[[web.BaseRequest, bytes], Any]:
    async def handle(_: web.BaseRequest, __: bytes) -> OwnAnswer:
        return OwnAnswer(_content(package, name), KINDS[name[name.rindex(".") :]])

    return handle


@cache
def _content(package: str, name: str) -> bytes:
    return files(package).joinpath(name).read_bytes()
