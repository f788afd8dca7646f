"""A proxy before page servers that ask nobody who they are, and before pages of this process' own.

Only what a page needs passes: methods and paths of a list, headers of a list, bodies and messages up to a size, so many
connections at a time. The address that is given out holds a token. Who comes by it gets a cookie and the page without
the token, which is thus in no ``Referer`` and no history of pages.
"""

import asyncio
import logging
import secrets
import threading
import time
from collections.abc import Awaitable, Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from functools import partial
from http import HTTPMethod
from typing import Any, cast

from aiohttp import ClientError, ClientSession, ClientTimeout, TCPConnector, WSMsgType, web
from yarl import URL

from refseq.access.listener import BoundedListener, listening
from refseq.access.policy import AccessPolicy, same_secret
from refseq.errors import RefseqError

MOST_CONNECTIONS = 64
"""Connections at a time: a browser opens up to six for a page, and one for each socket."""
MOST_BODY = 1 << 16
"""The largest body of a request [bytes]; what pages ask for fits in a tenth."""
MOST_MESSAGE = 1 << 16
"""The largest message that a page sends [bytes]: keys and the mouse; a pasted text is cut off there."""
LARGEST_ANSWER = 1 << 26
"""The largest message to a page [bytes]: a picture of the form."""
PATIENCE = 10.0
"""Seconds in which a request has to be here whole."""
IDLE = 30.0
"""Seconds that a connection is kept for the next request."""
ALIVE = 20.0
"""Period in which a page is asked whether it is still there [s]."""
FAREWELL = 1.0
"""Seconds in which connections end with the proxy."""

FORWARDED = ("Accept", "Accept-Encoding", "Content-Type", "X-Grpc-Web", "X-User-Agent", "Grpc-Timeout")
"""Headers of a request that pass."""
HELD_BACK = ("connection", "keep-alive", "transfer-encoding", "upgrade", "trailer", "server", "date", "set-cookie")
"""Headers of an answer that do not; nor does any that lets other origins read it."""
HEADERS = {
    "Content-Security-Policy": (
        "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval' blob:; "
        "style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; worker-src 'self' blob:; "
        "connect-src 'self' data: blob:; frame-src 'self'; frame-ancestors 'self'; base-uri 'none'; form-action 'none'"
    ),
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}
"""Headers of all answers: the page loads from here alone, and no page of elsewhere reads or frames it."""

QUIET = logging.getLogger("refseq.access")
"""Nothing that strangers send is worth a line."""
QUIET.setLevel(logging.CRITICAL)
QUIET.addHandler(logging.NullHandler())
QUIET.propagate = False


@dataclass(frozen=True, slots=True)
class OwnAnswer:
    """An answer of this process' own; ``body`` is of this content type."""

    body: bytes
    content_type: str
    status: int = 200


OwnHandler = Callable[[web.BaseRequest, bytes], Awaitable[OwnAnswer]]
"""Answers a request, whose body is given whole."""


@dataclass(frozen=True, slots=True)
class ProxyRoute:
    """A request that passes: a ``method``, a ``path`` or pattern of paths, to what is ``behind``.

    That is a server by its address, maybe as a WebSocket, or a function of this process.
    """

    path: str
    behind: str | OwnHandler
    method: HTTPMethod = HTTPMethod.GET
    socket: bool = False


@dataclass(frozen=True, slots=True)
class ProxiedPage:
    """Routes to the servers behind, and the page to begin with, for the host that the browser calls it by."""

    routes: tuple[ProxyRoute, ...]
    start: Callable[[str], str] = lambda host: "/"


@dataclass
class PageProxy:
    """A proxy that runs; ``address`` is the page's with its token.

    ``heard`` has for each open socket's path when the page last sent something, by this machine's clock [s].
    """

    page: ProxiedPage
    policy: AccessPolicy
    port: int
    heard: dict[str, float] = field(default_factory=dict)
    _cookie: str = field(default_factory=lambda: secrets.token_hex(16), repr=False)
    _tickets: set[str] = field(default_factory=set, repr=False)
    _session: Any = field(default=None, repr=False)

    @property
    def address(self) -> str:
        """Address to open."""
        return self._address(self.policy.token)

    def ticket(self) -> str:
        """Address for one visit, for a browser that is started: others of this machine read what it is started with."""
        self._tickets.add(ticket := secrets.token_hex(16))
        return self._address(ticket)

    def _address(self, token: str) -> str:
        return f"http://{self.policy.authority(self.port)}/?token={token}"

    async def serve(self, listener: BoundedListener, ended: asyncio.Event) -> None:
        """Serve until the end is told."""
        timeout = ClientTimeout(total=None, sock_connect=PATIENCE)
        async with ClientSession(
            connector=TCPConnector(limit=0), timeout=timeout, auto_decompress=False, max_line_size=1 << 16
        ) as self._session:
            server = web.Server(self._answer)
            loop = asyncio.get_running_loop()

            def connected() -> Any:
                handler = TerseHandler(server, loop=loop, access_log=QUIET, logger=QUIET, keepalive_timeout=IDLE)
                loop.call_later(PATIENCE, self._hang_up_on_silence, handler)
                return handler

            accepting = await loop.create_server(connected, sock=listener)
            try:
                await ended.wait()
            finally:
                accepting.close()
                await server.shutdown(FAREWELL)

    def _hang_up_on_silence(self, handler: Any) -> None:
        if not handler.greeted and handler.transport is not None:
            handler.transport.abort()

    async def _answer(self, request: web.BaseRequest) -> web.StreamResponse:
        cast(TerseHandler, request.protocol).greeted = True
        refusal = self._refusal(request)
        if refusal is not None:
            return refusal
        if "token" in request.query and request.path == "/":
            return self._welcome(request)
        route = self._route(request)
        if route is None:
            return _told(404, "there is nothing here")
        with suppress(ClientError, ConnectionError):
            if route.socket:
                return await self._bridged(request, route)
            body = await _body_of(request) if route.method is HTTPMethod.POST else b""
            return await self._passed_on(request, route, body) if isinstance(body, bytes) else body
        return _told(502, "the page has ended")

    def _refusal(self, request: web.BaseRequest) -> web.Response | None:
        """The answer to a request that is not let in."""
        if request.method not in {route.method for route in self.page.routes}:
            return _told(405, "this method is not served")
        headers = request.headers
        hosts, origins = headers.getall("Host", []), headers.getall("Origin", [])
        if reason := self.policy.reason_against_page(hosts, origins):
            return _told(403, reason)
        if self._is_known(request):
            return None
        given = request.query.getall("token", [""])
        if given[0] in self._tickets:
            self._tickets.discard(given[0])
            return None
        reason = self.policy.reason_against(hosts, origins, given[:1])
        return _told(403, f"{reason}; valid is the one that was printed") if reason else None

    def _is_known(self, request: web.BaseRequest) -> bool:
        """Tell whether a request is of a page that was let in before, and shown to a person."""
        if "token" in request.query or not same_secret(request.cookies.get(self._cookie_name, ""), self._cookie):
            return False
        # A page at another port of this machine has the cookie too; of it there may only be links to the page.
        site, mode = request.headers.get("Sec-Fetch-Site", "none"), request.headers.get("Sec-Fetch-Mode", "navigate")
        return site in ("none", "same-origin") or (mode == "navigate" and request.path == "/")

    @property
    def _cookie_name(self) -> str:
        return f"refseq-{self.port}"

    def _welcome(self, request: web.BaseRequest) -> web.Response:
        answer = web.Response(status=303, headers={**HEADERS, "Location": self.page.start(request.headers["Host"])})
        answer.headers["Cache-Control"] = "no-store"
        answer.set_cookie(self._cookie_name, self._cookie, httponly=True, samesite="Lax", path="/")
        return answer

    def _route(self, request: web.BaseRequest) -> ProxyRoute | None:
        socket = request.headers.get("Upgrade", "").lower() == "websocket"
        for route in self.page.routes:
            if (route.method, route.socket) == (request.method, socket) and fnmatchcase(request.path, route.path):
                return route if request.raw_path.startswith("/") and ".." not in request.path else None
        return None

    async def _passed_on(self, request: web.BaseRequest, route: ProxyRoute, body: bytes) -> web.StreamResponse:
        """Pass a request on, and its answer back piece by piece."""
        if not isinstance(route.behind, str):
            own = await route.behind(request, body)
            headers = {**HEADERS, "Content-Type": own.content_type, "Cache-Control": "no-store"}
            return web.Response(status=own.status, body=own.body, headers=headers)
        headers = {name: request.headers[name] for name in FORWARDED if name in request.headers}
        async with self._session.request(
            route.method, _address_of(route, request), headers=headers, data=body or None, allow_redirects=False
        ) as behind:
            answer = web.StreamResponse(status=behind.status, headers=_headers(behind.headers))
            await answer.prepare(request)
            try:
                async for piece in behind.content.iter_any():
                    await answer.write(piece)
                await answer.write_eof()
            except (ClientError, ConnectionError):
                if request.transport is not None:
                    request.transport.abort()  # so that nobody takes a half for the whole
            return answer

    async def _bridged(self, request: web.BaseRequest, route: ProxyRoute) -> web.StreamResponse:
        """Join the page's socket to the one behind, until either ends."""
        async with self._session.ws_connect(
            _address_of(route, request), max_msg_size=LARGEST_ANSWER, autoping=True, compress=0
        ) as behind:
            page = web.WebSocketResponse(max_msg_size=MOST_MESSAGE, heartbeat=ALIVE, compress=False)
            await page.prepare(request)
            hear = partial(self._hear, route.path)
            ways = [asyncio.create_task(_carry(page, behind, hear)), asyncio.create_task(_carry(behind, page))]
            try:
                await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
            finally:
                for way in ways:
                    way.cancel()
                await asyncio.gather(*ways, return_exceptions=True)
                self.heard.pop(route.path, None)
            return page

    def _hear(self, path: str) -> None:
        self.heard[path] = time.monotonic()


class TerseHandler(web.RequestHandler):
    """Answers what is no request in one line, where aiohttp would repeat it; ``greeted`` by one that was whole."""

    __slots__ = ("greeted",)

    def __init__(self, *given: Any, **options: Any) -> None:
        super().__init__(*given, **options)
        self.greeted = False

    def handle_error(self, request: Any, status: int = 500, exc: Any = None, message: Any = None) -> web.StreamResponse:
        """The answer to an error."""
        if request.writer.output_size > 0:
            raise ConnectionError("an answer had begun") from exc
        return _told(status, "this is no request")


async def _carry(source: Any, sink: Any, each: Callable[[], None] = lambda: None) -> None:
    """Carry messages until one of both sockets ends, and end the other in the same way; call ``each`` for each."""
    while True:
        message = await source.receive()
        each()
        if message.type is WSMsgType.TEXT:
            await sink.send_str(message.data)
        elif message.type is WSMsgType.BINARY:
            await sink.send_bytes(message.data)
        else:
            said = message.extra if isinstance(message.extra, str) else ""
            code = source.close_code
            await sink.close(code=code if code and code != 1006 else 1001, message=said.encode()[:120])
            return


async def _body_of(request: web.BaseRequest) -> bytes | web.Response:
    """The body of a request, or the answer to one that is too slow or too large."""
    try:
        async with asyncio.timeout(PATIENCE):
            body = await request.content.read(MOST_BODY + 1)
            while body and len(body) <= MOST_BODY and not request.content.at_eof():
                body += await request.content.read(MOST_BODY + 1)
    except TimeoutError:
        return _told(408, "the request did not arrive")
    return body if len(body) <= MOST_BODY else _told(413, f"the request has more than {MOST_BODY} bytes")


def _address_of(route: ProxyRoute, request: web.BaseRequest) -> URL:
    """The address behind, with the path as it came: servers differ in what they take for the same path."""
    return URL(f"{route.behind}{request.raw_path}", encoded=True)


def _headers(behind: Any) -> dict[str, str]:
    kept = {name: value for name, value in behind.items() if name.lower() not in HELD_BACK}
    return {name: value for name, value in kept.items() if not name.lower().startswith("access-control")} | HEADERS


def _told(status: int, line: str) -> web.Response:
    answer = web.Response(status=status, text=f"{line}\n", headers=HEADERS)
    answer.force_close()
    return answer


@contextmanager
def proxied(page: ProxiedPage, policy: AccessPolicy, ports: Sequence[int] = ()) -> Iterator[PageProxy]:
    """Serve a page from a thread of its own, at the first of ``ports`` that is free, else at the policy's.

    Raises ``RefseqError`` where none is.
    """
    listener = _first_free(policy, ports)
    proxy = PageProxy(page, policy, listener.getsockname()[1])
    ready: threading.Event = threading.Event()
    ending: list[Callable[[], object]] = []

    async def run() -> None:
        ended, loop = asyncio.Event(), asyncio.get_running_loop()
        ending.append(lambda: loop.call_soon_threadsafe(ended.set))
        ready.set()
        await proxy.serve(listener, ended)

    thread = threading.Thread(target=_run, args=(run,), daemon=True, name="page proxy")
    thread.start()
    ready.wait()
    try:
        yield proxy
    finally:
        ending[0]()
        thread.join(5 * FAREWELL)
        listener.close()


def _run(work: Callable[[], Awaitable[None]]) -> None:
    with asyncio.Runner() as runner:
        runner.get_loop().set_exception_handler(lambda *_: None)  # a connection that breaks is nobody's concern
        runner.run(work())  # type: ignore[arg-type]


def _first_free(policy: AccessPolicy, ports: Sequence[int]) -> BoundedListener:
    for port in ports:
        with suppress(RefseqError):
            return listening(policy.host, port, MOST_CONNECTIONS)
    return listening(policy.host, policy.port, MOST_CONNECTIONS)
