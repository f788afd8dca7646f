"""MuJoCo Studio's page, behind a proxy that asks for a token: its own server lets anybody in who reaches it.

That server's sockets take connections from this process alone, which are the proxy's. Of what it serves, models that
are dropped onto the page do not pass: nobody would take them.
"""

import logging
import math
import os
import sys
import threading
import time
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

from mujoco.studio import launch_thread, plugin, viewer_protocol, web_viewer

from refseq.access.listener import BoundedListener, free_port
from refseq.access.policy import LOOPBACK, AccessPolicy
from refseq.access.proxy import MOST_CONNECTIONS, PageProxy, ProxiedPage, ProxyRoute, proxied
from refseq.errors import RefseqError
from refseq_bench.sim.errors import SimError

PAGE_FRAME = 1 / 15
"""Period in which the page is drawn [s]; less piles up frames where a browser has no graphics card."""
USUAL_PORTS = range(8080, 8100)
"""Ports that are tried first: a tunnel is set up once for many drives."""
START = 30.0
"""Seconds that the page may take to start."""
FILES = ("/", "/favicon.ico", "/web_client.js", "/web_client.wasm", "/assets/*", "/model")
CONTROLS = "/ui"
"""Keys and the mouse, of one page at a time."""
SOCKETS = (CONTROLS, "/state")


@contextmanager
def launched(
    title: str,
    policy: AccessPolicy,
    plugins: list[Any],
    told: Callable[[str], object],
    own: tuple[ProxyRoute, ...] = (),
) -> Iterator[tuple[Any, Callable[[], float]]]:
    """Run a viewer in a page of our ``own``, to be begun at ``/page``; ``told`` is called with its address.

    Gives the viewer's handle, and what tells when the page that leads the robot last sent something, by this machine's
    clock [s]; −∞: nobody has it open. Its errors, at the start or later, become one line: ``SimError``.
    """
    try:
        with _in_browser(title, plugins) as (handle, inner), _behind_door(inner, policy, own) as proxy:
            told(proxy.address)
            _open_browser(proxy)
            yield handle, lambda: proxy.heard.get(CONTROLS, -math.inf)
    except RuntimeError as error:
        reason = " ".join(str(error).split())
        raise SimError(f"the viewer cannot go on: {reason}; valid without one is a script") from error


@contextmanager
def _behind_door(inner: int, policy: AccessPolicy, own: tuple[ProxyRoute, ...]) -> Iterator[PageProxy]:
    """Serve the viewer at a port of this machine, and our own routes, to who may come in."""
    files = [ProxyRoute(path, f"http://{LOOPBACK}:{inner}") for path in FILES]
    sockets = [ProxyRoute(path, f"http://{LOOPBACK}:{inner}", socket=True) for path in SOCKETS]
    page = ProxiedPage((*own, *files, *sockets), lambda _: "/page" if own else "/")
    with ExitStack() as stack:
        try:
            proxy = stack.enter_context(proxied(page, policy, () if policy.port else USUAL_PORTS))
        except RefseqError as error:
            raise SimError(f"the page {error}, or 0") from error
        yield proxy


class GuardedViewer(web_viewer.WebViewer):  # type: ignore[misc]
    """Listens on the loopback, to this process alone; MuJoCo's own lets anybody in."""

    _host = property(lambda self: LOOPBACK, lambda self, _: None)
    _drawn = 0.0
    _http_sock: Any
    _tcp_sock: Any

    def _start_server(self) -> None:
        self._http_sock = BoundedListener(self._http_sock, MOST_CONNECTIONS, private=True)
        self._tcp_sock = BoundedListener(self._tcp_sock, MOST_CONNECTIONS, private=True)
        super()._start_server()

    @property
    def port(self) -> int:
        """Port of the server that the proxy asks."""
        return int(self._http_port)

    def prepare_next_frame(self) -> bool:
        """Draw no more often than once in ``PAGE_FRAME``."""
        time.sleep(max(0.0, self._drawn + PAGE_FRAME - time.monotonic()))
        self._drawn = time.monotonic()
        return bool(super().prepare_next_frame())


@contextmanager
def _in_browser(title: str, plugins: list[Any]) -> Iterator[tuple[Any, int]]:
    """Launch a viewer as ``mujoco.studio.launch_web`` does; gives its handle and its server's port."""
    of_viewer, of_bench = plugin.split_plugins(plugins)
    config = viewer_protocol.ViewerConfig(title=title, gfx="web", http_port=free_port(), open_browser=False)
    logging.getLogger("WebServer").setLevel(logging.WARNING)
    web_viewer._print_url_banner = lambda *_: None  # it tells of an address that nobody may open
    ready, ports = threading.Event(), list[int]()

    def run(endpoint: Any) -> None:
        try:
            viewer = GuardedViewer(config, endpoint, plugins=of_viewer)
            ports.append(viewer.port)
        finally:
            ready.set()
        viewer_protocol.run_viewer_loop(viewer)

    with launch_thread.launch_thread(run, sim_plugins=of_bench) as handle:
        if not ready.wait(START):
            raise RuntimeError(f"its page did not start within {START:g} s")
        if ports:  # else leaving the block raises what went wrong
            yield handle, ports[0]


def _open_browser(proxy: PageProxy) -> None:
    """Open the page where there is a display."""
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        return
    threading.Thread(target=webbrowser.open, args=(proxy.ticket(),), kwargs={"new": 2}, daemon=True).start()
