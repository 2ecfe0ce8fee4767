"""The link to the autopilot, or to an AIS receiver: raw bytes in and out, whatever carries them.

Sockets and pyserial directly.  pymavlink's mavutil would parse every message a second time, keeps
its session in module globals, prints, and sleeps while it reconnects.

A link that breaks is opened again, with growing pauses; until then nothing comes in and what goes
out is dropped.  Nothing raises after `open`: read `state` and `counts`.
"""

import errno
from collections import Counter
from typing import Protocol

from companion.edges.connection import Connection, Way, parse
from companion.edges.serial_port import SerialPort
from companion.edges.tcp import TcpCaller, TcpListener
from companion.edges.udp import UdpCaller, UdpListener
from companion.edges.upkeep import CLOSED, UP, Upkeep
from companion.errors import ConfigError, LinkError

_REMEDIES = {
    errno.EADDRINUSE: "another program has this port: stop it, or take another port",
    errno.EADDRNOTAVAIL: "this machine has no such address: use 0.0.0.0 or one of its own",
    errno.ECONNREFUSED: "nobody listens there: start the autopilot first, or check host and port",
    errno.EACCES: "not allowed: add the user to the group dialout, or take a port above 1023",
    errno.ENOENT: "there is no such device: is it plugged in?",
    errno.EBUSY: "another program has this device: stop it",
    errno.EAGAIN: "another program has this device: stop it",
}


class Port(Protocol):
    """What carries the bytes.  `receive`, `send` and `reopen` never wait and may raise `OSError`."""

    def fileno(self) -> int:
        """To wait on; -1 while there is nothing to wait on."""
        ...

    def receive(self) -> list[bytes]:
        """What has arrived since."""
        ...

    def send(self, data: bytes) -> None:
        """Send, or raise `BlockingIOError` when that would mean waiting."""
        ...

    def reopen(self) -> None:
        """Try again after an `OSError`."""
        ...

    def close(self) -> None:
        """Let go."""
        ...


class MavlinkLink:
    """A link that outlives its port.

    `state` is "up" or says why not.  `counts`: link.received and link.sent (bytes), link.lost (and
    not regained), link.refused, link.send_dropped, link.nobody_heard_yet.
    """

    def __init__(self, port: Port, counts: Counter[str], upkeep: Upkeep | None = None) -> None:
        self.counts = counts
        self._port = port
        self._upkeep = upkeep or Upkeep()

    @property
    def state(self) -> str:
        """Whether it works, in words."""
        return self._upkeep.state

    @classmethod
    def open(cls, url: str, key: str = "links.mavlink") -> "MavlinkLink":
        """Open what a connection string names (see `companion.edges.connection`); `key` is where it stands.

        Raises `ConfigError` for a string that is none, `LinkError` with a remedy when it does not open.
        """
        try:
            connection = parse(url)
        except ConfigError as error:
            raise ConfigError(str(error).replace("links.mavlink", key)) from None
        counts: Counter[str] = Counter()
        try:
            return cls(_port(connection, counts), counts)
        except (OSError, ValueError) as error:  # ValueError: pyserial on an impossible baud rate
            code = getattr(error, "errno", None)
            reason = getattr(error, "strerror", None) or str(error)
            remedy = _REMEDIES.get(code or 0, f"check {key}")
            raise LinkError(f"{key} = {url!r}: {reason}; {remedy}") from None

    def fileno(self) -> int:
        """To wait on; -1 while there is nothing to wait on."""
        return self._port.fileno() if self.state == UP else -1

    def receive(self) -> list[bytes]:
        """What has arrived: datagrams, or pieces of a stream.  Does not wait."""
        if not self._is_up():
            return []
        try:
            chunks = self._port.receive()
        except OSError as error:
            self._lose(error)
            return []
        if chunks:
            self._upkeep.works()
            self.counts["link.received"] += sum(map(len, chunks))
        return chunks

    def send(self, data: bytes) -> None:
        """Send now or not at all."""
        if not self._is_up():
            self.counts["link.send_dropped"] += 1
            return
        try:
            self._port.send(data)
        except BlockingIOError:
            self.counts["link.send_dropped"] += 1
        except OSError as error:
            self.counts["link.send_dropped"] += 1
            self._lose(error)
        else:
            self.counts["link.sent"] += len(data)

    def close(self) -> None:
        """Let go of the port."""
        self._port.close()
        self._upkeep.state = CLOSED

    def _lose(self, error: OSError) -> None:
        self.counts["link.lost"] += 1
        self._upkeep.fails(error.strerror or error)

    def _is_up(self) -> bool:
        if self._upkeep.is_due():
            try:
                self._port.reopen()
            except OSError as error:
                self._lose(error)
            else:
                self._upkeep.state = UP
        return self.state == UP


def _port(connection: Connection, counts: Counter[str]) -> Port:
    host, port = connection.host, connection.port
    match connection.way:
        case Way.UDP_IN:
            return UdpListener(host, port, counts)
        case Way.UDP_OUT:
            return UdpCaller(host, port, counts)
        case Way.TCP_IN:
            return TcpListener(host, port, counts)
        case Way.TCP_OUT:
            return TcpCaller(host, port, counts)
        case Way.SERIAL:
            return SerialPort(host, port, counts, flow_control=connection.flow_control)
