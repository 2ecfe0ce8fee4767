"""What a person sees while the loop turns: one status line on a terminal, a line now and then elsewhere."""

import math
from collections.abc import Callable

from rich.console import Console
from rich.live import Live
from rich.text import Text

from companion.instant import Instant, elapsed_s
from companion.loop import Tick
from companion.messages import Decision, Status

REFRESH_S = 0.5  # of the run's time on a terminal
LINE_EVERY_S = 10.0  # elsewhere: a log file should stay readable
COLOURS = {Status.OK: "green", Status.DEGRADED: "yellow", Status.CLOSED: "red"}


class StatusLine:
    """A journal that keeps nothing but shows the newest decision."""

    def __init__(self, console: Console, troubles: Callable[[], list[str]] = list) -> None:
        """`troubles` names what is broken around the loop: a link that is down, a log that has stopped."""
        self._console = console
        self._troubles = troubles
        self._live = (
            Live(console=console, auto_refresh=False, transient=True) if console.is_terminal else None
        )
        self._shown_at: Instant | None = None
        self._said = ""

    def __enter__(self) -> "StatusLine":
        if self._live is not None:
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._live is not None:
            self._live.stop()

    def tick(self, tick: Tick) -> None:
        """Nothing to show."""

    def sent(self, t: Instant, data: bytes, expired: bool) -> None:
        """Nothing to show."""

    def timed(self, t: Instant, step_s: float) -> None:
        """Nothing to show."""

    def decided(self, decision: Decision) -> None:
        """Show the decision if it is time, and every new phase or reason at once."""
        troubles = self._troubles()
        headline = " ".join((decision.phase, decision.status, *(r.code for r in decision.reasons), *troubles))
        period_s = REFRESH_S if self._live is not None else LINE_EVERY_S
        due = self._shown_at is None or elapsed_s(self._shown_at, decision.t) >= period_s
        if not due and (self._live is not None or headline == self._said):
            return
        if not due and self._shown_at is not None and elapsed_s(self._shown_at, decision.t) < 1.0:
            return  # a flickering reason must not flood a log file
        self._shown_at, self._said = decision.t, headline
        line = status_text(decision)
        for trouble in troubles:
            line.append(f"  {trouble}", style="bold red")
        if self._live is not None:
            self._live.update(line, refresh=True)
        else:
            self._console.print(line, soft_wrap=True)


def status_text(decision: Decision) -> Text:
    """One line about one decision."""
    text = Text(f"{decision.t * 1e-9:9.1f} s  {decision.phase.value:8s}")
    text.append(f"{decision.status.value:9s}", style=COLOURS[decision.status])
    if decision.own is not None:
        text.append(f"depth {decision.own.depth_m:5.1f} m  ")
    text.append(f"{len(decision.tracks)} contacts  ")
    if decision.repulsion is not None and len(decision.tracks):
        text.append(f"nearest planned tube {decision.repulsion.nearest.distance_m.min():7.1f} m  ")
    if decision.setpoint is not None:
        north, east, _ = decision.setpoint.velocity_ned_mps
        heading_deg = math.degrees(math.atan2(east, north)) % 360
        text.append(f"{math.hypot(north, east):4.2f} m/s to {heading_deg:03.0f}  ")
    text.append("; ".join(reason.text for reason in decision.reasons[:3]), style="dim")
    return text
