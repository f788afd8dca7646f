"""Checks before anything is shown: a display, a viewer that answers, a free port.

They load no viewer: who has none is told at once.
"""

import os
import socket
import sys
from contextlib import closing
from urllib.parse import urlsplit

from refseq.access.policy import LOOPBACK
from refseq.errors import RefseqError
from refseq.viewer.http2 import speaks_http2

ANSWER = 5.0
"""Seconds in which a viewer elsewhere answers."""


def check_display() -> None:
    """Raise ``RefseqError`` where no window can be opened."""
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise RefseqError(
            "no display: DISPLAY and WAYLAND_DISPLAY are unset; valid is a desktop session, or instead "
            "of a window a file (-o; --rrd of refseq live), a browser (--serve) or a viewer elsewhere (--connect)"
        )


def check_free(port: int) -> None:
    """Raise ``RefseqError`` when somebody listens at a port of this machine already, or it is not ours to take."""
    with closing(socket.socket()) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # one that was served from a minute ago is free
        try:
            probe.bind((LOOPBACK, port))
        except (OSError, OverflowError) as error:
            reason = error.strerror if isinstance(error, OSError) else str(error)
            raise RefseqError(f"port {port} cannot be served from: {reason}; valid is a free port") from error


def check_answers(url: str) -> None:
    """Raise ``RefseqError`` unless something that speaks gRPC answers at a viewer's address."""
    parts = urlsplit(url)
    try:
        port = parts.port
    except ValueError:
        port = None
    if parts.scheme not in ("rerun", "rerun+http", "rerun+https") or not parts.hostname or parts.path != "/proxy":
        raise RefseqError(f"viewer {url!r}: is no viewer's address; valid is rerun+http://HOST:PORT/proxy")
    if port is None:
        raise RefseqError(f"viewer {url!r}: has no port from 1 to 65535; valid is rerun+http://HOST:PORT/proxy")
    try:
        with socket.create_connection((parts.hostname, port), timeout=ANSWER) as probe:
            # Behind encryption it cannot be asked without a library.
            speaks = parts.scheme != "rerun+http" or speaks_http2(probe)
    except OSError as error:
        raise RefseqError(
            f"viewer {url}: nobody answers ({error.strerror or error}); start one there with 'rerun', "
            "and see that its port is open to this machine"
        ) from error
    if not speaks:
        raise RefseqError(f"viewer {url}: what answers there is no Rerun viewer")
