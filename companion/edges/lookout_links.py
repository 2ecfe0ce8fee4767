"""Live links of `companion picture`: whatever comes over them, decoded by what it is.

A stream may carry MAVLink or AIVDM sentences; which of them, the first whole message tells.  Over MAVLink the
vehicle is asked for AIS_VESSEL, which autopilots send only on request.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Protocol

from companion.edges.can_bus import CanBus
from companion.edges.connection import parse
from companion.edges.live import MonotonicClock, Stop
from companion.edges.mavlink import MavlinkLink
from companion.errors import ConfigError
from companion.instant import Instant, after
from companion.messages import CommandAck, Frame, Heard, Link, UtcTime
from companion.requests import MessageRequests
from companion.utc import UtcClock
from companion.wire.aivdm import AivdmDecoder
from companion.wire.mavlink import MavlinkDecoder, MavlinkEncoder
from companion.wire.nmea2000 import Nmea2000Decoder

WAIT_S = 0.2


class Feed(Protocol):
    """One link with its decoders."""

    def fileno(self) -> int:
        """To wait on, or -1."""
        ...

    def heard(self, now: Instant) -> list[Heard]:
        """What has arrived since."""
        ...

    def close(self) -> None:
        """Let go of the link."""
        ...


class StreamFeed:
    """UDP, TCP or a serial line."""

    def __init__(self, link: MavlinkLink, utc: UtcClock) -> None:
        self._link = link
        self._aivdm, self._mavlink = AivdmDecoder(utc), MavlinkDecoder(system_id=0)
        self._requests = MessageRequests()

    def fileno(self) -> int:
        """See `Feed`."""
        return self._link.fileno()

    def heard(self, now: Instant) -> list[Heard]:
        """See `Feed`."""
        found: list[Heard] = []
        for data in self._link.receive():
            if not _speaks(self._aivdm.counts, "aivdm.messages"):
                found += self._mavlink.decode(Frame(now, Link.MAVLINK, data))
            if not _speaks(self._mavlink.counts, "mavlink.packets"):
                found += self._aivdm.decode(Frame(now, Link.AIVDM, data))
        for each in found:
            if isinstance(each, CommandAck):
                self._requests.observe_ack(each)
        if self._mavlink.system_id and (command := self._requests.due(now)) is not None:
            self._link.send(MavlinkEncoder(system_id=self._mavlink.system_id).encode(command))
        return found

    def close(self) -> None:
        """See `Feed`."""
        self._link.close()


class BusFeed:
    """An NMEA 2000 bus."""

    def __init__(self, bus: CanBus, utc: UtcClock) -> None:
        self._bus = bus
        self._decoder = Nmea2000Decoder(utc)

    def fileno(self) -> int:
        """See `Feed`."""
        return self._bus.fileno()

    def heard(self, now: Instant) -> list[Heard]:
        """See `Feed`."""
        decode = self._decoder.decode
        return [h for can_id, data in self._bus.receive() for h in decode(Frame(now, Link.CAN, data, can_id))]

    def close(self) -> None:
        """See `Feed`."""
        self._bus.close()


def _speaks(counts: Counter[str], key: str) -> bool:
    return counts[key] > 0


def live(specs: Sequence[str], clock: MonotonicClock, stop: Stop) -> Iterator[list[Heard]]:
    """What each turn of the links brings, until stopped."""
    utc = UtcClock()
    feeds: list[Feed] = []
    try:
        feeds.extend(_opened(spec, utc) for spec in specs)  # those opened are closed if one cannot be
        while not stop.is_set():
            clock.wait([f for f in (feed.fileno() for feed in feeds) if f >= 0], after(clock.now(), WAIT_S))
            heard = [each for feed in feeds for each in feed.heard(clock.now())]
            for each in heard:
                if isinstance(each, UtcTime):
                    utc.observe(each)
            yield heard
    finally:
        for feed in feeds:
            feed.close()


def _opened(spec: str, utc: UtcClock) -> Feed:
    """UDP, TCP or a serial line, else a CAN bus; a name without a colon is a missing file."""
    try:
        parse(spec)
    except ConfigError:
        if ":" not in spec:
            text = "no such file, and no link such as udpin:0.0.0.0:10110 or socketcan:can0"
            raise ConfigError(f"FILE_OR_LINK = {spec!r}: {text}") from None
        return BusFeed(CanBus.open(spec), utc)
    return StreamFeed(MavlinkLink.open(spec, "FILE_OR_LINK"), utc)
