"""A user's localiser against the bench that asks it: it dies, hangs, hoards, forks, lies, spies and breaks out."""

import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr
from io import StringIO
from pathlib import Path
from unittest import SkipTest

import numpy as np

from refseq.planar import Pose
from refseq.view import Scan, View
from refseq_bench.scenarios.methods.guests.confinement import holds
from refseq_bench.scenarios.methods.guests.limits import SETTING
from refseq_bench.scenarios.methods.guests.wire import Incoming, WireError, belief_of
from refseq_bench.scenarios.methods.plugin_answers import NoAnswerError, checked
from refseq_bench.scenarios.methods.plugins import MisbehavedError, PluginLocaliser
from tests.robustness.attack import Attempt, attack

TRUTH, WORLD = 1234.56789, "secret-garden-at-dusk"
"""Texts that a guest must never find: the coordinate of a true pose, and the name of a world."""
PLACES, VIEWS = 3, 2
LOCALISER = """
import ctypes, gc, mmap, os, signal, socket, subprocess, sys, threading, time
import numpy as np
from pathlib import Path
from refseq.belief import Belief, belief_from
BENCH, HERE = {bench}, {here!r}

def told(name, call):
    try:
        found = call()
    except BaseException as error:
        return
    if found or found is None:
        print("FELL", name, repr(found)[:80])

{top}
class Mine:
    def __init__(self, views):
        self.views, self.n = views, 0
        {learn}
    def reset(self):
        {reset}
    def update(self, view):
        self.n += 1
        {update}
        return belief_from(np.ones(len(self.views)))
"""


def views(count: int) -> list[View]:
    """Views with true poses that would betray themselves."""
    rng = np.random.default_rng(0)
    return [
        View(
            float(k),
            {"forward": rng.integers(0, 255, (24, 32), np.uint8)},
            Scan(rng.uniform(0.5, 9, 36).astype(np.float32)),
            truth=Pose(TRUTH, TRUTH, 0.0),
        )
        for k in range(count)
    ]


def write_localiser(folder: Path, **parts: str) -> None:
    """A localiser with code of the attack's at the ``top``, on ``learn``, ``reset`` or ``update``."""
    filled = {**dict.fromkeys(("top", "learn", "reset", "update"), "pass"), **parts}
    (folder / "mine.py").write_text(LOCALISER.format(bench=os.getpid(), here=str(folder), **filled))


@contextmanager
def standing_in(folder: Path, limits: str) -> Iterator[None]:
    """Stand in a folder, under these limits, where the command would be typed."""
    before, path = Path.cwd(), list(sys.path)
    os.environ[SETTING] = limits
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)
        sys.path[:] = path
        del os.environ[SETTING]


def outcome(folder: Path, name: str = "mine:Mine", limits: str = "start=30,learn=5,view=5") -> tuple[str, str]:
    """The end of asking it, empty for well, and the last that it said."""
    with standing_in(folder, limits), redirect_stderr(StringIO()):
        try:
            localiser = PluginLocaliser(name, views(PLACES))
            try:
                localiser.reset()
                for view in views(VIEWS):
                    localiser.update(view)
                localiser.bytes_elsewhere()
            finally:
                localiser.close()
        except MisbehavedError as error:
            return str(error), error.said
        return "", localiser._guest.said.last


def judged(folder: Path, expected: str, within: float, **given: str) -> Attempt:
    """Survived where it ended as expected, in time, and nothing of it is left."""
    began = time.monotonic()
    told, _said = outcome(folder, **given)
    took = time.monotonic() - began
    figures = {"s until told": took}
    if not re.fullmatch(expected, told):
        return Attempt(f"told {told!r}, not {expected!r}", figures)
    if took > within:
        return Attempt(f"told after {took:.1f} s: {told}", figures)
    return Attempt(left_of(folder), figures)


def left_of(folder: Path) -> str | None:
    """A process or a folder of a guest's that is left."""
    for place in Path("/proc").glob("[0-9]*/environ"):
        try:
            if b"refseq-guest-" in place.read_bytes() and (place.parent / "stat").read_text().split()[3] == str(
                os.getpid()
            ):
                return f"process {place.parent.name} is left"
        except OSError:
            continue
    strange = {path.name for path in folder.iterdir()} - {"mine.py", "guest"}
    return f"in its folder: {sorted(strange)}" if strange else None


def need(*kept_from: str) -> None:
    """Skip where this machine has nothing that would keep a guest from these."""
    missing = [one.kept_from for one in holds() if one.kept_from in kept_from and not one.by]
    if missing:
        raise SkipTest(f"this kernel keeps no guest from {', '.join(missing)}")


STAGES = {
    "top": "being imported",
    "learn": "learning the reference drive",
    "reset": "reset",
    "update": r"view \d",
}
ENDS = {
    "os._exit(0)": "the localiser ended with code 0",
    "os._exit(7)": "the localiser ended with code 7",
    "os.kill(os.getpid(), signal.SIGKILL)": "the localiser was ended by SIGKILL",
    "os.kill(os.getpid(), 40)": "the localiser was ended by signal 40",  # a real-time one: it has no name
    "ctypes.string_at(0)": "the localiser was ended by SIGSEGV",
    "os.abort()": "the localiser was ended by SIGABRT",
    "os.closerange(3, 99) or time.sleep(99)": "the localiser closed its pipe",
    "raise KeyboardInterrupt('no')": "raised KeyboardInterrupt: no .*",
    "sys.exit(0)": "raised SystemExit: 0 .*",
    "os.execv('/bin/false', ['false'])": "the localiser ended with code 1",
}


@attack(
    family="guest",
    promise="A localiser that ends, at any stage and in any way, is told of at once in one line that says how",
    tries=72,
    short=1,
)
def guest_ends(seed: int, folder: Path) -> Attempt:
    """Every way at every stage, in turn."""
    rng = np.random.default_rng([seed, 8])
    stage, way = list(STAGES)[seed % len(STAGES)], list(ENDS)[(seed // len(STAGES)) % len(ENDS)]
    code = f"if self.n == {rng.integers(1, VIEWS + 1)}: {way}" if stage == "update" else way
    write_localiser(folder, **{stage: code})
    return judged(folder, f"mine:Mine, {STAGES[stage]}: {ENDS[way]}", 30.0)


@attack(
    family="guest",
    promise="A localiser that hangs is ended when the time of its stage is up",
    tries=8,
    short=1,
)
def guest_hangs(seed: int, folder: Path) -> Attempt:
    """Asleep, busy, or deaf to all signals that can be refused."""
    stage = list(STAGES)[(seed + 3) % len(STAGES)]
    deaf = "[signal.signal(s, signal.SIG_IGN) for s in range(1, 32) if s not in (9, 19)]"
    idle = ("pass", "time.sleep(9)")[seed // 4 % 2]
    write_localiser(folder, **{stage: f"{deaf}\n{'' if stage == 'top' else ' ' * 8}while True: {idle}"})
    expected = rf"mine:Mine, {STAGES[stage]}: did not answer within [\d.]+ s"
    return judged(folder, expected, 30.0, limits="start=8,learn=1,view=1")


MEMORY, THREADS, DISK = "took more than 1 GiB of memory", "began more than 256 threads", "wrote more than 1 GiB or .*"
LOOP = "n = 0\n        while True: n += 1; "
HOARDS = {
    "self.x = np.ones(50 * 2**27)": "raised (MemoryError|.*ArrayMemoryError).*",
    f"self.x = []; {LOOP}self.x.append(bytearray(2**24))": f"(raised MemoryError.*|{MEMORY})",
    f"m = mmap.mmap(-1, 4 * 2**30); {LOOP}m[4096 * n] = 1": f"(raised OSError: .*|{MEMORY})",
    f"threading.stack_size(2**16); {LOOP}threading.Thread(target=time.sleep, args=(99,)).start()": (
        f"(raised RuntimeError: can't start new thread.*|{THREADS})"
    ),
    f"{LOOP}open(f'f{{n}}', 'wb').write(bytes(2**25))": DISK,
    f"{LOOP}open(f'f{{n}}', 'wb').close()": DISK,
    "open('f', 'wb').write(bytes(2**27))": "(raised OSError: .*|the localiser was ended by SIGXFSZ)",
    "f = [open('/dev/null') for _ in range(999)]": "raised OSError: .*Too many open files.*",
    "assert ctypes.CDLL(None).shmget(0, ctypes.c_size_t(2**30), 0o1600) != -1": "raised AssertionError.*",
    "os.memfd_create('x')": "raised PermissionError.*",
    f"{LOOP}os.makedirs('d/' * 9); os.chdir('d/' * 9)": "(hid what it wrote: .*|wrote more than .*)",
    "m = mmap.mmap(-1, 4 * 2**30); fill = lambda: [m.write(bytes(2**20)) for _ in range(4096)]\n"
    "        threading.Thread(target=fill).start(); ctypes.CDLL(None).syscall(60, 0)": f"({MEMORY}|raised OSError: .*)",
}


@attack(
    family="guest",
    promise="A localiser gets no more memory, threads, files and disk than its limits, whichever way it asks",
    tries=18,
    short=1,
)
def guest_hoards(seed: int, folder: Path) -> Attempt:
    """50 GB at once, piece by piece, shared; threads, files, disk."""
    need("child processes")
    greed = list(HOARDS)[seed % len(HOARDS)]
    write_localiser(folder, update=greed)
    limits = "start=30,learn=5,view=30,memory=1"
    return judged(folder, f"mine:Mine, view 0: {HOARDS[greed]}", 60.0, limits=limits)


FORKS = (
    "while True: os.fork()",
    "os.fork() or (os.setsid(), os.fork(), time.sleep(99))",
    "subprocess.Popen(['sleep', '99'], start_new_session=True)",
    "os.posix_spawn('/bin/sleep', ['sleep', '99'], {})",
    "ctypes.CDLL(None).clone(None, None, 17) > 0 or os.fork()",
    "__import__('multiprocessing').Process(target=time.sleep, args=(99,)).start()",
)


@attack(
    family="guest",
    promise="A localiser starts no other process: no fork bomb, nothing is left behind",
    tries=12,
    short=1,
)
def guest_forks(seed: int, folder: Path) -> Attempt:
    """Fork bombs and daemons."""
    need("child processes")
    write_localiser(folder, reset=FORKS[seed % len(FORKS)])
    return judged(folder, r"mine:Mine, reset: raised (PermissionError|BlockingIOError).*", 30.0)


def falls_told(folder: Path, **parts: str) -> Attempt:
    """Survived where the localiser answers, and has found nothing of which it could say that it fell."""
    write_localiser(folder, **parts)
    began = time.monotonic()
    told, said = outcome(folder)
    lines = [line for line in said.splitlines() if line.startswith("FELL")]
    fell = told or "; ".join(lines) or (None if "DONE" in said else f"said {said[-200:]!r}")
    return Attempt(fell or left_of(folder), {"s until told": time.monotonic() - began})


SPY = '''
def in_memory(numbers):
    """The bytes in this process's memory, looked for one by one, so that the search does not find itself."""
    for line in open("/proc/self/maps"):
        place, rights, *_, last = line.split()
        if "r" not in rights or last in ("[vvar]", "[vsyscall]", "[vvar_vclock]"): continue
        low, high = (int(x, 16) for x in place.split("-"))
        with open("/proc/self/mem", "rb", 0) as memory:
            memory.seek(low)
            try: found = np.frombuffer(memory.read(high - low), np.uint8)
            except OSError: continue
        at = np.flatnonzero(found[: len(found) - len(numbers) + 1] == numbers[0] ^ 255)
        for k, number in enumerate(numbers):
            at = at[found[at + k] == number ^ 255]
        if len(at): return True
    return False

def spy():
    told("gc", lambda: [x for x in gc.get_objects() if type(x).__name__ == "Pose"])
    told("truth in memory", lambda: in_memory({truth}))
    told("world in memory", lambda: in_memory({world}))
    for name in ("mem", "maps", "environ", "cmdline", "cwd/mine.py", "root/etc/passwd", "status"):
        told(f"/proc/PPID/{{name}}", lambda: open(f"/proc/{{BENCH}}/{{name}}", "rb").read(9))
    told("/proc/PPID/fd", lambda: os.listdir(f"/proc/{{BENCH}}/fd"))
    told("/proc", lambda: os.listdir("/proc"))
    told("recording", lambda: open(HERE + "/guest/recording.mcap", "rb").read())
    told("recording by a link", lambda: os.symlink(HERE + "/guest/recording.mcap", "link") or open("link", "rb").read())
    told("recording by a hard link", lambda: os.link(HERE + "/guest/recording.mcap", "hard") or open("hard").read())
    told("list", lambda: os.listdir(HERE + "/guest") + os.listdir(HERE))
    told("home", lambda: os.listdir({home!r}))
    told("shadow", lambda: open("/etc/shadow").read() + open("/etc/passwd").read())
    told("shm, tmp", lambda: os.listdir("/tmp") + os.listdir("/dev/shm"))
    told("argv", lambda: [x for x in sys.argv + list(os.environ.values()) if HERE in x])
    told("ptrace", lambda: ctypes.CDLL(None).ptrace(0x4206, BENCH, 0, 0) == 0)
    told("process_vm_readv", lambda: ctypes.CDLL(None).process_vm_readv(BENCH, None, 0, None, 0, 0) == 0)
    told("pidfd", lambda: os.pidfd_open(BENCH))
    told("open_by_handle_at", lambda: ctypes.CDLL(None).open_by_handle_at(-100, bytes(64), 0) >= 0)
    print("DONE")
'''


@attack(
    family="guest",
    promise="A localiser finds neither truth nor the world's name in memory, /proc, files, arguments or environment",
    tries=5,
    short=1,
)
def guest_spies(seed: int, folder: Path) -> Attempt:
    """Its own memory byte by byte, the bench's by every door, and the file system."""
    need("files", "other processes")
    (folder / "guest").mkdir()
    (folder / "guest/recording.mcap").write_bytes(np.float64(TRUTH).tobytes() + WORLD.encode())
    spy = SPY.format(
        truth=[byte ^ 255 for byte in np.float64(TRUTH).tobytes()],
        world=[byte ^ 255 for byte in WORLD.encode()],
        home=str(Path.home()),
    )
    return falls_told(folder, top=spy, update="self.n == 2 and spy()")


WRECK = """
def wreck():
    home, code = {home!r}, __file__
    for path in (HERE + "/guest/cache.parquet", HERE + "/guest/new", home + "/.refseq-was-here", "/tmp/refseq-was-here",
                 "/dev/shm/refseq-was-here", np.__file__, sys.executable, "/var/tmp/refseq-was-here",
                 os.path.realpath(code), code, "../order.json", sys.prefix + "/refseq-was-here"):
        told(f"write {{path}}", lambda: open(path, "ab").write(b"x"))
        told(f"truncate {{path}}", lambda: os.truncate(path, 0))
    told("remove", lambda: os.remove(HERE + "/guest/cache.parquet"))
    told("rename", lambda: os.rename(HERE + "/guest", HERE + "/gone"))
    told("mkdir", lambda: os.mkdir(HERE + "/made"))
    told("link out", lambda: os.symlink("x", HERE + "/guest/link"))
    for path in (HERE, HERE + "/guest", HERE + "/guest/cache.parquet", os.path.realpath(code), np.__file__):
        told(f"chmod {{path}}", lambda: os.chmod(path, 0))
        told(f"chown {{path}}", lambda: os.chown(path, os.getuid(), -1))
        told(f"utime {{path}}", lambda: os.utime(path))
        told(f"xattr {{path}}", lambda: os.setxattr(path, "user.was", b"here"))
    told("fchmod", lambda: os.fchmod(os.open(np.__file__, os.O_RDONLY), 0))
    told("inotify", lambda: ctypes.CDLL(None).inotify_init1(0) >= 0)
    told("mount", lambda: ctypes.CDLL(None).mount(b"none", b"/mnt", b"tmpfs", 0, None) == 0)
    told("unshare", lambda: ctypes.CDLL(None).unshare(0x10000000) == 0)
    told("own folder", lambda: False if open("note", "w").write("x") else True)
    print("DONE")
"""


@attack(
    family="guest",
    promise="A localiser writes into its own folder only, which is removed: to no cache, recording, code or package",
    tries=5,
    short=1,
)
def guest_wrecks(seed: int, folder: Path) -> Attempt:
    """Writes, truncates, removes, renames and links."""
    need("files")
    (folder / "guest").mkdir()
    (folder / "guest/cache.parquet").write_bytes(b"answers")
    attempt = falls_told(folder, top=WRECK.format(home=str(Path.home())), update="self.n == 2 and wreck()")
    if (folder / "guest/cache.parquet").read_bytes() != b"answers":
        return Attempt("the cache was written to")
    return attempt


CALL = """
def call():
    families = [getattr(socket, name) for name in dir(socket) if name.startswith("AF_")]
    for family in families:
        for kind in (socket.SOCK_STREAM, socket.SOCK_DGRAM, socket.SOCK_RAW):
            told(f"socket {{family}} {{kind}}", lambda: socket.socket(family, kind))
    told("connect", lambda: socket.create_connection(("127.0.0.1", {port})))
    told("name", lambda: socket.getaddrinfo("example.org", 80))
    told("io_uring", lambda: ctypes.CDLL(None).syscall(425, 8, bytes(120)) >= 0)
    told("x32", lambda: ctypes.CDLL(None).syscall(0x40000000 + 41, 2, 1, 0) >= 0)
    told("socketpair", lambda: False if socket.socketpair() else True)
    print("DONE")
"""


@attack(
    family="guest",
    promise="A localiser opens no socket of any kind",
    tries=3,
    short=1,
)
def guest_calls_out(seed: int, folder: Path) -> Attempt:
    """Every family and type of socket, to a server that listens."""
    need("network")
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        return falls_told(folder, top=CALL.format(port=port), update="self.n == 2 and call()")


KILL = """
def kill():
    library = ctypes.CDLL(None)
    for number in (0, 1, 15, 9):
        told(f"kill {number}", lambda: os.kill(BENCH, number))
        told(f"kill all {number}", lambda: os.kill(-1, number))
        told(f"killpg {number}", lambda: os.killpg(os.getpgid(BENCH), number))
        told(f"tgkill {number}", lambda: library.syscall(234, BENCH, BENCH, number) == 0)
        told(f"tkill {number}", lambda: library.syscall(200, BENCH, number) == 0)
        told(f"sigqueue {number}", lambda: library.sigqueue(BENCH, number, None) == 0)
    import fcntl, resource
    told("prlimit", lambda: resource.prlimit(BENCH, resource.RLIMIT_CPU, (0, 0)))
    told("nice", lambda: os.setpriority(os.PRIO_PROCESS, BENCH, 19))
    told("affinity", lambda: os.sched_setaffinity(BENCH, [0]))
    told("scheduler", lambda: os.sched_setscheduler(BENCH, os.SCHED_IDLE, os.sched_param(0)))
    told("owner", lambda: fcntl.fcntl(os.pipe()[0], fcntl.F_SETOWN, BENCH))
    print("DONE")
"""


@attack(
    family="guest",
    promise="A localiser sends no signal to the bench or anyone, and changes no other process's limits, cores or rank",
    tries=3,
    short=1,
)
def guest_kills(seed: int, folder: Path) -> Attempt:
    """Every call that reaches another process."""
    need("other processes")
    return falls_told(folder, top=KILL, update="self.n == 2 and kill()")


FLOODS = (
    ("while True: print('x' * 9999)", r"did not answer within [\d.]+ s"),
    ("while True: os.write(2, b'\\x1b[31m' * 9999)", r"did not answer within [\d.]+ s"),
    ("[told('', lambda: os.write(k, bytes(2**20))) for k in range(3, 9)]", "(sent|answered|announced) .*"),
    ("for _ in range(3000): print('y' * 9999)", ""),
    ("raise ValueError('z' * 10**8)", "raised ValueError: z{1,1000}.*"),
)


@attack(
    family="guest",
    promise="A localiser that prints without end, or into the protocol, costs neither memory nor more than its time",
    tries=10,
    short=1,
)
def guest_floods(seed: int, folder: Path) -> Attempt:
    """On either stream, and into the pipe of the protocol."""
    flood, expected = FLOODS[seed % len(FLOODS)]
    write_localiser(folder, update=flood)
    before = resident()
    expected = f"mine:Mine, view 0: {expected}" if expected else ""
    attempt = judged(folder, expected, 60.0, limits=f"start=30,view={(2, 2, 9, 9, 20)[seed % 5]}")
    grown = (resident() - before) / 2**20
    return Attempt(attempt.fell or (f"grew by {grown:.0f} MiB" if grown > 50 else None), attempt.figures)


def resident() -> int:
    """Memory of this process [bytes]."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


PROGRAM = """#!{python} -S
import os, sys
def read(n):
    got = b""
    while len(got) < n: got += os.read(0, n - len(got)) or sys.exit(0)
    return got
def say(header, payload=b""):
    os.write(1, len(header).to_bytes(4, "little") + len(payload).to_bytes(4, "little") + header + payload)
asked = 0
while True:
    lengths = read(8)
    header = read(int.from_bytes(lengths[:4], "little")); read(int.from_bytes(lengths[4:], "little"))
    if b'"learn"' in header[:20]: continue
    if asked == {stage}:
        for part in {garbage!r}: os.write(1, part)
    asked += 1
    if b'"hello"' in header[:20]: say(b'{{"type":"hello","protocol":1}}')
    elif b'"localise"' in header[:20]: say(b'{{"type":"belief","places":"float32"}}', b"\\0\\0\\x80?" + bytes(8))
    else: say(b'{{"type":"ok"}}')
"""


def garbage(rng: np.random.Generator) -> list[bytes]:
    """An answer that is none: of random bytes, with wrong lengths, or of a wrong form."""

    def framed(header: bytes, payload: bytes = b"") -> bytes:
        return len(header).to_bytes(4, "little") + len(payload).to_bytes(4, "little") + header + payload

    number = ("nan", "inf", "-1", "1e999", "null", '"x"', "[]", "{}", "9" * 5000, "true")[rng.integers(10)]
    field = ("lost", "best", "entropy", "path", "timings", "places")[rng.integers(6)]
    good = b'{"type":"belief","places":"float32"}'
    forms = (
        rng.bytes(int(rng.integers(1, 300))),
        b"\xff" * 8,
        (10).to_bytes(4, "little") + (2**30).to_bytes(4, "little") + b"x" * 99,
        framed(b"[" * 100_000),
        framed(b'{"type":"belief","places":"float32"', bytes(12)),
        framed(good, np.full(3, np.nan, "<f4").tobytes()),
        framed(good, np.array([2, -1, 0], "<f4").tobytes()),
        framed(good, bytes(int(rng.integers(0, 30)))),
        framed(f'{{"type":"belief","places":"float32","{field}":{number}}}'.encode(), b"\0\0\x80?" + bytes(8)),
        framed(b'{"type":"error","reason":"' + b"\\u001b[2J" * 3000 + b'"}'),
        framed(b'{"type":"nonsense"}'),
    )
    return [forms[rng.integers(len(forms))]]


@attack(
    family="guest",
    promise="A program that answers garbage is told of in one line; nothing that it announces is allocated",
    tries=400,
    short=2,
)
def guest_answers_garbage(seed: int, folder: Path) -> Attempt:
    """Random bytes, gigabyte lengths, deep JSON, no probabilities, at any stage."""
    need("files")
    rng = np.random.default_rng([seed, 80])
    program = folder / "guest"
    program.write_text(PROGRAM.format(python=sys.executable, stage=int(rng.integers(0, 4)), garbage=garbage(rng)))
    program.chmod(0o755)
    before = resident()
    began = time.monotonic()
    told, _ = outcome(folder, "./guest", "start=9,learn=1,view=1")
    took = time.monotonic() - began
    grown = (resident() - before) / 2**20
    if "\n" in told or "\x1b" in told or len(told) > 1200:
        return Attempt(f"told {told!r:.300}")
    if not told.startswith("./guest, "):
        return Attempt(f"was believed: {told!r}")
    return Attempt(f"grew by {grown:.0f} MiB" if grown > 50 else left_of(folder), {"s until told": took})


@attack(
    family="guest",
    promise="Any bytes for an answer are a belief that is checked, or refused by an error of ours",
    tries=10_000,
    short=300,
)
def guest_bytes(seed: int, folder: Path) -> str | None:
    """Structured garbage and damaged good answers, read as the bench reads them."""
    rng = np.random.default_rng([seed, 81])
    (data,) = garbage(rng)
    damaged = bytearray(data)
    for at in rng.integers(0, len(damaged), rng.integers(0, 4)):
        damaged[at] = rng.integers(256)
    (folder / "bytes").write_bytes(damaged)
    incoming, left = Incoming(8 * PLACES), memoryview(bytes(damaged))
    try:
        while incoming.missing and left:
            piece, left = left[: incoming.missing], left[incoming.missing :]
            incoming.take(bytes(piece))
        if incoming.missing:
            return None  # the bench waits for the rest until time is up
        belief = checked(belief_of(incoming.message, PLACES), PLACES, 0.0)
    except (WireError, NoAnswerError):
        return None
    right = np.isfinite(belief.places).all() and abs(belief.places.sum() - 1) < 1e-4 and 0 <= belief.lost <= 1
    return None if right and 0 <= belief.best < PLACES else f"was taken for {belief}"


BENCH = """
import sys, time
sys.path[:] = {path!r}
from tests.robustness.attacks.guest import views
from refseq_bench.scenarios.methods.plugins import PluginLocaliser
localiser = PluginLocaliser("mine:Mine", views(3))
print(localiser._guest._process.pid, flush=True)
localiser.reset()
for view in views(1000): localiser.update(view)
"""


@attack(
    family="guest",
    promise="A localiser ends with the bench within 2 s, however that ends, even if it hangs",
    tries=30,
    short=1,
)
def guest_outlives(seed: int, folder: Path) -> Attempt:
    """The bench is killed while the guest answers, sleeps or is busy."""
    rng = np.random.default_rng([seed, 82])
    ways = ("time.sleep(0.01)", "time.sleep(99)", "while True: pass", "ctypes.CDLL(None).prctl(1, 0); time.sleep(99)")
    write_localiser(folder, update=ways[seed % 4])
    bench = subprocess.Popen(
        [sys.executable, "-c", BENCH.format(path=[entry or str(Path.cwd()) for entry in sys.path])],
        cwd=folder,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert bench.stdout is not None
    guest = int(bench.stdout.readline())
    time.sleep(rng.uniform(0, 0.5))
    bench.send_signal((signal.SIGKILL, signal.SIGTERM, signal.SIGINT)[seed // 4 % 3] if seed else signal.SIGKILL)
    bench.wait()
    bench.stdout.close()
    began = time.monotonic()
    while alive(guest) and time.monotonic() - began < 10:
        time.sleep(0.01)
    took = time.monotonic() - began
    if alive(guest):
        os.kill(guest, signal.SIGKILL)
    return Attempt(f"lived on for {took:.1f} s" if took > 2 else None, {"s lived on": took})


def alive(pid: int) -> bool:
    """True of a process that has not ended."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
