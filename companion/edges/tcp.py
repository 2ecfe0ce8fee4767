"""TCP as a MAVLink port, waiting for nothing but the first connection."""

import errno
import select
import socket
from collections import Counter

CONNECT_TIMEOUT_S = 5.0
_READ_BYTES = 65_536


def _prepare(connection: socket.socket) -> None:
    connection.setblocking(False)
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)  # a setpoint does not wait for company


def _read(connection: socket.socket) -> list[bytes]:
    try:
        data = connection.recv(_READ_BYTES)
    except BlockingIOError:
        return []
    if not data:
        raise ConnectionResetError(errno.ECONNRESET, "closed by the other side")
    return [data]


def _write(connection: socket.socket, data: bytes) -> None:
    """All or, when the other side does not read, less: what is late is not worth sending."""
    if connection.send(data) < len(data):
        raise BlockingIOError


class TcpCaller:
    """Calls one address; called again after it was lost, without waiting for the answer."""

    def __init__(self, host: str, port: int, _counts: Counter[str]) -> None:
        self._socket = socket.create_connection((host, port), CONNECT_TIMEOUT_S)
        self._address = self._socket.getpeername()  # so that a new call asks no name server
        self._is_connecting = False
        _prepare(self._socket)

    def fileno(self) -> int:
        """To wait on; -1 while there is no connection."""
        return -1 if self._is_connecting else self._socket.fileno()

    def receive(self) -> list[bytes]:
        """What has arrived; raises `OSError` when the connection is lost or was refused."""
        return _read(self._socket) if self._has_connected() else []

    def send(self, data: bytes) -> None:
        """Send, or raise `OSError`."""
        if not self._has_connected():
            raise BlockingIOError
        _write(self._socket, data)

    def _has_connected(self) -> bool:
        if self._is_connecting and select.select([], [self._socket], [], 0)[1]:
            error = self._socket.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
            if error:
                raise OSError(error, "cannot connect")
            self._is_connecting = False
        return not self._is_connecting

    def reopen(self) -> None:
        """Begin a new connection."""
        self._socket.close()
        self._socket = socket.socket(self._socket.family, socket.SOCK_STREAM)
        _prepare(self._socket)
        self._is_connecting = True
        error = self._socket.connect_ex(self._address)
        if error not in (0, errno.EINPROGRESS, errno.EWOULDBLOCK):
            raise OSError(error, "cannot connect")

    def close(self) -> None:
        """End the connection."""
        self._socket.close()


class TcpListener:
    """Waits on a port for one caller at a time."""

    def __init__(self, host: str, port: int, counts: Counter[str]) -> None:
        self._counts = counts
        self._caller: socket.socket | None = None
        self._listener = socket.create_server((host, port), backlog=1)
        self._listener.setblocking(False)

    def fileno(self) -> int:
        """To wait on."""
        return (self._caller or self._listener).fileno()

    def address(self) -> tuple[str, int]:
        """Where it listens."""
        host, port = self._listener.getsockname()
        return host, port

    def receive(self) -> list[bytes]:
        """What the caller has sent."""
        if self._caller is None:
            try:
                self._caller, _ = self._listener.accept()
            except OSError:  # nobody calls, or has hung up again
                return []
            _prepare(self._caller)
        try:
            return _read(self._caller)
        except OSError:
            self._hang_up()
            return []

    def send(self, data: bytes) -> None:
        """Send to the caller, if there is one."""
        if self._caller is None:
            self._counts["link.nobody_heard_yet"] += 1
            return
        try:
            _write(self._caller, data)
        except BlockingIOError:
            raise
        except OSError:
            self._hang_up()

    def _hang_up(self) -> None:
        if self._caller is not None:
            self._counts["link.lost"] += 1
            self._caller.close()
            self._caller = None

    def reopen(self) -> None:
        """Nothing to do: it goes on listening."""

    def close(self) -> None:
        """End the connection and give the port back."""
        if self._caller is not None:
            self._caller.close()
        self._listener.close()
