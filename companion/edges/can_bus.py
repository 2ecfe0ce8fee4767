"""A CAN bus through python-can: 29-bit data frames in and out.

Nothing raises after `open`: a bus that is down is opened again with growing pauses; read `state`
and `counts`.
"""

from collections import Counter
from collections.abc import Callable
from typing import Any

import can

from companion.edges.upkeep import CLOSED, UP, Upkeep
from companion.errors import ConfigError, LinkError

REMEDY = (
    "give INTERFACE:CHANNEL, for example socketcan:can0, udp_multicast:239.74.163.2, virtual:demo, "
    "or slcan:/dev/ttyACM0?ttyBaudrate=115200"
)
NMEA2000_BITRATE = 250_000
_WITHOUT_BITRATE = ("socketcan", "virtual", "udp_multicast")  # set outside, or there is none
# in the kernel; elsewhere python-can's own filter would end a read at the first foreign frame
_FILTERS: dict[str, Any] = {"socketcan": [{"can_id": 0, "can_mask": 0, "extended": True}]}
_MOST_AT_ONCE = 5_000  # frames a read; the rest stays for the next one
_MOST_MALFORMED = 100  # a read; more is a bus that fails without saying how

CanData = tuple[int, bytes]


class CanBus:
    """A bus that outlives its interface's troubles.

    `state` is "up" or says why not.  `counts`: can.received, can.sent, can.lost, can.error_frame,
    can.other_frame, can.malformed, can.send_dropped.
    """

    def __init__(
        self, opened: can.BusABC, reopen: Callable[[], can.BusABC], upkeep: Upkeep | None = None
    ) -> None:
        self.counts: Counter[str] = Counter()
        self._bus = opened
        self._reopen = reopen
        self._upkeep = upkeep or Upkeep()

    @property
    def state(self) -> str:
        """Whether it works, in words."""
        return self._upkeep.state

    @classmethod
    def open(cls, spec: str) -> "CanBus":
        """Open `INTERFACE:CHANNEL`, with python-can's own options as `?key=value&key=value`.

        Raises `ConfigError` for a string that is none, `LinkError` with a remedy when it does not open.
        """
        interface, colon, rest = spec.strip().partition(":")
        channel, _, options = rest.partition("?")
        if interface not in can.VALID_INTERFACES or not colon or not channel:
            raise ConfigError(f"links.can = {spec!r}: {REMEDY}")
        settings: dict[str, Any] = {} if interface in _WITHOUT_BITRATE else {"bitrate": NMEA2000_BITRATE}
        for option in filter(None, options.split("&")):
            key, equals, value = option.partition("=")
            if not equals:
                raise ConfigError(f"links.can = {spec!r}: {option!r} is no key=value; {REMEDY}")
            settings[key] = int(value) if value.isdecimal() else value

        def opened() -> can.BusABC:
            filters = _FILTERS.get(interface)
            return can.Bus(channel, interface, can_filters=filters, ignore_config=True, **settings)

        try:
            return cls(opened(), opened)
        except (can.CanError, OSError, ValueError, TypeError, ImportError, NotImplementedError) as error:
            raise LinkError(f"links.can = {spec!r}: {_reason(error)}; {_remedy(interface)}") from None

    def fileno(self) -> int:
        """To wait on; -1 for an interface that must be polled, or is down."""
        if self.state != UP:
            return -1
        try:
            return self._bus.fileno()
        except NotImplementedError:
            return -1

    def receive(self) -> list[CanData]:
        """The frames that have arrived: identifier and data.  Does not wait."""
        frames: list[CanData] = []
        if not self._is_up():
            return frames
        malformed = 0
        for _ in range(_MOST_AT_ONCE):
            try:
                message = self._bus.recv(0)
            except (can.CanError, OSError) as error:
                malformed += 1
                if _is_bus_failure(error) or malformed > _MOST_MALFORMED:
                    self._lose(error)
                    break
                self.counts["can.malformed"] += 1  # somebody else's datagram on the multicast group
                continue
            if message is None:
                break
            if self._is_ours(message):
                frames.append((message.arbitration_id, bytes(message.data)))
        if frames:
            self._upkeep.works()
            self.counts["can.received"] += len(frames)
        return frames

    def send(self, can_id: int, data: bytes) -> None:
        """Send one 29-bit frame now, or not at all."""
        if not self._is_up():
            self.counts["can.send_dropped"] += 1
            return
        try:
            self._bus.send(can.Message(arbitration_id=can_id, data=data, is_extended_id=True), timeout=0)
        except (can.CanError, OSError) as error:
            self.counts["can.send_dropped"] += 1
            if _is_bus_failure(error):
                self._lose(error)
        else:
            self.counts["can.sent"] += 1

    def close(self) -> None:
        """Let go of the bus."""
        self._bus.shutdown()
        self._upkeep.state = CLOSED

    def _is_ours(self, message: can.Message) -> bool:
        if message.is_error_frame:
            self.counts["can.error_frame"] += 1
            return False
        if message.is_remote_frame or message.is_fd or not message.is_extended_id:
            self.counts["can.other_frame"] += 1
            return False
        if not isinstance(message.arbitration_id, int) or not 0 <= message.arbitration_id < 1 << 29:
            self.counts["can.malformed"] += 1
            return False
        return True

    def _lose(self, error: Exception) -> None:
        self.counts["can.lost"] += 1
        self._upkeep.fails(_reason(error))

    def _is_up(self) -> bool:
        if self._upkeep.is_due():
            try:
                self._bus.shutdown()
                self._bus = self._reopen()
            except (can.CanError, OSError) as error:
                self._lose(error)
            else:
                self._upkeep.state = UP
        return self.state == UP


def _is_bus_failure(error: Exception) -> bool:
    """An operating system's error, directly or as the cause; not a frame that made no sense."""
    cause = error.__cause__ if isinstance(error.__cause__, OSError) else error
    if isinstance(cause, BlockingIOError):
        return False
    return isinstance(cause, OSError) or getattr(error, "error_code", None) is not None


def _reason(error: Exception) -> str:
    cause = error.__cause__ if isinstance(error.__cause__, OSError) else error
    return getattr(cause, "strerror", None) or str(cause) or type(cause).__name__


def _remedy(interface: str) -> str:
    if interface == "socketcan":
        return "bring it up: ip link set can0 up type can bitrate 250000"
    if interface == "udp_multicast":
        return "it needs a network interface with a multicast route and the package msgpack"
    return REMEDY
