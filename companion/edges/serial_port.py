"""A serial line as a MAVLink port."""

import select
from collections import Counter

import serial

_WRITE_TIMEOUT_S = 0.02  # pyserial spins on a full buffer when it is told not to wait at all


class SerialPort:
    """A serial device; it may be unplugged and come back under the same name."""

    def __init__(self, device: str, baud: int, _counts: Counter[str], *, flow_control: bool) -> None:
        self._device = device
        self._baud = baud
        self._flow_control = flow_control
        self._port = self._open()

    def _open(self) -> serial.Serial:
        return serial.Serial(
            self._device,
            self._baud,
            timeout=0,
            write_timeout=_WRITE_TIMEOUT_S,
            rtscts=self._flow_control,
            exclusive=True,
        )

    def fileno(self) -> int:
        """To wait on; -1 while the device is gone."""
        return int(self._port.fileno()) if self._port.is_open else -1

    def receive(self) -> list[bytes]:
        """What has arrived; raises `OSError` when the device is gone."""
        data = self._port.read(max(1, self._port.in_waiting))
        return [bytes(data)] if data else []

    def send(self, data: bytes) -> None:
        """Send; raises `BlockingIOError` when the line is not fast enough, `OSError` when it is gone."""
        if not select.select([], [self._port.fileno()], [], 0)[1]:
            raise BlockingIOError
        try:
            self._port.write(data)
        except serial.SerialTimeoutException:
            raise BlockingIOError from None

    def reopen(self) -> None:
        """Try the device again; raises `OSError` while it is not there."""
        self._port.close()
        self._port = self._open()

    def close(self) -> None:
        """Give the device back."""
        self._port.close()
