import errno
import os
import select
import socket
import struct
import threading
import tty
from collections.abc import Iterator
from types import SimpleNamespace

import numpy as np
import pytest

from refseq.access.policy import LOOPBACK
from refseq_bench import robots
from refseq_bench.robots import Cause, Motors
from refseq_bench.robots.robuter.line import CAPACITY, SerialLine
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.control_period import CONTROL_PERIOD
from refseq_bench.sim.bench.serial_port import (
    SerialPort,
    TcpOutlet,
    TerminalOutlet,
    open_port,
    serve,
)
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.realtime import RealTimePacer
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.worlds.build import World, build_world
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.plans.load import parse_plan
from tests.terminals import needs_terminals
from tests.worlds.conftest import SMALL

AT_ONCE = RealTimePacer(1e6)


@pytest.fixture(scope="module")
def corridor() -> World:
    return build_world(parse_plan(SMALL.format(top="", end="")), light_named("16:00"), pictured=False)


@pytest.fixture
def bench(corridor: World) -> Iterator[Bench]:
    with Bench(corridor, robots.load("robuter"), settings=BenchSettings(renderer=RendererKind.NONE)) as bench:
        yield bench


class Client:
    """A program outside: it knows an address and writes and reads bytes there."""

    def __init__(self, address: str) -> None:
        if address.startswith(LOOPBACK):
            self._socket = socket.create_connection((LOOPBACK, int(address.rpartition(":")[2])), timeout=10.0)
            self.fd = self._socket.fileno()
        else:
            self.fd = os.open(address, os.O_RDWR | os.O_NOCTTY)
        self._rest = b""

    def write(self, text: str) -> None:
        os.write(self.fd, text.encode())

    def lines(self, count: int) -> list[str]:
        """The next lines; fails when they do not come."""
        while self._rest.count(b"\n") < count:
            ready, _, _ = select.select([self.fd], [], [], 10.0)
            assert ready, f"only {self._rest!r} came"
            more = os.read(self.fd, 4096)
            assert more, "hung up"
            self._rest += more
        *lines, self._rest = self._rest.split(b"\n", count)
        return [line.decode("ascii") for line in lines]

    def leave(self) -> None:
        if hasattr(self, "_socket"):
            self._socket.close()
        else:
            os.close(self.fd)


@pytest.fixture(params=["127.0.0.1:0", pytest.param("pty", marks=needs_terminals)])
def port(bench: Bench, request: pytest.FixtureRequest) -> Iterator[SerialPort]:
    with open_port(bench, request.param) as port:
        yield port


def drive(bench: Bench, port: SerialPort, client: Client, command: str, seconds: float) -> None:
    for _ in range(round(seconds / 0.2)):
        client.write(command + "\n")
        serve(bench, port, 0.2, AT_ONCE)
        assert client.lines(1) == ["ack"]


def test_a_program_outside_drives_the_robot(bench: Bench, port: SerialPort) -> None:
    client = Client(port.address)
    start = bench.pose.x
    drive(bench, port, client, "AM 300 300", 3.0)
    assert bench.pose.x - start == pytest.approx(0.3 * (3.0 - 0.3), abs=0.05)
    client.write("ST\r\nhello\nSERV OFF\nST\n")
    serve(bench, port, 0.2, AT_ONCE)
    state, nak, ack, em, locked = client.lines(5)
    assert state.startswith("st 3000 ")
    assert state.split()[6:9] == ["ON", "-", "0"]
    assert nak.startswith("nak unknown line 'hello'")
    assert ack == "ack"
    assert em.startswith("em emergency-stop 3000 all")
    assert locked.split()[6:9] == ["OFF", "-", "1"]
    assert bench.state.motors is Motors.LOCKED, "the program on the robot's computer hears of it over its own line"
    client.leave()


def test_a_client_that_goes_away_leaves_a_silent_line_and_another_may_come(bench: Bench, port: SerialPort) -> None:
    first = Client(port.address)
    drive(bench, port, first, "AM 300 300", 2.0)
    first.write("AM 300 3")
    first.leave()
    serve(bench, port, 2.0, AT_ONCE)
    assert {stop.cause for stop in bench.state.stops} == {Cause.NO_COMMAND}
    assert abs(bench.data.joint("robuter/base").qvel[0]) < 1e-3
    second = Client(port.address)
    drive(bench, port, second, "AM 200 200", 1.0)
    assert bench.data.joint("robuter/base").qvel[0] == pytest.approx(0.2, abs=0.01)
    second.leave()


@pytest.mark.parametrize(
    "said",
    [
        "POST / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\nAM 300 300\nAM 300 300\n",
        "GET /" + "a" * 600 + " HTTP/1.1\r\n\r\nAM 300 300\n",
        "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\nAM 300 300\n",
        "\x16\x03\x01\nAM 300 300\n",
    ],
)
def test_a_web_page_does_not_drive_the_robot(bench: Bench, said: str) -> None:
    with open_port(bench, "127.0.0.1:0") as port:
        page, start = Client(port.address), bench.pose.x
        for piece in (said[:7], said[7:]):
            page.write(piece)
            serve(bench, port, 0.2, AT_ONCE)
        assert bench.pose.x == pytest.approx(start, abs=1e-3)
        with pytest.raises((AssertionError, OSError)):
            page.lines(1)
        page.leave()
        other = Client(port.address)
        drive(bench, port, other, "AM 300 300", 1.0)
        other.leave()


def test_without_a_client_time_goes_on(bench: Bench, port: SerialPort) -> None:
    serve(bench, port, 1.0, AT_ONCE)
    assert bench.time == pytest.approx(1.0)


def test_a_client_that_does_not_read_holds_nobody_up(bench: Bench, port: SerialPort) -> None:
    client = Client(port.address)
    for _ in range(100):
        client.write("ST\n" * 10)
        serve(bench, port, CONTROL_PERIOD, AT_ONCE)
    assert bench.time == pytest.approx(100 * CONTROL_PERIOD)
    client.leave()


def test_it_serves_a_program_that_runs_at_the_same_time(bench: Bench) -> None:
    """A client in a thread, which waits for each answer before it goes on."""
    heard: list[str] = []
    done = threading.Event()

    def program(address: str) -> None:
        client = Client(address)
        for _ in range(20):
            client.write("AM 200 200\n")
            heard.extend(client.lines(1))
        client.leave()
        done.set()

    with open_port(bench, "127.0.0.1:0") as port:
        thread = threading.Thread(target=program, args=(port.address,))
        thread.start()
        while not done.is_set() and bench.time < 3000.0:
            serve(bench, port, CONTROL_PERIOD, AT_ONCE)
        thread.join(30.0)
    assert heard == ["ack"] * 20


def test_one_client_at_a_time() -> None:
    line = SerialLine()
    with SerialPort(line, TcpOutlet()) as port:
        first = Client(port.address)
        port.carry()
        second = Client(port.address)
        port.carry()
        assert second.lines(1) == ["nak the line is taken by another client"]
        assert os.read(second.fd, 10) == b"", "and it is hung up"
        first.write("ST\n")
        while not (taken := line.to_robot.take()):
            port.carry()
        assert taken == b"ST\n"
        first.leave()
        second.leave()


def test_a_client_that_is_gone_before_it_is_refused_harms_nobody() -> None:
    line = SerialLine()
    with SerialPort(line, TcpOutlet()) as port:
        first = Client(port.address)
        port.carry()
        host, _, number = port.address.rpartition(":")
        for _ in range(5):
            second = socket.create_connection((host, int(number)))
            second.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))  # its end is a reset
            second.close()
            port.carry()
        first.write("ST\n")
        while not (taken := line.to_robot.take()):
            port.carry()
        assert taken == b"ST\n"
        first.leave()


@needs_terminals
def test_a_terminal_passes_every_byte_as_it_is() -> None:
    line = SerialLine()
    every = bytes(range(256))
    with SerialPort(line, TerminalOutlet()) as port:
        client = os.open(port.address, os.O_RDWR | os.O_NOCTTY)
        os.write(client, every)
        port.carry()
        assert line.to_robot.take() == every
        line.to_host.put(every)
        port.carry()
        assert os.read(client, 1000) == every
        port.carry()
        assert line.to_robot.take() == b"", "no echo"
        assert not tty.tcgetattr(client)[3] & (tty.ECHO | tty.ICANON)
        os.close(client)


def test_what_nobody_fetches_is_lost_and_takes_no_room() -> None:
    line = SerialLine()
    with SerialPort(line, TcpOutlet()) as port:
        for _ in range(10):
            line.to_host.put(b"x" * CAPACITY)
            port.carry()
            assert line.to_host.take() == b""


@pytest.mark.parametrize(
    ("address", "message"),
    [
        ("0.0.0.0:4001", "serial port: host '0.0.0.0' is not served: valid is 127.0.0.1, this machine only"),
        ("192.168.1.2:80", "serial port: host '192.168.1.2' is not served: valid is 127.0.0.1, this machine only"),
        ("localhost:80", "serial port: host 'localhost' is not served: valid is 127.0.0.1, this machine only"),
        ("::1:80", "serial port: host '::1' is not served: valid is 127.0.0.1, this machine only"),
        ("127.0.0.1:70000", "serial port: TCP port 70000 does not exist: valid is 0 to 65535, 0 for any that is free"),
        ("127.0.0.1", "serial port: address '127.0.0.1' is not known: valid are pty and 127.0.0.1:PORT"),
        ("127.0.0.1:x", "serial port: address '127.0.0.1:x' is not known: valid are pty and 127.0.0.1:PORT"),
        ("127.0.0.1:٣", "serial port: address '127.0.0.1:٣' is not known: valid are pty and 127.0.0.1:PORT"),
        (":80", "serial port: address ':80' is not known: valid are pty and 127.0.0.1:PORT"),
        ("", "serial port: address '' is not known: valid are pty and 127.0.0.1:PORT"),
    ],
)
def test_any_other_address_is_refused_in_one_line(bench: Bench, address: str, message: str) -> None:
    with pytest.raises(SimError) as error:
        open_port(bench, address)
    assert str(error.value) == message


def test_a_port_that_is_taken_is_told() -> None:
    with SerialPort(SerialLine(), TcpOutlet()) as port:
        number = int(port.address.rpartition(":")[2])
        with pytest.raises(SimError, match=rf"^serial port: 127\.0\.0\.1:{number} cannot be opened: .+$"):
            TcpOutlet(port=number)


def test_only_this_machine_can_reach_it() -> None:
    outlet = TcpOutlet()
    assert outlet._server.getsockname()[0] == LOOPBACK
    outlet.close()


def test_a_system_without_pseudo_terminals_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(_: int) -> str:
        raise OSError(errno.ENODEV, "No such device")

    monkeypatch.setattr(os, "ttyname", missing)
    wanted = "serial port: no pseudo-terminal (No such device: is /dev/pts mounted?): valid is 127.0.0.1:PORT"
    with pytest.raises(SimError) as told:
        TerminalOutlet()
    assert str(told.value) == wanted


def test_a_robot_without_a_line_is_told() -> None:
    other = SimpleNamespace(control=object(), robot=SimpleNamespace(name="segway_rmp"))
    with pytest.raises(SimError, match=r"^serial port: robot 'segway_rmp' has no serial line: valid is robuter$"):
        open_port(other, "pty")  # type: ignore[arg-type]


class Clock:
    """A wall clock on which everything takes a while and sleep takes as long as it says."""

    def __init__(self) -> None:
        self.now, self.slept = 100.0, 0.0

    def __call__(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.slept += seconds
        self.now += seconds


@pytest.mark.parametrize("factor", [0.5, 1.0, 4.0])
@pytest.mark.parametrize("began", [0.0, 37.0])
def test_simulated_time_is_held_back_to_its_share_of_wall_time(factor: float, began: float) -> None:
    """From the first time that is told on: the pacer of a robot that has driven before waits for none of that."""
    clock = Clock()
    pace = RealTimePacer(factor, clock, clock.sleep)
    pace.keep(began)
    assert clock.slept == 0.0
    for step in np.arange(1, 101) * 0.04:
        clock.now += 0.001  # what the simulation takes
        pace.keep(began + float(step))
    assert clock.now - 100.0 == pytest.approx(4.0 / factor)


def test_a_simulation_that_is_too_slow_is_not_held_back() -> None:
    clock = Clock()
    pace = RealTimePacer(1.0, clock, clock.sleep)
    pace.keep(0.0)
    clock.now += 10.0
    pace.keep(4.0)
    assert clock.slept == 0.0
