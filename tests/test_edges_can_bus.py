import select
import socket
import struct
from collections import deque
from typing import Any

import can
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.edges.can_bus import CanBus
from companion.edges.upkeep import FIRST_PAUSE_S, Upkeep
from companion.errors import ConfigError, LinkError

# a msgpack map that python-can makes a message of
FRACTIONAL_ID = b"\x81\xaearbitration_id\xcb" + struct.pack(">d", 5.5)
POSITION = (0x09F80114, bytes(range(8)))


class FakeBus(can.BusABC):
    """A bus with failure switches: set `fault` and every call raises it."""

    channel_info = "fake"

    def __init__(self) -> None:
        super().__init__("fake")
        self.queue: deque[can.Message] = deque()
        self.sent: list[can.Message] = []
        self.fault: Exception | None = None
        self.is_shut = False

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        if self.fault is not None:
            raise self.fault
        return (self.queue.popleft() if self.queue else None), True

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        if self.fault is not None:
            raise self.fault
        self.sent.append(msg)

    def fileno(self) -> int:
        return 99

    def shutdown(self) -> None:
        super().shutdown()
        self.is_shut = True


def os_fault(number: int) -> can.CanOperationError:
    """As python-can wraps what the kernel says."""
    fault = can.CanOperationError("Failed to receive", number)
    fault.__cause__ = OSError(number, "Network is down")
    return fault


def data_frame(can_id: int = POSITION[0], data: bytes = POSITION[1], **more: Any) -> can.Message:
    return can.Message(arbitration_id=can_id, data=data, **more)


class Buses:
    """Hands out fake buses, and counts them."""

    def __init__(self) -> None:
        self.made: list[FakeBus] = []
        self.fault: Exception | None = None
        self.now_s = 50.0

    def make(self) -> FakeBus:
        if self.fault is not None:
            raise self.fault
        self.made.append(FakeBus())
        return self.made[-1]

    def open(self) -> CanBus:
        return CanBus(self.make(), self.make, Upkeep(lambda: self.now_s))


def test_29_bit_data_frames_come_through_and_others_are_counted() -> None:
    buses = Buses()
    bus = buses.open()
    buses.made[0].queue.extend(
        [
            data_frame(),
            data_frame(0x123, is_extended_id=False),
            data_frame(data=b"", is_remote_frame=True),
            data_frame(data=bytes(8), is_error_frame=True),
            data_frame(data=bytes(12), is_fd=True),
            data_frame(data=b""),
        ]
    )
    assert bus.receive() == [POSITION, (POSITION[0], b"")]
    assert bus.counts == {"can.received": 2, "can.other_frame": 3, "can.error_frame": 1}
    assert bus.receive() == []
    bus.close()


@pytest.mark.parametrize("number", [100, 19, 5])  # ENETDOWN, ENODEV, EIO
def test_a_bus_that_goes_down_is_opened_again_and_nothing_raises(number: int) -> None:
    buses = Buses()
    bus = buses.open()
    buses.made[0].fault = os_fault(number)
    assert bus.receive() == []
    assert bus.state == "down: Network is down"
    assert bus.fileno() == -1
    bus.send(*POSITION)
    assert (bus.counts["can.lost"], bus.counts["can.send_dropped"]) == (1, 1)
    assert len(buses.made) == 1

    buses.now_s += FIRST_PAUSE_S
    buses.fault = OSError(number, "No such device")
    assert bus.receive() == []
    assert bus.state == "down: No such device"
    assert buses.made[0].is_shut

    buses.fault = None
    buses.now_s += 1.9 * FIRST_PAUSE_S
    assert bus.receive() == []
    assert len(buses.made) == 1
    buses.now_s += 0.2 * FIRST_PAUSE_S
    bus.receive()
    buses.made[1].queue.append(data_frame())
    assert bus.receive() == [POSITION]
    assert bus.state == "up"
    bus.close()


def test_a_full_transmit_buffer_drops_the_frame_and_keeps_the_bus() -> None:
    buses = Buses()
    bus = buses.open()
    buses.made[0].fault = can.CanOperationError("Transmit buffer full")
    bus.send(*POSITION)
    assert bus.state == "up"
    assert bus.counts["can.send_dropped"] == 1
    buses.made[0].fault = None
    bus.send(*POSITION)
    (sent,) = buses.made[0].sent
    assert (sent.arbitration_id, bytes(sent.data), sent.is_extended_id) == (*POSITION, True)
    bus.close()


def test_a_bus_that_fails_without_a_reason_is_given_a_pause() -> None:
    buses = Buses()
    bus = buses.open()
    buses.made[0].fault = can.CanOperationError("something")
    assert bus.receive() == []
    assert bus.state == "down: something"
    bus.close()


def test_a_closed_bus_stays_closed() -> None:
    buses = Buses()
    bus = buses.open()
    bus.close()
    buses.now_s += 100.0
    assert bus.receive() == []
    assert (bus.state, len(buses.made)) == ("closed", 1)


def test_two_ends_of_a_virtual_bus_hear_each_other() -> None:
    here, there = CanBus.open("virtual:edges"), CanBus.open("virtual:edges")
    here.send(*POSITION)
    assert there.receive() == [POSITION]
    assert here.receive() == []
    assert here.fileno() == -1  # to be polled
    here.close()
    there.close()


def multicast_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        sock.bind(("", 0))
        port: int = sock.getsockname()[1]
        return port


def test_a_multicast_bus_carries_frames_and_counts_foreign_datagrams() -> None:
    port = multicast_port()
    spec = f"udp_multicast:239.74.163.2?port={port}"
    here, there = CanBus.open(spec), CanBus.open(spec)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        for junk in (b"junk", bytes(range(200)), b"\xff" * 50, FRACTIONAL_ID):
            stranger.sendto(junk, ("239.74.163.2", port))
    here.send(*POSITION)
    frames: list[tuple[int, bytes]] = []
    while POSITION not in frames:
        assert select.select([there.fileno()], [], [], 5.0)[0]
        frames += there.receive()
    assert frames == [POSITION]
    assert there.counts["can.malformed"] == 4
    assert there.state == "up"
    here.close()
    there.close()


@pytest.mark.parametrize(
    "spec", ["", "can0", "socketcan", "socketcan:", "warpdrive:0", "virtual:demo?fast", ":can0"]
)
def test_a_spelling_that_names_no_bus_is_refused_with_examples(spec: str) -> None:
    with pytest.raises(ConfigError, match="socketcan:can0") as caught:
        CanBus.open(spec)
    assert repr(spec) in str(caught.value)


def test_a_bus_that_does_not_open_is_named_with_a_remedy() -> None:
    with pytest.raises(LinkError, match=r"links\.can.*bring it up: ip link set"):
        CanBus.open("socketcan:nosuchcan9")
    with pytest.raises(LinkError, match="multicast"):
        CanBus.open("udp_multicast:192.0.2.7")


@settings(max_examples=30)
@given(st.lists(st.tuples(st.integers(0, 2**29 - 1), st.binary(max_size=8)), max_size=50))
def test_every_frame_comes_through_as_it_is(frames: list[tuple[int, bytes]]) -> None:
    buses = Buses()
    bus = buses.open()
    buses.made[0].queue.extend(data_frame(can_id, data) for can_id, data in frames)
    assert bus.receive() == frames
    bus.close()
