"""UTC as told by the wire, on the source's own clock.

AIS time stamps are seconds of the UTC minute, so a report's age needs UTC to about a second.
Each statement gives an offset, `utc - stamp`.  Delays on the way only ever make a statement
late, that is its offset too small, so the largest of the last few offsets is the best one.

A statement that differs from the clock by more than `STEP_S` is not believed at once.  After
`STEP_EVIDENCE` such statements in a row that agree with each other the clock follows them, and
counts a step.  Of two sources that contradict each other the first one heard is kept, unless the
other speaks several times as often.
"""

from collections import deque

from companion.instant import NS_PER_S, Instant
from companion.messages import UtcTime

STEP_S = 2.0
STEP_EVIDENCE = 3
MEMORY = 9  # statements; at the usual 1 Hz a drift of 50 ppm moves the clock 0.5 ms meanwhile
_STEP_NS = round(STEP_S * NS_PER_S)


class UtcClock:
    """Follows the statements it observes; knows nothing before the first one."""

    def __init__(self) -> None:
        self._offsets: deque[int] = deque(maxlen=MEMORY)
        self._suspects: list[int] = []
        self._offset: int | None = None
        self.steps = 0  # how often UTC was found to have jumped
        self.doubts = 0  # statements that contradicted the clock

    def observe(self, statement: UtcTime) -> None:
        """Take a statement of UTC."""
        offset = statement.utc_ns - statement.stamp
        if self._offset is None or abs(offset - self._offset) <= _STEP_NS:
            self._suspects.clear()
            self._offsets.append(offset)
        else:
            self.doubts += 1
            self._suspects = [s for s in self._suspects if abs(offset - s) <= _STEP_NS] + [offset]
            if len(self._suspects) < STEP_EVIDENCE:
                return
            self.steps += 1
            self._offsets.clear()
            self._offsets.extend(self._suspects)
            self._suspects.clear()
        self._offset = max(self._offsets)

    def utc_ns(self, at: Instant) -> int | None:
        """UTC in nanoseconds since 1970 at the instant `at`; None while nobody has said."""
        return None if self._offset is None else at + self._offset
