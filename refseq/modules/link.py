"""The link between modules: zenoh, with the robot's process as the one that others connect to.

The robot listens at one address; all others connect to it, and again after it or the network was gone. Each publishes
under the topics of ``messages``; what a restarted module has to know again is kept by its publisher and sent to those
who come late. A module that is there has a token; the token goes with its process at once, and within ``LEASE`` seconds
with its machine or the network.
"""

import json
import os
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from refseq.access.policy import AccessPolicy, is_loopback, random_token
from refseq.errors import RefseqError
from refseq.modules.heads import Parts

if TYPE_CHECKING:
    import zenoh

PORT = 7447
"""Port at which the robot listens: zenoh's own."""
LEASE = 0.8
"""Seconds without a sign of life after which a connection is given up: a smaller one takes a busy machine for a dead
one, a larger one lets the robot go on for longer where a cable is cut."""
SIGNS = 4
"""Signs of life in that time."""
AGAIN = 0.2
"""Period in which the robot is looked for [s]."""
USER = "refseq"
"""Name by which modules know each other; the token is the password."""
PREFIX = "refseq"
ALIVE = f"{PREFIX}/alive"
CLAIMS = f"{PREFIX}/claims"
"""Tokens of those who have a role alone, or are about to: others are not told of them."""
SEVERAL = ("viewer",)
"""Roles of which there may be several."""
TOKEN_FILE = Path(".config") / "refseq" / "module-token"
"""The token of modules on one machine, in the home of their user, who alone may read it."""

Publish = Callable[[Parts], None]


class Link(Protocol):
    """Connection of a module to all others."""

    def publisher(self, topic: str, keep: int = 0) -> Publish:
        """Publish on a topic; the last ``keep`` messages are sent to those who come late as well."""

    def subscribe(self, topic: str, take: Callable[[Parts], None]) -> Callable[[], None]:
        """Have ``take`` called with each message, those that were kept first; what is given back ends it."""

    def join(self, role: str) -> None:
        """Be seen by others in a role."""

    def watch(self, told: Callable[[str, bool], None]) -> None:
        """Have it told which roles come and go."""


class ZenohLink:
    """A link over the network (``opened``): the robot's side listens, the others connect to it."""

    def __init__(self, session: "zenoh.Session") -> None:
        self._session = session
        self._held: list[Any] = []  # what is dropped is undeclared

    def publisher(self, topic: str, keep: int = 0) -> Publish:
        """Publish on a topic; the last ``keep`` messages are sent to those who come late as well."""
        from zenoh import CongestionControl, Reliability, ext

        publisher = ext.declare_advanced_publisher(
            self._session,
            f"{PREFIX}/{topic}",
            congestion_control=CongestionControl.BLOCK,
            reliability=Reliability.RELIABLE,
            cache=ext.CacheConfig(keep) if keep else None,
            publisher_detection=bool(keep),
            sample_miss_detection=ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=None) if keep else None,
        )
        self._held.append(publisher)
        return lambda parts: publisher.put(ext.z_serialize(parts))

    def subscribe(self, topic: str, take: Callable[[Parts], None]) -> Callable[[], None]:
        """Have ``take`` called with each message, those that were kept first; what is given back ends it."""
        from zenoh import ext

        def received(sample: "zenoh.Sample") -> None:
            take(_unpacked(sample.payload))

        subscriber = ext.declare_advanced_subscriber(
            self._session,
            f"{PREFIX}/{topic}",
            received,
            history=ext.HistoryConfig(detect_late_publishers=True),
        )
        self._held.append(subscriber)
        return subscriber.undeclare

    def join(self, role: str) -> None:
        """Be seen in a role, which all but viewers have alone. Raises ``RefseqError`` where another one is."""
        if role not in SEVERAL:
            self._held.append(self._claimed(role))
        self._held.append(self._session.liveliness().declare_token(f"{ALIVE}/{role}"))

    def _claimed(self, role: str) -> Any:
        """The token of a role that nobody else claims. Raises ``RefseqError`` where another one does.

        It looks again behind its claim: of two that come at once, both of which saw nobody, at least one sees the
        other. Then the first by name stays, and waits until the other has gone.
        """
        mine = f"{CLAIMS}/{role}/{random_token()}"
        claim: Any = None
        for _ in range(int(2 * LEASE / AGAIN)):  # one that died a moment ago may still be seen
            if claim is None and not self._claims(role):
                claim = self._session.liveliness().declare_token(mine)
            if claim is not None:
                others = self._claims(role) - {mine}
                if not others:
                    return claim
                if min(others) < mine:
                    claim.undeclare()
                    claim = None
            time.sleep(AGAIN)
        if claim is not None:
            claim.undeclare()
        raise RefseqError(f"module {str(role)!r}: one is there already; valid is one at a time")

    def _claims(self, role: str) -> set[str]:
        replies = self._session.liveliness().get(f"{CLAIMS}/{role}/*", timeout=1.0)
        return {str(reply.ok.key_expr) for reply in replies if reply.ok is not None}

    def watch(self, told: Callable[[str, bool], None]) -> None:
        """Have it told which roles come and go."""
        from zenoh import SampleKind

        def received(sample: "zenoh.Sample") -> None:
            told(str(sample.key_expr).rpartition("/")[2], sample.kind == SampleKind.PUT)

        self._held.append(self._session.liveliness().declare_subscriber(f"{ALIVE}/*", received, history=True))


def _unpacked(payload: "zenoh.ZBytes") -> Parts:
    """The parts of a message; one that is none has no parts, and so no head."""
    from zenoh import ext

    try:
        return list(ext.z_deserialize(list[tuple[str, bytes]], payload))
    except (ext.ZDeserializeError, ValueError):
        return []


@contextmanager
def opened(policy: AccessPolicy, *, serves: bool, waits: Callable[[str], None]) -> Iterator[ZenohLink]:
    """A link, closed behind the block; ``waits`` is told once where the robot is not there yet.

    Raises ``RefseqError`` without the library, and for an address that cannot be listened at.
    """
    try:
        import zenoh
    except ImportError as error:
        raise RefseqError("modules need eclipse-zenoh; valid is to install it: pip install eclipse-zenoh") from error
    session: zenoh.Session = _listening(zenoh, policy) if serves else _connected(zenoh, policy, waits)
    try:
        yield ZenohLink(session)
    finally:
        session.close()  # type: ignore[no-untyped-call]


def policy_for(host: str, port: int, token: str) -> AccessPolicy:
    """The address, and the token; without one that of this user, on this machine alone.

    Raises ``RefseqError`` for an address that other machines reach without a token.
    """
    if token or not is_loopback(host):
        return AccessPolicy(host, port, token)
    path = Path.home() / TOKEN_FILE
    try:
        return AccessPolicy(host, port, _own_token(path))
    except OSError as error:
        raise RefseqError(f"{path}: {os.strerror(error.errno or 0)}; valid is to give a token: --token") from error


def _own_token(path: Path) -> str:
    """The token that lies in a file; the first to ask puts it there, whole or not at all."""
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile("w", dir=path.parent) as draft:  # nobody else may read it
            draft.write(random_token())
            draft.flush()
            with suppress(FileExistsError):
                os.link(draft.name, path)
    return path.read_text().strip()


def _listening(zenoh: Any, policy: AccessPolicy) -> Any:
    with tempfile.TemporaryDirectory() as folder:
        known = Path(folder) / "users"
        with os.fdopen(os.open(known, os.O_WRONLY | os.O_CREAT, 0o600), "w") as file:
            file.write(f"{USER}:{policy.token}\n")
        told: dict[str, Any] = {"mode": "router", "listen/endpoints": [_endpoint(policy)]}
        told["transport/auth/usrpwd/dictionary_file"] = str(known)
        config = _config(zenoh, policy, told)
        try:
            return zenoh.open(config)
        except zenoh.ZError as error:
            raise RefseqError(
                f"{policy.host} port {policy.port}: cannot be listened at; valid is a free port of an address of this "
                f"machine ({str(error)[:100].splitlines()[0]})"
            ) from error


def _connected(zenoh: Any, policy: AccessPolicy, waits: Callable[[str], None]) -> Any:
    again = round(1000 * AGAIN)
    told = {
        "mode": "client",
        "connect/endpoints": [_endpoint(policy)],
        "connect/timeout_ms": 1000,
        "connect/exit_on_failure": True,
        "connect/retry": {"period_init_ms": again, "period_max_ms": again, "period_increase_factor": 1},
    }
    waited = False
    while True:
        config = _config(zenoh, policy, told)
        try:
            return zenoh.open(config)
        except zenoh.ZError:
            if not waited:
                waits(f"waits for the robot at {policy.host} port {policy.port}: nobody there, or another token")
            waited = True
            time.sleep(AGAIN)


def _endpoint(policy: AccessPolicy) -> str:
    return f"tcp/{policy.authority(policy.port)}"


def _config(zenoh: Any, policy: AccessPolicy, told: dict[str, Any]) -> Any:
    config = zenoh.Config()
    every = {
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "timestamping/enabled": True,
        "transport/link/tx/lease": round(1000 * LEASE),
        "transport/link/tx/keep_alive": SIGNS,
        "transport/auth/usrpwd/user": USER,
        "transport/auth/usrpwd/password": policy.token,
    }
    for key, value in {**every, **told}.items():
        config.insert_json5(key, json.dumps(value))
    return config
