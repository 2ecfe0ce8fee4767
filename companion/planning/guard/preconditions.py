"""What must hold before a single setpoint leaves: the guard starts closed."""

import math

from companion.config import Autopilot
from companion.instant import Instant, elapsed_s
from companion.messages import AutopilotHeartbeat, OwnState, Reason


class SteadyClock:
    """The source's clock, which only ever goes on: set back, it makes every age too young, for good."""

    def __init__(self) -> None:
        self._latest: Instant | None = None
        self._back_s = 0.0

    def missing(self, now: Instant) -> list[Reason]:
        """Why nothing can be dated any more, if so."""
        if self._latest is not None and now < self._latest:
            self._back_s += elapsed_s(now, self._latest)
        self._latest = now
        if self._back_s == 0:
            return []
        text = f"the clock was set back {self._back_s:.1f} s, no age can be trusted: restart the companion"
        return [Reason("guard.clock_set_back", text)]


def is_prestream(now: Instant, heartbeat: AutopilotHeartbeat | None, autopilot: Autopilot) -> bool:
    """PX4 outside OFFBOARD ignores setpoints but wants to see a stream before it admits the mode."""
    return (
        autopilot.prestream_offboard
        and heartbeat is not None
        and heartbeat.firmware == "px4"
        and not heartbeat.takes_setpoints
        and elapsed_s(heartbeat.stamp, now) <= autopilot.heartbeat_timeout_s
    )


def missing(
    now: Instant,
    own: OwnState | None,
    heartbeat: AutopilotHeartbeat | None,
    reports_heard: int,
    autopilot: Autopilot,
) -> list[Reason]:
    """Every precondition that does not hold; each closes the guard."""
    found = _of_the_autopilot(now, heartbeat, autopilot) + _of_the_position(now, own, autopilot)
    if not reports_heard:
        found.append(Reason("guard.no_report", "no contact report ever heard: that is not an empty sea"))
    return found


def _of_the_autopilot(
    now: Instant, heartbeat: AutopilotHeartbeat | None, autopilot: Autopilot
) -> list[Reason]:
    if heartbeat is None:
        return [Reason("guard.no_heartbeat", "no autopilot heartbeat heard yet")]
    found: list[Reason] = []
    silent_s = elapsed_s(heartbeat.stamp, now)
    if not 0 <= silent_s <= autopilot.heartbeat_timeout_s:
        found.append(Reason("guard.heartbeat_lost", f"no autopilot heartbeat for {silent_s:.1f} s"))
    if not heartbeat.armed:
        found.append(Reason("guard.disarmed", "vehicle is disarmed"))
    if not heartbeat.takes_setpoints:
        text = f"autopilot is in {heartbeat.mode}, not GUIDED or OFFBOARD: hands off"
        found.append(Reason("guard.mode", text))
    return found


def _of_the_position(now: Instant, own: OwnState | None, autopilot: Autopilot) -> list[Reason]:
    if own is None:
        return [Reason("guard.no_position", "no own position heard yet")]
    found: list[Reason] = []
    old_s = elapsed_s(own.stamp, now)
    if not 0 <= old_s <= autopilot.position_timeout_s:
        found.append(Reason("guard.position_lost", f"own position is {old_s:.1f} s old"))
    if not all(map(math.isfinite, (own.north_m, own.east_m, own.depth_m, *own.velocity_ned_mps))):
        found.append(Reason("guard.position_invalid", "own position is not a number"))
    return found
