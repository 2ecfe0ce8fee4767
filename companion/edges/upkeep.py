"""Keeping something open that may break: when to try again."""

import time
from collections.abc import Callable

FIRST_PAUSE_S, LONGEST_PAUSE_S = 0.5, 5.0

UP, CLOSED = "up", "closed"


class Upkeep:
    """`state` is "up", "closed", or "down: " and why; failures in a row make the pauses longer."""

    def __init__(self, clock_s: Callable[[], float] = time.monotonic) -> None:
        self.state = UP
        self._clock_s = clock_s
        self._pause_s = FIRST_PAUSE_S
        self._retry_at_s = 0.0

    def works(self) -> None:
        """It has done its work: the next failure is a first one."""
        self._pause_s = FIRST_PAUSE_S

    def fails(self, reason: object) -> None:
        """It has failed: wait before the next try."""
        self.state = f"down: {reason}"
        self._retry_at_s = self._clock_s() + self._pause_s
        self._pause_s = min(2 * self._pause_s, LONGEST_PAUSE_S)

    def is_due(self) -> bool:
        """It is down, and the pause is over."""
        return self.state not in (UP, CLOSED) and self._clock_s() >= self._retry_at_s
