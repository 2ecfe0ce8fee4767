"""Real loopback sockets and a pseudo terminal; waiting is always on the socket, with a deadline."""

import os
import pty
import select
import socket
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, closing
from itertools import pairwise

import pytest

from companion.edges.mavlink import MavlinkLink
from companion.edges.tcp import TcpCaller, TcpListener
from companion.edges.udp import UdpListener
from companion.edges.upkeep import FIRST_PAUSE_S, LONGEST_PAUSE_S, Upkeep
from companion.errors import ConfigError, LinkError

DEADLINE_S = 5.0
HOST = "127.0.0.1"


class FakeSeconds:
    """A clock that stands until it is moved."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def stack() -> Iterator[ExitStack]:
    with ExitStack() as stack:
        yield stack


def opened(stack: ExitStack, url: str) -> MavlinkLink:
    link = MavlinkLink.open(url)
    stack.callback(link.close)
    return link


def udp(stack: ExitStack, port: int = 0) -> socket.socket:
    sock = stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
    sock.bind((HOST, port))
    sock.settimeout(DEADLINE_S)
    return sock


def free_port(kind: socket.SocketKind = socket.SOCK_DGRAM) -> int:
    with socket.socket(socket.AF_INET, kind) as sock:
        sock.bind((HOST, 0))
        port: int = sock.getsockname()[1]
        return port


def arrived(link: MavlinkLink) -> list[bytes]:
    """Wait on the link, then read it."""
    assert select.select([link.fileno()], [], [], DEADLINE_S)[0]
    return link.receive()


def until(link: MavlinkLink, key: str, count: int) -> None:
    """Read the link whenever it can be read, until it has counted so much."""
    for _ in range(100):
        if link.counts[key] == count:
            return
        readable = [link.fileno()] if link.fileno() >= 0 else []
        select.select(readable, [], [], 0.05)
        link.receive()
    pytest.fail(f"{key} is {link.counts[key]}, not {count}")


# ---------------------------------------------------------------- UDP


def test_a_listener_hears_datagrams_and_answers_whom_it_heard(stack: ExitStack) -> None:
    port = free_port()
    link = opened(stack, f"udpin:{HOST}:{port}")
    assert link.receive() == []
    link.send(b"too early")
    assert link.counts["link.nobody_heard_yet"] == 1
    vehicle = udp(stack)
    vehicle.sendto(b"one", (HOST, port))
    vehicle.sendto(b"two", (HOST, port))
    heard = arrived(link)
    until(link, "link.received", 6)
    assert heard[0] == b"one"
    link.send(b"answer")
    assert vehicle.recv(100) == b"answer"
    assert link.state == "up"


def test_a_stray_datagram_does_not_take_the_answers_away(stack: ExitStack) -> None:
    port = free_port()
    link = opened(stack, f"udp://{HOST}:{port}")
    vehicle, stranger = udp(stack), udp(stack)
    vehicle.sendto(b"heartbeat", (HOST, port))
    arrived(link)
    stranger.sendto(b"noise", (HOST, port))
    arrived(link)
    link.send(b"setpoint")
    assert vehicle.recv(100) == b"setpoint"


def test_a_flood_from_many_ports_does_not_grow_the_list_of_peers(stack: ExitStack) -> None:
    with closing(UdpListener(HOST, 0, Counter())) as port:
        vehicle = udp(stack)
        for _ in range(30):
            for stranger in [udp(stack) for _ in range(5)]:
                stranger.sendto(b"x", port.address())
            vehicle.sendto(b"v", port.address())
            heard: list[bytes] = []
            while len(heard) < 6:
                assert select.select([port.fileno()], [], [], DEADLINE_S)[0]
                heard += port.receive()
        port.send(b"answer")
        assert vehicle.recv(100) == b"answer"
        assert len(port._peers) <= 8


def test_a_caller_survives_that_nobody_listens_and_goes_on_when_somebody_does(stack: ExitStack) -> None:
    port = free_port()
    link = opened(stack, f"udpout:{HOST}:{port}")
    for _ in range(5):
        link.send(b"hello?")
        assert link.receive() == []
    assert link.counts["link.refused"] > 0
    assert link.state == "up"
    vehicle = udp(stack, port)
    link.receive()
    link.send(b"hello!")
    data, peer = vehicle.recvfrom(100)
    assert data == b"hello!"
    vehicle.sendto(b"heartbeat", peer)
    assert arrived(link) == [b"heartbeat"]


def test_a_caller_hears_nobody_else(stack: ExitStack) -> None:
    vehicle, stranger = udp(stack), udp(stack)
    link = opened(stack, f"udpout:{HOST}:{vehicle.getsockname()[1]}")
    link.send(b"hello")
    _, peer = vehicle.recvfrom(100)
    stranger.sendto(b"noise", peer)
    vehicle.sendto(b"heartbeat", peer)
    assert arrived(link) == [b"heartbeat"]


def test_a_listener_goes_on_when_its_peer_is_gone(stack: ExitStack) -> None:
    port = free_port()
    link = opened(stack, f"udpin:{HOST}:{port}")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as vehicle:
        vehicle.sendto(b"heartbeat", (HOST, port))
        arrived(link)
    for _ in range(5):
        link.send(b"setpoint")
        assert link.receive() == []
    again = udp(stack)
    again.sendto(b"back", (HOST, port))
    assert arrived(link) == [b"back"]


# ---------------------------------------------------------------- TCP


def test_a_tcp_caller_sends_receives_and_calls_again_after_the_connection_was_lost(stack: ExitStack) -> None:
    server = stack.enter_context(socket.create_server((HOST, 0)))
    server.settimeout(DEADLINE_S)
    clock = FakeSeconds()
    counts: Counter[str] = Counter()
    link = MavlinkLink(TcpCaller(HOST, server.getsockname()[1], counts), counts, Upkeep(clock))
    stack.callback(link.close)
    vehicle, _ = server.accept()
    vehicle.settimeout(DEADLINE_S)
    vehicle.sendall(b"heartbeat")
    assert arrived(link) == [b"heartbeat"]
    link.send(b"setpoint")
    assert vehicle.recv(100) == b"setpoint"

    vehicle.close()
    until(link, "link.lost", 1)
    assert link.state.startswith("down: closed by the other side")
    assert link.fileno() == -1
    link.send(b"lost")
    assert link.receive() == []
    assert link.counts["link.send_dropped"] == 1

    clock.now_s += FIRST_PAUSE_S
    link.receive()  # calls again
    vehicle, _ = server.accept()
    stack.callback(vehicle.close)
    vehicle.sendall(b"back")
    until(link, "link.received", len(b"heartbeatback"))
    assert link.state == "up"
    assert link.counts["link.lost"] == 1


def test_a_refused_call_is_repeated_with_growing_pauses(stack: ExitStack) -> None:
    clock = FakeSeconds()
    counts: Counter[str] = Counter()
    with socket.create_server((HOST, 0)) as server:
        link = MavlinkLink(TcpCaller(HOST, server.getsockname()[1], counts), counts, Upkeep(clock))
        stack.callback(link.close)
        vehicle, _ = server.accept()
        vehicle.close()
        until(link, "link.lost", 1)
    calls = []
    for _ in range(600):
        clock.now_s += 0.1
        before = link.counts["link.lost"]
        link.receive()
        if link.state == "up":  # the refusal is still on its way
            until(link, "link.lost", before + 1)
        if link.counts["link.lost"] > before:
            calls.append(clock.now_s)
    pauses = [later - earlier for earlier, later in pairwise(calls)]
    assert pauses == sorted(pauses)
    assert pauses[-1] == pytest.approx(LONGEST_PAUSE_S, abs=0.11)


def test_a_tcp_listener_takes_one_caller_after_the_other(stack: ExitStack) -> None:
    counts: Counter[str] = Counter()
    port = TcpListener(HOST, 0, counts)
    link = MavlinkLink(port, counts)
    stack.callback(link.close)
    link.send(b"nobody there")
    assert counts["link.nobody_heard_yet"] == 1
    for k in (1, 2):
        with socket.create_connection(port.address(), DEADLINE_S) as vehicle:
            vehicle.sendall(b"heartbeat")
            until(link, "link.received", len(b"heartbeat") * k)
            link.send(b"setpoint")
            assert vehicle.recv(100) == b"setpoint"
        until(link, "link.lost", k)
    assert link.state == "up"


def test_a_peer_that_does_not_read_costs_messages_and_no_time(stack: ExitStack) -> None:
    server = stack.enter_context(socket.create_server((HOST, 0)))
    link = opened(stack, f"tcp:{HOST}:{server.getsockname()[1]}")
    vehicle, _ = server.accept()
    stack.callback(vehicle.close)
    for _ in range(200):
        link.send(bytes(100_000))
    assert link.counts["link.send_dropped"] > 0
    assert link.state == "up"


# ---------------------------------------------------------------- serial


def test_a_serial_line_carries_bytes_and_survives_being_unplugged(stack: ExitStack) -> None:
    master, slave = pty.openpty()
    device = os.ttyname(slave)
    link = opened(stack, f"serial://{device}:57600")
    os.write(master, b"heartbeat\x00\xfd\r\n\x03")
    assert arrived(link) == [b"heartbeat\x00\xfd\r\n\x03"]
    link.send(b"set\x11point")
    assert select.select([master], [], [], DEADLINE_S)[0]
    assert os.read(master, 100) == b"set\x11point"
    os.close(slave)
    os.close(master)
    until(link, "link.lost", 1)
    assert link.fileno() == -1
    link.send(b"lost")
    assert link.receive() == []
    assert link.counts["link.lost"] == 1


# ---------------------------------------------------------------- what cannot be opened


def test_a_port_in_use_is_named_with_a_remedy(stack: ExitStack) -> None:
    port = udp(stack).getsockname()[1]
    with pytest.raises(LinkError, match=f"udpin:{HOST}:{port}.*another program has this port"):
        MavlinkLink.open(f"udpin:{HOST}:{port}")
    server = stack.enter_context(socket.create_server((HOST, 0)))
    with pytest.raises(LinkError, match="another program has this port"):
        MavlinkLink.open(f"tcpin:{HOST}:{server.getsockname()[1]}")


def test_a_tcp_port_where_nobody_listens_is_named_with_a_remedy() -> None:
    with pytest.raises(LinkError, match="start the autopilot first"):
        MavlinkLink.open(f"tcp:{HOST}:{free_port(socket.SOCK_STREAM)}")


def test_an_address_that_is_not_ours_is_named_with_a_remedy() -> None:
    with pytest.raises(LinkError, match="no such address"):
        MavlinkLink.open("udpin:192.0.2.1:14550")


def test_a_serial_device_that_is_not_there_is_named_with_a_remedy() -> None:
    with pytest.raises(LinkError, match="plugged in"):
        MavlinkLink.open("/dev/ttyThatIsNotThere,57600")


def test_a_string_that_names_nothing_is_a_configuration_error() -> None:
    with pytest.raises(ConfigError, match=r"links\.mavlink"):
        MavlinkLink.open("carrier-pigeon:home")
