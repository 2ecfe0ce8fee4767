"""The sea in the companion's own process: source and sink, as fast as the machine can.

Everything still crosses the border as bytes: MAVLink as the autopilot sends it, CAN frames
through a python-can bus that the companion's own edge opens and reads.
"""

import itertools
import os
from collections import Counter
from collections.abc import Callable, Iterator

from companion.edges.can_bus import CanBus
from companion.instant import Instant, elapsed_s
from companion.loop import Tick
from companion.messages import Frame, Link
from sitl.sea import Heard, Sea

_serial = itertools.count()


class LockstepSea:
    """Implements `companion.loop.Source` and `Sink` for one run.

    Time advances by `dt_s` a tick and only when the next tick is asked for.  `after_tick(sea)` is
    called once the companion has answered a tick, before time moves on.  The run ends
    `linger_s` after arrival, so that the companion can notice it too, or at the time limit.
    """

    def __init__(
        self,
        sea: Sea,
        *,
        dt_s: float = 0.1,
        linger_s: float = 2.0,
        after_tick: Callable[[Sea], None] | None = None,
    ) -> None:
        self.sea = sea
        self.counts: Counter[str] = Counter()
        self._dt_s = dt_s
        self._linger_s = linger_s
        self.after_tick = after_tick

    def __iter__(self) -> Iterator[Tick]:
        spec = f"virtual:sitl-{os.getpid()}-{next(_serial)}"
        ship_side, companion_side = CanBus.open(spec), CanBus.open(spec)
        try:
            yield from self._ticks(ship_side, companion_side)
        finally:
            ship_side.close()
            companion_side.close()

    def _ticks(self, ship_side: CanBus, companion_side: CanBus) -> Iterator[Tick]:
        arrived_at: Instant | None = None
        while not self.sea.timed_out:
            heard = self.sea.advance(self._dt_s)
            yield Tick(self.sea.now, self._frames(heard, ship_side, companion_side))
            if self.after_tick is not None:
                self.after_tick(self.sea)
            if not self.sea.arrived:
                arrived_at = None
            elif arrived_at is None:
                arrived_at = self.sea.now
            elif elapsed_s(arrived_at, self.sea.now) >= self._linger_s:
                return

    def _frames(self, heard: Heard, ship_side: CanBus, companion_side: CanBus) -> tuple[Frame, ...]:
        for _, can_id, data in heard.can:
            ship_side.send(can_id, data)
        received = companion_side.receive() if heard.can else []
        while len(received) < len(heard.can):  # the edge takes a bounded number at once
            received += companion_side.receive()
        # a virtual bus keeps order and loses nothing, so each frame has the time it was sent
        frames = [
            Frame(t, Link.CAN, data, can_id)
            for (t, _, _), (can_id, data) in zip(heard.can, received, strict=True)
        ]
        if heard.mavlink:
            frames.append(Frame(self.sea.now, Link.MAVLINK, heard.mavlink))
        return tuple(frames)

    def send(self, t: Instant, data: bytes, valid_until: Instant | None) -> bool:  # noqa: ARG002
        """Hand bytes to the autopilot unless they have expired."""
        if valid_until is not None and valid_until < self.sea.now:
            self.counts["sink.expired"] += 1
            return False
        self.sea.receive(data)
        return True
