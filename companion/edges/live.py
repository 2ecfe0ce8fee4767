"""The live source: ticks of a clock that runs on its own, and the sink that minds expiry."""

import select
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Protocol

from companion.instant import NS_PER_S, Instant
from companion.loop import Tick
from companion.messages import Frame, Link

_SHORTEST_WAIT_S = 0.001


class Clock(Protocol):
    """Tells the time, and waits."""

    def now(self) -> Instant:
        """The time; it never runs backwards."""
        ...

    def wait(self, readers: Sequence[int], until: Instant) -> None:
        """Return when one of these file descriptors can be read, at `until` at the latest."""
        ...


class Stop(Protocol):
    """Whether to end; a `threading.Event` is one."""

    def is_set(self) -> bool:
        """End now."""
        ...


class Receiver(Protocol):
    """A MAVLink link, or one of an AIS receiver, as far as receiving goes."""

    def fileno(self) -> int:
        """To wait on, or -1."""
        ...

    def receive(self) -> list[bytes]:
        """What has arrived."""
        ...


class CanReceiver(Protocol):
    """A CAN bus, as far as receiving goes."""

    def fileno(self) -> int:
        """To wait on, or -1."""
        ...

    def receive(self) -> list[tuple[int, bytes]]:
        """The frames that have arrived."""
        ...


class Sender(Protocol):
    """A MAVLink link, as far as sending goes."""

    def send(self, data: bytes) -> None:
        """Send now or not at all."""
        ...


class MonotonicClock:
    """The machine's monotonic clock from zero, `speedup` times as fast: for simulators that are."""

    def __init__(self, speedup: float = 1.0) -> None:
        self._speedup = speedup
        self._start_ns = time.monotonic_ns()

    def now(self) -> Instant:
        """Nanoseconds since the clock was made, scaled."""
        return Instant(round((time.monotonic_ns() - self._start_ns) * self._speedup))

    def wait(self, readers: Sequence[int], until: Instant) -> None:
        """Wait for input until then."""
        timeout_s = max((until - self.now()) / NS_PER_S / self._speedup, 0.0)
        try:
            select.select(readers, [], [], timeout_s)
        except (OSError, ValueError):  # a descriptor was closed meanwhile: its owner will say so
            time.sleep(min(timeout_s, _SHORTEST_WAIT_S))


class LiveSource:
    """Ticks at a rate, each with the frames that arrived since the one before.

    Tick k is due at start + k / rate, however late the others were: no drift.  Ticks that are past
    when their turn comes are left out and counted in `skipped`.
    """

    def __init__(
        self,
        mavlink: Receiver,
        cans: Sequence[CanReceiver],
        rate_hz: float,
        *,
        clock: Clock,
        stop: Stop,
        aivdm: Receiver | None = None,
    ) -> None:
        self.skipped = 0
        self._mavlink = mavlink
        self._cans = tuple(cans)
        self._aivdm = aivdm
        self._rate_hz = rate_hz
        self._clock = clock
        self._stop = stop

    def __iter__(self) -> Iterator[Tick]:
        """Until stopped."""
        start = last = self._clock.now()
        number = 0
        while True:
            passed = int((self._clock.now() - start) * self._rate_hz / NS_PER_S)
            number += 1
            if passed > number:
                self.skipped += passed - number
                number = passed
            frames = self._collect_until(Instant(start + round(number * NS_PER_S / self._rate_hz)))
            if self._stop.is_set():
                return
            last = max(self._clock.now(), Instant(last + 1))
            yield Tick(last, tuple(frames))

    def _collect_until(self, due: Instant) -> list[Frame]:
        frames = self._arrived()  # also when it is late
        while self._clock.now() < due and not self._stop.is_set():
            readers = [self._mavlink.fileno(), *(bus.fileno() for bus in self._cans)]
            if self._aivdm is not None:
                readers.append(self._aivdm.fileno())
            self._clock.wait([reader for reader in readers if reader >= 0], due)
            frames += self._arrived()
        return frames

    def _arrived(self) -> list[Frame]:
        """Stamped now: the kernel's stamps are on another clock."""
        chunks = self._mavlink.receive()
        now = self._clock.now()
        frames = [Frame(now, Link.MAVLINK, data) for data in chunks]
        if self._aivdm is not None:
            sentences = self._aivdm.receive()
            now = self._clock.now()
            frames += [Frame(now, Link.AIVDM, data) for data in sentences]
        for bus in self._cans:
            heard = bus.receive()
            now = self._clock.now()
            frames += [Frame(now, Link.CAN, data, can_id) for can_id, data in heard]
        return frames


class LinkSink:
    """Sends over the link what has not expired."""

    def __init__(self, link: Sender, clock: Clock) -> None:
        self.counts: Counter[str] = Counter()
        self._link = link
        self._clock = clock

    def send(self, t: Instant, data: bytes, valid_until: Instant | None) -> bool:
        """Send `data`, decided at `t`, unless `valid_until` has passed on the clock."""
        if valid_until is not None and max(t, self._clock.now()) > valid_until:
            self.counts["sink.expired"] += 1
            return False
        self._link.send(data)
        return True
