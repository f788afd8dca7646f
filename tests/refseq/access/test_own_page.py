"""Pages of this process' own behind the proxy: answers, mistakes in a line, faults with a trace, files, pictures."""

import json
import math
from collections.abc import Iterator
from http.cookiejar import CookieJar
from typing import Any
from urllib.error import HTTPError
from urllib.request import HTTPCookieProcessor, OpenerDirector, Request, build_opener

import pytest

from refseq.access.own_page import COMMON, asked, file_routes, shown, told
from refseq.access.policy import AccessPolicy
from refseq.access.proxy import PageProxy, ProxiedPage, proxied
from refseq.errors import RefseqError


class OwnError(Exception):
    """A person's mistake, in a family of its own."""


def divided(query: Any) -> dict[str, float]:
    """A number of the query, divided by zero where it is none."""
    if query.get("x") == "ours":
        raise RefseqError("no such\nmap")
    if query.get("x") == "own":
        raise OwnError("x" * 2000)
    return {"nan": math.nan} if query.get("x") == "nan" else {"half": float(query["x"]) / 2}


@pytest.fixture(scope="module")
def page() -> Iterator[tuple[PageProxy, OpenerDirector]]:
    routes = (
        *file_routes("refseq.access", COMMON, "own_page.css"),
        told("/half", divided, lambda: (OwnError,)),
        asked("/double", lambda given: {"twice": 2 * given["x"]}),
        shown("/picture", lambda query: b"JPEG" if query.get("name") == "ü" else None),
    )
    with proxied(ProxiedPage(routes, lambda _: "/page"), AccessPolicy()) as running:
        opener = build_opener(HTTPCookieProcessor(CookieJar()))
        opener.open(running.address).close()
        yield running, opener


def ask(page: tuple[PageProxy, OpenerDirector], path: str, body: bytes | None = None) -> tuple[int, bytes]:
    proxy, opener = page
    try:
        with opener.open(Request(f"http://127.0.0.1:{proxy.port}{path}", body), timeout=20) as answer:
            return answer.status, answer.read()
    except HTTPError as error:
        return error.code, error.read()


def test_answers_are_json_and_mistakes_a_line(page: tuple[PageProxy, OpenerDirector]) -> None:
    assert ask(page, "/half?x=3") == (200, b'{"half": 1.5}')
    assert ask(page, "/half?x=ours") == (400, b'{"error": "no such map"}')
    status, body = ask(page, "/half?x=own")
    assert (status, len(json.loads(body)["error"])) == (400, 600)


@pytest.mark.parametrize(("x", "line"), [("y", "ValueError: could not convert"), ("nan", "ValueError: Out of range")])
def test_a_fault_of_ours_is_told_and_traced(
    page: tuple[PageProxy, OpenerDirector], capfd: pytest.CaptureFixture[str], x: str, line: str
) -> None:
    status, body = ask(page, f"/half?x={x}")
    assert status == 500
    assert json.loads(body)["error"].startswith(f"a fault of this page, {line}")
    assert "Traceback" in capfd.readouterr().err


@pytest.mark.parametrize("body", [b"", b"[1]", b"{", b"[" * 60_000, b"\xff", b"9" * 6000])
def test_what_is_no_object_is_told(page: tuple[PageProxy, OpenerDirector], body: bytes) -> None:
    assert ask(page, "/double", body) == (400, b'{"error": "the request is no object in JSON"}')


def test_objects_are_worked_on(page: tuple[PageProxy, OpenerDirector]) -> None:
    assert ask(page, "/double", b'{"x": "\xc3\xbc"}') == (200, b'{"twice": "\\u00fc\\u00fc"}')


def test_pictures_and_files_are_served_where_there_are_any(page: tuple[PageProxy, OpenerDirector]) -> None:
    assert ask(page, "/picture?name=%C3%BC") == (200, b"JPEG")
    assert ask(page, "/picture")[0] == ask(page, "/own_page.py")[0] == 404
    assert ask(page, "/page") == ask(page, "/own_page.css")
    assert ask(page, "/own_page.js")[1].startswith(b"// ")
