"""The proxy before a page, asked with raw bytes: what comes in, what goes out, and who is hung up on."""

import asyncio
import json
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from http import HTTPMethod

import pytest
from aiohttp import ClientSession, CookieJar, WSMsgType, web

from refseq.access import proxy as proxy_module
from refseq.access.listener import BoundedListener, free_port, hidden_host, listening
from refseq.access.policy import LOOPBACK, AccessPolicy, is_loopback
from refseq.access.proxy import MOST_BODY, OwnAnswer, PageProxy, ProxiedPage, ProxyRoute, proxied
from refseq.errors import RefseqError


async def told_back(request: web.Request) -> web.StreamResponse:
    if request.headers.get("Upgrade") == "websocket":
        answering = web.WebSocketResponse()
        await answering.prepare(request)
        async for message in answering:
            if message.data == "end":
                await answering.close(code=4001, message=b"enough")
            else:
                await answering.send_str(f"heard {message.data}")
        return answering
    told = {"method": request.method, "path": request.raw_path, "body": len(await request.read())}
    headers = {"Access-Control-Allow-Origin": "*", "X-Seen": ",".join(sorted(request.headers))}
    return web.json_response(told, headers=headers)


@pytest.fixture(scope="module")
def behind() -> Iterator[str]:
    """A server that lets anybody in, and tells what it was asked."""
    port, loop, ready = free_port(), asyncio.new_event_loop(), threading.Event()

    async def run() -> None:
        app = web.Application(client_max_size=1 << 30)
        app.router.add_route("*", "/{rest:.*}", told_back)
        runner = web.AppRunner(app)
        await runner.setup()
        await web.TCPSite(runner, LOOPBACK, port).start()
        ready.set()

    loop.create_task(run())
    thread = threading.Thread(target=loop.run_forever, daemon=True)
    thread.start()
    ready.wait()
    yield f"http://{LOOPBACK}:{port}"
    loop.call_soon_threadsafe(loop.stop)
    thread.join()


@pytest.fixture(scope="module")
def page(behind: str) -> Iterator[PageProxy]:
    routes = (
        ProxyRoute("/", behind),
        ProxyRoute("/files/*", behind),
        ProxyRoute("/ask", behind, HTTPMethod.POST),
        ProxyRoute("/line", behind, socket=True),
    )
    with proxied(ProxiedPage(routes, lambda host: f"/?from={host}"), AccessPolicy()) as running:
        yield running


def ask(page: PageProxy, line: str, *headers: str, body: bytes = b"", host: str = "") -> tuple[int, str, bytes]:
    """Status, headers and body of the answer to a request line."""
    own = f"Host: {host or f'{LOOPBACK}:{page.port}'}"
    head = "\r\n".join([f"{line} HTTP/1.1", own, "Connection: close", *headers, f"Content-Length: {len(body)}"])
    with socket.create_connection((LOOPBACK, page.port), timeout=20) as connection:
        connection.sendall(f"{head}\r\n\r\n".encode() + body)
        answer = b"".join(iter(lambda: connection.recv(1 << 16), b""))
    told, _, content = answer.partition(b"\r\n\r\n")
    return int(told.split()[1]), told.decode(), content


@pytest.fixture(scope="module")
def cookie(page: PageProxy) -> str:
    status, told, _ = ask(page, f"GET /?token={page.policy.token}")
    assert status == 303
    assert f"Location: /?from={LOOPBACK}:{page.port}" in told
    assert "HttpOnly" in told
    assert page.policy.token not in told
    (line,) = [line for line in told.splitlines() if line.startswith("Set-Cookie: ")]
    return line.removeprefix("Set-Cookie: ").partition(";")[0]


@pytest.mark.parametrize("host", [LOOPBACK, "::1", "localhost"])
def test_the_address_can_be_opened_as_it_is_told(host: str) -> None:
    with proxied(ProxiedPage((ProxyRoute("/", welcomed),)), AccessPolicy(host)) as running:
        assert asyncio.run(opened(running.address)) == "welcome"


async def welcomed(request: web.BaseRequest, body: bytes) -> OwnAnswer:
    return OwnAnswer(b"welcome", "text/plain")


async def opened(address: str) -> str:
    """The page at an address, past the one that sets the cookie."""
    async with ClientSession(cookie_jar=CookieJar(unsafe=True)) as client, client.get(address) as answer:
        return await answer.text()


def test_the_address_leads_to_the_page_and_no_other_page_may_read_it(page: PageProxy, cookie: str) -> None:
    status, told, content = ask(page, "GET /files/a[b]%20c", f"Cookie: {cookie}")
    assert status == 200
    assert json.loads(content) == {"method": "GET", "path": "/files/a[b]%20c", "body": 0}
    assert "Access-Control" not in told
    assert "Referrer-Policy: no-referrer" in told
    assert "Cookie" not in told.partition("X-Seen: ")[2], "the server behind needs to know nothing of the door"


@pytest.mark.parametrize(
    ("line", "headers", "status"),
    [
        ("GET /", (), 403),
        ("GET /?token=guess", (), 403),
        ("GET /?token=", (), 403),
        ("GET /", ("COOKIE", "Origin: http://evil.example"), 403),
        ("GET /", ("COOKIE", "Origin: null"), 403),
        ("GET /", ("COOKIE", "Host: also.example"), 400),
        ("GET /files/a", ("COOKIE", "Sec-Fetch-Site: same-site", "Sec-Fetch-Mode: no-cors"), 403),
        ("GET /files/a", ("COOKIE", "Sec-Fetch-Site: cross-site", "Sec-Fetch-Mode: navigate"), 403),
        ("GET /", ("COOKIE", "Sec-Fetch-Site: cross-site", "Sec-Fetch-Mode: navigate"), 200),
        ("GET /else", ("COOKIE",), 404),
        ("GET /line", ("COOKIE",), 404),
        ("GET /files/../else", ("COOKIE",), 404),
        ("GET /files/%2e%2e/else", ("COOKIE",), 404),
        ("GET http://evil.example/files/a", ("COOKIE",), 404),
        ("GET /ask", ("COOKIE",), 404),
        ("PUT /", ("COOKIE",), 405),
        ("OPTIONS /ask", ("COOKIE",), 405),
        ("CONNECT 127.0.0.1:1", ("COOKIE",), 405),
    ],
)
def test_only_what_the_page_needs_passes(
    page: PageProxy, cookie: str, line: str, headers: tuple[str, ...], status: int
) -> None:
    words = [f"Cookie: {cookie}" if word == "COOKIE" else word for word in headers]
    found, told, content = ask(page, line, *words)
    assert found == status, told
    assert status == 200 or content.count(b"\n") <= 1


def test_a_name_that_somebody_gave_this_machine_is_refused(page: PageProxy, cookie: str) -> None:
    for host in ("evil.example", "evil.example:80", "127.0.0.1.evil.example", "a@127.0.0.1", "", "[::1", "\\127.0.0.1"):
        status, _, _ = ask(page, "GET /", f"Cookie: {cookie}", host=host or " ")
        assert status in (400, 403), host
    assert ask(page, "GET /", f"Cookie: {cookie}", host="localhost:1")[0] == 200, "through a tunnel"


def test_a_ticket_serves_once(page: PageProxy) -> None:
    path = page.ticket().partition(f"{page.port}")[2]
    assert [ask(page, f"GET {path}")[0] for _ in range(2)] == [303, 403]


def test_bodies_are_bounded(page: PageProxy, cookie: str) -> None:
    status, _, content = ask(page, "POST /ask", f"Cookie: {cookie}", body=bytes(MOST_BODY))
    assert (status, json.loads(content)["body"]) == (200, MOST_BODY)
    assert ask(page, "POST /ask", f"Cookie: {cookie}", body=bytes(MOST_BODY + 1))[0] == 413


def test_sockets_are_joined_and_end_alike(page: PageProxy) -> None:
    async def talk() -> list[object]:
        async with ClientSession(cookie_jar=CookieJar(unsafe=True)) as session:
            await session.get(page.address)
            async with session.ws_connect(f"http://{LOOPBACK}:{page.port}/line?sid=1") as line:
                await line.send_str("a")
                first = (await line.receive()).data
                heard = "/line" in page.heard
                await line.send_str("end")
                last = await line.receive()
                return [first, heard, last.type, last.data, last.extra]

    assert asyncio.run(talk()) == ["heard a", True, WSMsgType.CLOSE, 4001, "enough"]
    end = time.monotonic() + 20
    while page.heard and time.monotonic() < end:
        time.sleep(0.01)
    assert page.heard == {}, "nobody is there any more"


def test_who_says_nothing_is_hung_up_on(behind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(proxy_module, "PATIENCE", 0.3)
    monkeypatch.setattr(proxy_module, "MOST_CONNECTIONS", 8)
    with proxied(ProxiedPage((ProxyRoute("/", behind),)), AccessPolicy()) as page, ExitStack() as lines:
        opened = [lines.enter_context(socket.create_connection((LOOPBACK, page.port), timeout=20)) for _ in range(20)]
        for one in opened:
            one.settimeout(20)
            with suppress(ConnectionResetError):
                assert one.recv(1) == b""
        assert ask(page, f"GET /?token={page.policy.token}")[0] == 303


def test_a_private_listener_takes_connections_of_this_process_alone() -> None:
    with BoundedListener(listening(LOOPBACK, 0, 2), 2, private=True) as listener:
        port = listener.getsockname()[1]
        code = (
            f"import socket; s = socket.create_connection(('{LOOPBACK}', {port})); s.settimeout(20); print(s.recv(1))"
        )
        with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE) as stranger:
            accepted = False
            while stranger.poll() is None and not accepted:
                try:
                    listener.accept()
                    accepted = True
                except BlockingIOError:
                    pass
            assert not accepted
        with socket.create_connection((LOOPBACK, port)):
            listener.accept()[0].close()


def test_addresses_that_cannot_be_listened_at_are_a_line() -> None:
    with listening(LOOPBACK, 0, 1) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(RefseqError, match=f"{port}: cannot be served from: Address already in use"):
            listening(LOOPBACK, port, 1)
    address = "203.0.113.1 port 0: cannot be served from: .*; valid is an address of this machine and a free port$"
    with pytest.raises(RefseqError, match=address):
        listening("203.0.113.1", 0, 1)
    with pytest.raises(RefseqError, match="cannot be served from"):
        listening("192.0.2.1", 0, 1)


def test_hidden_addresses_are_of_this_machine_and_differ() -> None:
    hosts = {hidden_host() for _ in range(5)}
    assert all(map(is_loopback, hosts))
    assert len(hosts) == 5 or hosts == {LOOPBACK}
