"""Where a command takes the vehicle: its model rolled out, one command held or many headings at once.

The model: the heading turns at a limited rate toward the commanded direction, the forward speed lags
toward the commanded speed's share along the hull, and what the vehicle moves aside dies out with the
same lag.  Speeds are over ground: its autopilot steers against the current.  What a real vehicle does
otherwise (current, delay, other dynamics) is covered by the declared tracking error, and watched.
"""

import math
from dataclasses import dataclass

import numpy as np

from companion.config import Vehicle
from companion.messages import FloatArray, OwnState

FINE_S = 0.5  # step while it may turn
COARSE_S = 2.0
COARSER_S = 4.0  # from COARSE_UNTIL_S on
COARSE_UNTIL_S = 120.0
EVERY_UNTIL_S = 3.0  # so long every fine step is a point of the path
HELD_STEP_S = 0.25
STILL_MPS = 0.05  # a slower command gives no direction to turn to
MOVING_MPS = 0.3  # a faster vehicle tells its heading by its motion


@dataclass(frozen=True, slots=True)
class Motion:
    """Position, heading, forward speed and sideways velocity over ground."""

    north_m: float
    east_m: float
    heading_rad: float
    forward_mps: float
    aside_north_mps: float = 0.0
    aside_east_mps: float = 0.0

    @property
    def velocity_mps(self) -> tuple[float, float]:
        """North and east over ground."""
        return (
            self.forward_mps * math.cos(self.heading_rad) + self.aside_north_mps,
            self.forward_mps * math.sin(self.heading_rad) + self.aside_east_mps,
        )


def motion_of(own: OwnState, age_s: float, toward_rad: float) -> Motion:
    """The vehicle now, from a state `age_s` old.

    Without heading it is taken to lie along its motion, or, at rest, opposite to `toward_rad`.
    """
    north_mps, east_mps, _ = own.velocity_ned_mps
    heading = own.heading_rad
    if heading is None or not math.isfinite(heading):
        moving = math.hypot(north_mps, east_mps) > MOVING_MPS
        heading = math.atan2(east_mps, north_mps) if moving else toward_rad + math.pi
    cos, sin = math.cos(heading), math.sin(heading)
    forward = max(north_mps * cos + east_mps * sin, 0.0)
    return Motion(
        own.north_m + north_mps * age_s,
        own.east_m + east_mps * age_s,
        heading,
        forward,
        north_mps - forward * cos,
        east_mps - forward * sin,
    )


def held(start: Motion, command: tuple[float, float], duration_s: float, vehicle: Vehicle) -> list[Motion]:
    """The motion after each of a few equal steps of holding one velocity (north, east)."""
    steps = max(math.ceil(duration_s / HELD_STEP_S - 1e-9), 1)
    out: list[Motion] = []
    for _ in range(steps):
        out.append(moved(out[-1] if out else start, command, duration_s / steps, vehicle))
    return out


def moved(m: Motion, command: tuple[float, float], dt: float, vehicle: Vehicle) -> Motion:
    """The motion after one short step `dt` (s) of holding one velocity (north, east)."""
    rate, lag = vehicle.max_turn_rate_radps, vehicle.speed_lag_s
    speed = math.hypot(*command)
    share = -math.expm1(-dt / lag)
    toward = math.atan2(command[1], command[0]) if speed > STILL_MPS else m.heading_rad
    error = math.remainder(toward - m.heading_rad, 2 * math.pi)
    turn = min(max(error, -rate * dt), rate * dt)
    target = speed * max(math.cos(error - turn), 0.0)
    run = target * dt + (m.forward_mps - target) * lag * share
    along = m.heading_rad + 0.5 * turn
    return Motion(
        m.north_m + run * math.cos(along) + m.aside_north_mps * lag * share,
        m.east_m + run * math.sin(along) + m.aside_east_mps * lag * share,
        m.heading_rad + turn,
        m.forward_mps + (target - m.forward_mps) * share,
        m.aside_north_mps * (1 - share),
        m.aside_east_mps * (1 - share),
    )


class Runner:
    """Rolls out runs in C directions from one motion, all at once, on one grid of times.

    `t_s` (T,) seconds since the run began: fine while the vehicle may be turning, then coarser, up to
    `length_s`.
    """

    def __init__(self, vehicle: Vehicle, length_s: float) -> None:
        self._rate, self._lag = vehicle.max_turn_rate_radps, vehicle.speed_lag_s
        self.turn_s = math.pi / self._rate  # half a circle
        fine = max(math.ceil(self.turn_s / FINE_S), 2)
        k = np.arange(fine)
        self._decay = math.exp(-FINE_S / self._lag)
        # s_k = decay^(k+1) s_0 + (1 - decay) sum over i <= k of decay^(k-i) u_i
        powers = np.where(k[:, None] >= k, self._decay ** np.maximum(k[:, None] - k, 0), 0.0)
        self._filter = ((1 - self._decay) * powers).T
        self._fading = self._decay ** (k + 1)
        self._turned_s = FINE_S * (k + 1)
        end_s = fine * FINE_S
        coarse_end = max(min(length_s, COARSE_UNTIL_S), end_s)
        coarse = np.arange(end_s + COARSE_S, coarse_end + 1e-9, COARSE_S)
        last = coarse[-1] if len(coarse) else end_s
        coarser = np.arange(last + COARSER_S, length_s + 1e-9, COARSER_S)
        self._straight_s = np.concatenate((coarse, coarser)) - end_s
        # of the fine steps every other is enough to check, once speed and heading change no faster
        t = np.concatenate((np.zeros(1), self._turned_s, coarse, coarser))
        self._kept = np.flatnonzero((t <= EVERY_UNTIL_S) | (t >= end_s) | (np.arange(len(t)) % 2 == 0))
        self.t_s = t[self._kept]
        self._all_s = t

    def heading_rad(
        self, start: Motion, direction_rad: float, speed_mps: float, t_s: float, *, turned: bool = False
    ) -> float:
        """The heading `t_s` into one such run."""
        if speed_mps <= STILL_MPS:
            return start.heading_rad
        if turned:
            return direction_rad
        error = math.remainder(direction_rad - start.heading_rad, 2 * math.pi)
        return start.heading_rad + min(max(error, -self._rate * t_s), self._rate * t_s)

    def paths(
        self, start: Motion, direction_rad: FloatArray, speed_mps: FloatArray, *, turned: bool = False
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """North (C, T), east (C, T) and speed (C, T) of runs in `direction_rad` (C,) at `speed_mps` (C,).

        `turned`: the vehicle lies along each run before it begins, whatever the start's heading.
        """
        moves = speed_mps > STILL_MPS
        heading = np.where(moves & turned, direction_rad, start.heading_rad)[:, None]
        error = np.remainder(direction_rad[:, None] - heading + np.pi, 2 * np.pi) - np.pi
        error = np.where(moves[:, None], error, 0.0)
        before = np.sign(error) * np.minimum(
            np.abs(error), self._rate * (self._turned_s - FINE_S)
        )  # turned at the step's begin
        after = np.sign(error) * np.minimum(np.abs(error), self._rate * self._turned_s)
        target = speed_mps[:, None] * np.maximum(np.cos(error - after), 0.0)
        speed = start.forward_mps * self._fading + target @ self._filter
        begin = np.empty_like(speed)
        begin[:, 0], begin[:, 1:] = start.forward_mps, speed[:, :-1]
        run = target * FINE_S + (begin - target) * (self._lag * (1 - self._decay))
        along = heading + 0.5 * (before + after)
        turned_north, turned_east = np.cumsum(run * np.cos(along), axis=1), np.cumsum(run * np.sin(along), 1)
        # straight on from there
        final = heading + error
        fade = self._lag * -np.expm1(-self._straight_s / self._lag)
        far = speed_mps[:, None] * self._straight_s + (speed[:, -1:] - speed_mps[:, None]) * fade
        late = speed_mps[:, None] + (speed[:, -1:] - speed_mps[:, None]) * np.exp(
            -self._straight_s / self._lag
        )
        zero = np.zeros((len(direction_rad), 1))
        aside = self._lag * -np.expm1(-self._all_s / self._lag)
        north = np.hstack((zero, turned_north, turned_north[:, -1:] + far * np.cos(final)))
        east = np.hstack((zero, turned_east, turned_east[:, -1:] + far * np.sin(final)))
        kept = self._kept
        return (
            (start.north_m + north + start.aside_north_mps * aside)[:, kept],
            (start.east_m + east + start.aside_east_mps * aside)[:, kept],
            np.hstack((zero + start.forward_mps, speed, late))[:, kept],
        )
