"""Asks the autopilot for the streams we live by, one at a time, until it answers.

ArduPilot sends AIS_VESSEL only on request (MAV_CMD_SET_MESSAGE_INTERVAL), and its
acknowledgement names the command, not the message: so one request is open at a time.
"""

from companion.instant import Instant, elapsed_s
from companion.messages import Command, CommandAck, Reason

SET_MESSAGE_INTERVAL = 511  # MAV_CMD_SET_MESSAGE_INTERVAL
ACCEPTED = 0  # MAV_RESULT_ACCEPTED
RETRY_S = 1.0
MOST_TRIES = 5

# message id, interval in microseconds: 10 Hz for what the loop steers by
WANTED = (
    (33, 100_000),  # GLOBAL_POSITION_INT
    (32, 100_000),  # LOCAL_POSITION_NED
    (30, 100_000),  # ATTITUDE
    (2, 1_000_000),  # SYSTEM_TIME
    (301, 100_000),  # AIS_VESSEL: each interval carries one vessel
    (49, 10_000_000),  # GPS_GLOBAL_ORIGIN: where LOCAL_POSITION_NED counts from
)


class MessageRequests:
    """The open request, if any."""

    def __init__(self) -> None:
        self._next = 0
        self._tries = 0
        self._asked_at: Instant | None = None
        self.refused: tuple[int, ...] = ()

    def observe_ack(self, ack: CommandAck) -> None:
        """An answer to the open request closes it."""
        if ack.command != SET_MESSAGE_INTERVAL or self._asked_at is None or self._next >= len(WANTED):
            return
        if ack.result != ACCEPTED:
            self.refused = (*self.refused, WANTED[self._next][0])
        self._step()

    def notes(self) -> list[Reason]:
        """The streams that were refused or never answered."""
        if not self.refused:
            return []
        listed = ", ".join(str(message) for message in self.refused)
        return [Reason("note.streams_refused", f"autopilot does not stream message {listed} on request")]

    def due(self, now: Instant) -> Command | None:
        """The request to send now, if one is due."""
        if self._next >= len(WANTED):
            return None
        if self._asked_at is not None and elapsed_s(self._asked_at, now) < RETRY_S:
            return None
        if self._tries >= MOST_TRIES:
            self.refused = (*self.refused, WANTED[self._next][0])
            self._step()
            return self.due(now)
        self._asked_at = now
        self._tries += 1
        message, interval_us = WANTED[self._next]
        return Command(SET_MESSAGE_INTERVAL, (float(message), float(interval_us), 0.0, 0.0, 0.0, 0.0, 0.0))

    def _step(self) -> None:
        self._next, self._tries, self._asked_at = self._next + 1, 0, None
