"""What is flown before a way out begins: what was sent, what is wanted, and perhaps a wait."""

import math
from dataclasses import dataclass

import numpy as np

from companion.config import Config
from companion.instant import Instant, elapsed_s
from companion.messages import FloatArray, OwnState
from companion.planning.guard.rollout import Motion, held, motion_of

WAITING_S = np.array((0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0))  # points while it comes to rest


@dataclass(frozen=True, slots=True)
class Beginning:
    """What is flown before a way out begins: times, north and east (P,), and the motion at its end."""

    t_s: FloatArray
    north_m: FloatArray
    east_m: FloatArray
    end_s: float
    end: Motion

    def waiting(self, wait_s: float, lag_s: float) -> "Beginning":
        """The same, and coming to rest for `wait_s` after it."""
        if wait_s <= 0:
            return self
        later = np.concatenate((np.zeros(1), WAITING_S, np.arange(12.0, wait_s, 4.0)))
        t = np.append(later[later < wait_s], wait_s)
        end, faded = self.end, np.exp(-t / lag_s)
        v_north, v_east = end.velocity_mps
        north, east = (
            end.north_m + v_north * lag_s * (1 - faded),
            end.east_m + v_east * lag_s * (1 - faded),
        )
        left = float(faded[-1])
        return Beginning(
            np.concatenate((self.t_s, self.end_s + t[:-1])),
            np.concatenate((self.north_m, north[:-1])),
            np.concatenate((self.east_m, east[:-1])),
            self.end_s + wait_s,
            Motion(
                float(north[-1]),
                float(east[-1]),
                end.heading_rad,
                end.forward_mps * left,
                end.aside_north_mps * left,
                end.aside_east_mps * left,
            ),
        )


def begin(
    now: Instant,
    own: OwnState,
    sent: tuple[float, float],
    command: tuple[float, float],
    period_s: float,
    config: Config,
) -> Beginning:
    """The velocity sent last for the setpoint delay, then `command` for `period_s`."""
    toward = math.atan2(command[1], command[0])
    motions = [motion_of(own, max(elapsed_s(own.stamp, now), 0.0), toward)]
    times = [0.0]
    for velocity, duration_s in ((sent, config.guard.setpoint_delay_s), (command, period_s)):
        if duration_s > 0:
            held_for = held(motions[-1], velocity, duration_s, config.vehicle)
            times += [times[-1] + duration_s * (k + 1) / len(held_for) for k in range(len(held_for))]
            motions += held_for
    before = motions[:-1]
    return Beginning(
        np.array(times[:-1]),
        np.array([m.north_m for m in before]),
        np.array([m.east_m for m in before]),
        times[-1],
        motions[-1],
    )
