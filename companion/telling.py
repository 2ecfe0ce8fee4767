"""What is said and when: our heartbeat, the setpoint, commands, and reasons for the ground station."""

from companion.instant import Instant, after, elapsed_s
from companion.messages import Command, Heartbeat, Outgoing, Reason, Setpoint, Status, StatusText

HEARTBEAT_S = 1.0
STATUSTEXT_REPEAT_S = 30.0
MOST_STATUSTEXTS = 3  # a step never floods the link
WARNING = 4  # MAV_SEVERITY
NOTE = "note."  # reasons that inform and do not degrade; told once


def degrades(reason: Reason) -> bool:
    """Whether a reason makes a decision doubtful."""
    return not reason.code.startswith(NOTE)


class Telling:
    """Keeps when the next heartbeat is due and what was told already."""

    def __init__(self) -> None:
        self._heartbeat_due: Instant | None = None
        self._told: dict[str, Instant] = {}

    def is_heartbeat_due(self, now: Instant) -> bool:
        """Whether the heartbeat goes out with this step."""
        return self._heartbeat_due is None or now >= self._heartbeat_due

    def heartbeat(self, now: Instant, status: Status) -> list[Outgoing]:
        """The heartbeat if it is due; the next is due a second after this one was, however late the tick."""
        if not self.is_heartbeat_due(now):
            return []
        planned = after(self._heartbeat_due or now, HEARTBEAT_S)
        self._heartbeat_due = planned if planned > now else after(now, HEARTBEAT_S)
        return [Heartbeat(status)]

    def texts(self, now: Instant, reasons: list[Reason]) -> list[StatusText]:
        """New reasons for the ground station, doubts again after a while."""
        texts: list[StatusText] = []
        for reason in reasons:
            last = self._told.get(reason.code)
            again = degrades(reason) and (last is None or elapsed_s(last, now) > STATUSTEXT_REPEAT_S)
            if len(texts) < MOST_STATUSTEXTS and (last is None or again):
                self._told[reason.code] = now
                texts.append(StatusText(WARNING, reason.text))
        return texts


def in_order(
    heartbeat: list[Outgoing],
    setpoint: Setpoint | None,
    commands: list[Command],
    texts: list[StatusText],
) -> tuple[Outgoing, ...]:
    """The setpoint goes before everything that may wait."""
    return (*heartbeat, *([] if setpoint is None else [setpoint]), *commands, *texts)
