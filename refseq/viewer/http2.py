"""Recognise a server of HTTP/2, which gRPC runs over."""

import socket

PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + bytes([0, 0, 0, 4, 0, 0, 0, 0, 0])
"""A client begins with a fixed text and empty settings (RFC 9113, section 3.4)."""
SETTINGS = 4
"""Type of the frame that a server answers first, in byte 3."""
HEAD = 9
"""Bytes of a frame's head."""


def speaks_http2(line: socket.socket) -> bool:
    """Greet whoever is at the other end of a line, and see whether settings come back. Raises ``OSError``."""
    line.sendall(PREFACE)
    return line.recv(HEAD)[3:4] == bytes([SETTINGS])
