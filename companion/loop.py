"""One loop for live, simulation and replay: the source owns time, the sink takes bytes.

    for tick in source:  decision = core.step(tick)  ->  journal, encoder, sink

Nothing here knows which of the three it serves.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Protocol

from companion.instant import Instant
from companion.messages import Decision, Frame, Outgoing, Setpoint


@dataclass(frozen=True, slots=True)
class Tick:
    """One turn of the loop: the time, and the frames that arrived since the last turn, in order."""

    t: Instant
    frames: tuple[Frame, ...]


class Source(Protocol):
    """Yields ticks with strictly increasing `t`; ends when the run ends."""

    def __iter__(self) -> Iterator[Tick]: ...


class Sink(Protocol):
    """Takes encoded MAVLink for the autopilot.  Never sends what has expired."""

    def send(self, t: Instant, data: bytes, valid_until: Instant | None) -> bool:
        """Send `data` now, at `t`; False if `valid_until` has passed on the sink's clock: it is dropped."""
        ...


class Journal(Protocol):
    """Keeps what happened."""

    def tick(self, tick: Tick) -> None:
        """What came in."""
        ...

    def decided(self, decision: Decision) -> None:
        """What was decided."""
        ...

    def sent(self, t: Instant, data: bytes, expired: bool) -> None:
        """What went out, or was dropped because it had expired."""
        ...

    def timed(self, t: Instant, step_s: float) -> None:
        """How long the step took (kept apart: it is the one thing that differs between runs)."""
        ...


class Journals:
    """Several journals as one."""

    def __init__(self, journals: Iterable[Journal]) -> None:
        self._journals = tuple(journals)

    def tick(self, tick: Tick) -> None:
        """What came in."""
        for journal in self._journals:
            journal.tick(tick)

    def decided(self, decision: Decision) -> None:
        """What was decided."""
        for journal in self._journals:
            journal.decided(decision)

    def sent(self, t: Instant, data: bytes, expired: bool) -> None:
        """What went out, or was dropped because it had expired."""
        for journal in self._journals:
            journal.sent(t, data, expired)

    def timed(self, t: Instant, step_s: float) -> None:
        """How long the step took."""
        for journal in self._journals:
            journal.timed(t, step_s)


class Stepper(Protocol):
    """The core, as the loop sees it."""

    def step(self, tick: Tick) -> Decision:
        """Take what arrived and decide."""
        ...


class Encoder(Protocol):
    """Turns what a decision says into bytes, under the vehicle's system id."""

    system_id: int

    def encode(self, message: Outgoing) -> bytes:
        """One encoded MAVLink message."""
        ...


def run(
    source: Source,
    core: Stepper,
    encoder: Encoder,
    sink: Sink,
    journal: Journal,
    stopwatch: Callable[[], float],
) -> Decision | None:
    """Turn the loop until the source ends; the last decision, if there was one.

    `stopwatch` returns seconds and is only ever used to measure how long a step took.
    """
    decision = None
    for tick in source:
        journal.tick(tick)
        started_s = stopwatch()
        decision = core.step(tick)
        journal.timed(tick.t, stopwatch() - started_s)
        journal.decided(decision)
        if decision.system_id:
            encoder.system_id = decision.system_id
        for message in decision.outgoing:
            data = encoder.encode(message)
            went = sink.send(tick.t, data, message.valid_until if isinstance(message, Setpoint) else None)
            journal.sent(tick.t, data, expired=not went)
    return decision
