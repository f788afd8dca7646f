"""Rules of who may come in: the token of an address, the ``Host`` and ``Origin`` of a request.

All servers ask ``AccessPolicy``. A request comes in when it names this machine, comes from no foreign web page, and has
the token. The first two hold off pages that a browser shows (also those that give this machine a name of their own: DNS
rebinding), the third everybody else.
"""

import hmac
import ipaddress
import re
import secrets
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from urllib.parse import urlsplit

from refseq.errors import RefseqError

LOOPBACK = "127.0.0.1"
SHORTEST_TOKEN = 16
"""Fewest characters of a token: guessed at 1000 tries a second, one of 16 hexadecimal digits lasts for ever."""

ORIGIN = re.compile(r"[a-z][a-z0-9+.-]*://[^/?#@\sA-Z]+")
"""A page's origin as browsers send it: no path, not even a stroke at its end, and small letters."""


def random_token() -> str:
    """A token that nobody guesses."""
    return secrets.token_hex(16)


@dataclass(frozen=True)
class AccessPolicy:
    """Address of a server, and who may come in.

    ``token`` is asked for in every request; without one it is drawn, where only this machine comes to. ``origins`` are
    web pages that are let in beside the server's own. Raises ``RefseqError`` for a token that is short, for an address
    that other machines reach without one, and for an origin that no browser sends.
    """

    host: str = LOOPBACK
    port: int = 0
    token: str = ""
    origins: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not self.token and not self.on_loopback:
            raise RefseqError(
                f"host {self.host!r} is reached from other machines; valid is --token with {SHORTEST_TOKEN} characters "
                f"or more, or {LOOPBACK}"
            )
        if not self.token:
            object.__setattr__(self, "token", random_token())
        if len(self.token) < SHORTEST_TOKEN or not self.token.isascii() or not self.token.isalnum():
            raise RefseqError(
                f"token of {len(self.token)} characters: valid are {SHORTEST_TOKEN} or more, letters and digits"
            )
        for origin in self.origins:
            if not ORIGIN.fullmatch(origin):
                raise RefseqError(f"origin {origin!r:.100} is not valid; valid is one as https://example.org, no path")

    @property
    def on_loopback(self) -> bool:
        """Tell whether only this machine reaches it."""
        return is_loopback(self.host)

    def authority(self, port: int) -> str:
        """Host and port as addresses have them: a number of IPv6 in brackets, as it has colons of its own."""
        return f"[{self.host}]:{port}" if ":" in self.host else f"{self.host}:{port}"

    def reason_against(self, hosts: Sequence[str], origins: Sequence[str], given: Iterable[str]) -> str:
        """Why a request is not let in; empty: it is.

        ``hosts`` and ``origins`` are its headers of these names, ``given`` what it has in places where a token may be.
        """
        if reason := self.reason_against_page(hosts, origins):
            return reason
        if not any(same_secret(one, self.token) for one in given):
            return "the token of the address is missing or wrong"
        return ""

    def reason_against_page(self, hosts: Sequence[str], origins: Sequence[str]) -> str:
        """Why the page or address that a request comes from is not let in, whatever token it has; empty: it is."""
        host = hosts[0] if len(hosts) == 1 else ""
        # A page may have this machine's address under a name of its own, and has then no foreign origin.
        if self.on_loopback and not is_loopback(_name_in(host)):
            return "the address is not this machine's"
        known = (f"http://{host}", *self.origins)
        if origins and (len(origins) > 1 or origins[0] not in known):
            return f"pages of {origins[0]:.100} are not let in"
        return ""


def same_secret(given: str, secret: str) -> bool:
    """Compare in a time that tells nothing about how much of it is right."""
    return hmac.compare_digest(given.encode(errors="replace"), secret.encode())


def is_loopback(host: str) -> bool:
    """Tell whether a name or number means this machine alone."""
    if host == "localhost":
        return True
    with suppress(ValueError):
        return ipaddress.ip_address(host).is_loopback
    return False


def _name_in(host: str) -> str:
    """The name in a request's header, without the port; empty for what is none."""
    if not host or any(sign in host for sign in "/@?#\\ "):
        return ""
    with suppress(ValueError):
        return urlsplit(f"//{host}").hostname or ""
    return ""
