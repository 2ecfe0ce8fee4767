"""UDP as a MAVLink port; never lost, since nothing was ever connected."""

import socket
from collections import Counter

Address = tuple[str, int]

_LARGEST = 65_535
_MOST_AT_ONCE = 1_000  # datagrams a read; the rest stays for the next one
_MOST_PEERS = 8


class UdpListener:
    """Waits on a port, and answers everybody it has lately heard from.

    Not only the last one: a stray datagram must not take the setpoints away from the vehicle.
    """

    def __init__(self, host: str, port: int, counts: Counter[str]) -> None:
        self._counts = counts
        self._peers: dict[Address, None] = {}  # the one heard last stands last
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.setblocking(False)
            self._socket.bind((host, port))
        except OSError:
            self._socket.close()
            raise

    def fileno(self) -> int:
        """To wait on."""
        return self._socket.fileno()

    def address(self) -> Address:
        """Where it listens."""
        host, port = self._socket.getsockname()
        return host, port

    def receive(self) -> list[bytes]:
        """The datagrams that have arrived."""
        datagrams = []
        for _ in range(_MOST_AT_ONCE):
            try:
                data, peer = self._socket.recvfrom(_LARGEST)
            except BlockingIOError:
                break
            except OSError:  # an answer of ours was refused there
                self._counts["link.refused"] += 1
                continue
            datagrams.append(data)
            self._peers.pop(peer, None)
            self._peers[peer] = None
            if len(self._peers) > _MOST_PEERS:
                del self._peers[next(iter(self._peers))]
        return datagrams

    def send(self, data: bytes) -> None:
        """Send to every peer; before the first one was heard there is nobody to send to."""
        if not self._peers:
            self._counts["link.nobody_heard_yet"] += 1
        for peer in self._peers:
            try:
                self._socket.sendto(data, peer)
            except OSError:
                self._counts["link.refused"] += 1

    def reopen(self) -> None:
        """Nothing to do."""

    def close(self) -> None:
        """Give the port back."""
        self._socket.close()


class UdpCaller:
    """Sends to one address and hears only that one."""

    def __init__(self, host: str, port: int, counts: Counter[str]) -> None:
        self._counts = counts
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.setblocking(False)
            self._socket.connect((host, port))
        except OSError:
            self._socket.close()
            raise

    def fileno(self) -> int:
        """To wait on."""
        return self._socket.fileno()

    def receive(self) -> list[bytes]:
        """The datagrams that have arrived."""
        datagrams = []
        for _ in range(_MOST_AT_ONCE):
            try:
                datagrams.append(self._socket.recv(_LARGEST))
            except BlockingIOError:
                break
            except OSError:  # nobody listens there yet
                self._counts["link.refused"] += 1
        return datagrams

    def send(self, data: bytes) -> None:
        """Send one datagram."""
        try:
            self._socket.send(data)
        except OSError:
            self._counts["link.refused"] += 1

    def reopen(self) -> None:
        """Nothing to do."""

    def close(self) -> None:
        """Give the port back."""
        self._socket.close()
