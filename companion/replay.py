"""Runs a log through the core again and compares every decision and every byte sent.

The log takes the place of all four edges of the loop: it is the source of the ticks, and the
sink and journal that hold what comes out against what was recorded.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from companion import build, config, loop
from companion.errors import LogError
from companion.instant import Instant
from companion.loop import Encoder, Stepper, Tick
from companion.messages import Decision
from companion.record import EXACT, DecisionRecorder, Log, Step, Tolerance, encode, first_difference
from companion.record.session import differences, session


@dataclass(frozen=True, slots=True)
class Difference:
    """The first thing that came out otherwise: where, and both values."""

    tick: int
    t: Instant
    path: str
    recorded: object
    replayed: object

    def __str__(self) -> str:
        where = f"tick {self.tick} (t = {self.t} ns)"
        return f"{where}: {self.path or 'bytes'}: recorded {self.recorded!r}, replayed {self.replayed!r}"


@dataclass(frozen=True, slots=True)
class Replayed:
    """What a replay found.

    `ticks` were compared.  `first` is None when all were the same.  `complete` is False when the log
    was seen to break off, and `damage` says what cut it short, if anything did.  `notes` name what is
    different here that may explain a difference.
    """

    ticks: int
    first: Difference | None
    complete: bool
    damage: str | None
    notes: tuple[str, ...] = ()


def replay(path: Path, tolerance: Tolerance = EXACT) -> Replayed:
    """Rebuild the core from the log's own configuration and replay a run folder or .mcap file.

    Raises `LogError` if it is no log, `ConfigError` or `ModelError` if its configuration cannot
    be built here.
    """
    log = Log(path)
    configured = config.from_mapping(log.session.config, str(log.path))
    companion = build.build(configured)
    notes = differences(log.session, session(configured, companion.model_digest, companion.turning_digest))
    return compare(log, companion.core, companion.encoder, tolerance, notes)


def compare(
    log: Log, core: Stepper, encoder: Encoder, tolerance: Tolerance = EXACT, notes: tuple[str, ...] = ()
) -> Replayed:
    """Run `core` over the log up to the first difference."""
    comparison = Comparison(log, tolerance)
    loop.run(comparison, core, encoder, comparison, comparison, _no_stopwatch)
    if comparison.ticks == 0:
        raise LogError(f"{log.path}: the log holds no tick: the run ended before its first second")
    whole = log.complete or comparison.first is not None  # after a difference the rest was not read
    return Replayed(comparison.ticks, comparison.first, whole, log.damage, notes)


class Comparison:
    """Source, sink and journal of a replay: `first` is the first difference, `ticks` how many ran."""

    def __init__(self, log: Log, tolerance: Tolerance) -> None:
        self._log = log
        self._tolerance = tolerance
        self._decisions = DecisionRecorder()
        self._step: Step | None = None
        self._sent: list[bytes] = []
        self.ticks = 0
        self.first: Difference | None = None

    def __iter__(self) -> Iterator[Tick]:
        for step in self._log.steps():
            self._step = step
            self._sent = []
            yield step.tick
            self._compare_sent(step)
            self.ticks += 1
            if self.first is not None:
                return

    def send(self, t: Instant, data: bytes, valid_until: Instant | None) -> bool:  # noqa: ARG002
        """Nothing leaves a replay."""
        return True

    def tick(self, tick: Tick) -> None:
        """The tick came from the log: there is nothing to compare."""

    def decided(self, decision: Decision) -> None:
        """Hold the decision against the recorded one."""
        replayed = encode(self._decisions.record(decision))
        if self._step is None or self._step.decision is None:
            return  # the recorded run ended inside this step
        found = first_difference(self._step.decision, replayed, self._tolerance)
        if found is not None:
            self._report(self._step, found.path, found.recorded, found.replayed)

    def sent(self, t: Instant, data: bytes, expired: bool) -> None:  # noqa: ARG002
        """Collect what would have been sent."""
        self._sent.append(data)

    def timed(self, t: Instant, step_s: float) -> None:
        """Time is the one thing that differs between runs."""

    def _compare_sent(self, step: Step) -> None:
        if step.decision is None:
            return
        if len(self._sent) != len(step.sent):
            self._report(step, "sent", len(step.sent), len(self._sent))
        for i, (recorded, replayed) in enumerate(zip(step.sent, self._sent, strict=False)):
            if recorded != replayed and self._tolerance.is_exact:
                self._report(step, f"sent[{i}]", recorded.hex(), replayed.hex())

    def _report(self, step: Step, path: str, recorded: object, replayed: object) -> None:
        if self.first is None:
            self.first = Difference(step.number, step.tick.t, path, recorded, replayed)


def _no_stopwatch() -> float:
    return 0.0
