"""From repulsions and goal to the wanted velocity: eq. (10) of the paper, plus what a vehicle needs.

    u = attraction + sum_i repulsion_i          shortened to the vehicle's full speed

Depth is held beside it: the vertical velocity closes on the phase's depth.

`push` and `horizontal` also take m vehicles at once, each among its own ships: the rows of the tracks
are then the ships of the first vehicle, of the second and so on, equally many for each.
"""

from typing import Protocol

import numpy as np

from companion.config import Config
from companion.instant import Instant
from companion.messages import FloatArray, OwnState, Phase, Repulsion, Tracks
from companion.planning.attraction import attraction
from companion.planning.creep import creep
from companion.planning.horizon import Corridors, paper_until_age_s

DEPTH_GAIN_PER_S = 0.5
HOLD_GAIN_PER_S = 0.2


class RepulsionField(Protocol):
    """Each contact's repulsion, by the network or by the exact sets."""

    def __call__(
        self, tracks: Tracks, now: Instant, until_age_s: FloatArray, position_m: FloatArray
    ) -> Repulsion:
        """Repulsion of every contact's tube [age, until_age_s (n,)] on `position_m` (2,)."""
        ...


class Steering:
    """The planner: its constants, and what it keeps of the newest tracks."""

    def __init__(self, config: Config, repulsion: RepulsionField) -> None:
        self._config = config
        self._repulsion = repulsion
        self._corridors = Corridors()

    def repulsion(self, tracks: Tracks, now: Instant, own: OwnState, goal_m: FloatArray) -> Repulsion | None:
        """What pushes the vehicle; None on an empty picture."""
        return self.push(tracks, now, own.position_m, goal_m) if len(tracks) else None

    def push(self, tracks: Tracks, now: Instant, position_m: FloatArray, goal_m: FloatArray) -> Repulsion:
        """Every ship's repulsion on the position (2,), or on one position per ship (n, 2); goals alike."""
        config = self._config
        if config.planner.horizon == "paper":
            until = paper_until_age_s(tracks, config.field)
        else:
            until = self._corridors.clearing_until_age_s(
                tracks, now, position_m, goal_m, config.vehicle.max_speed_mps, config.field, config.planner
            )
        return self._repulsion(tracks, now, until, position_m)

    def attraction(self, own: OwnState, goal_m: FloatArray, phase: Phase) -> FloatArray:
        """(2,) the pull: toward the goal under way, gently onto it at the end, none while listening."""
        return self.pull(own.position_m, goal_m, phase)

    def pull(self, position_m: FloatArray, goal_m: FloatArray, phase: Phase) -> FloatArray:
        """The same for a position (2,) or for many (m, 2)."""
        if phase is Phase.CROSS:
            return attraction(position_m, goal_m, self._config.field.k_p, self._config.field.attraction)
        if phase in (Phase.RISE, Phase.SURFACE, Phase.ARRIVED):
            return HOLD_GAIN_PER_S * (goal_m - position_m)
        return np.zeros(position_m.shape)

    def velocity(
        self, own: OwnState, tracks: Tracks, pull: FloatArray, push: Repulsion | None, target_depth_m: float
    ) -> tuple[float, float, float]:
        """NED velocity, at most the vehicle's full speed."""
        vehicle = self._config.vehicle
        u = pull if push is None else self.horizontal(tracks, pull, push)
        speed = float(np.hypot(u[0], u[1]))
        if speed > vehicle.max_speed_mps:
            u = u * (vehicle.max_speed_mps / speed)
        u = creep(u, own, vehicle)
        limit = vehicle.max_vertical_speed_mps
        down = min(max(DEPTH_GAIN_PER_S * (target_depth_m - own.depth_m), -limit), limit)
        return float(u[0]), float(u[1]), down

    def horizontal(self, tracks: Tracks, pull: FloatArray, push: Repulsion) -> FloatArray:
        """Attraction and repulsions together, not limited yet: (2,), or (m, 2) for m vehicles."""
        u = pull + _total(push.velocity, pull)
        if self._config.planner.horizon == "clearing":
            u = u + self._config.planner.astern_gain * _total(
                _astern(self._corridors.courses(tracks), push), pull
            )
        return u


def _total(per_ship: FloatArray, pull: FloatArray) -> FloatArray:
    """The sum over each vehicle's ships, in the shape of `pull`."""
    total: FloatArray = per_ship.sum(axis=0) if pull.ndim == 1 else per_ship.reshape(len(pull), -1, 2).sum(1)
    return total


def _astern(course: FloatArray, push: Repulsion) -> FloatArray:
    """(n, 2) the repulsions turned a quarter toward each ship's stern: passes behind, not ahead."""
    away = push.nearest.away
    tangent = np.column_stack((-away[:, 1], away[:, 0]))
    side = -np.sign((tangent * course).sum(axis=1))
    strength = np.hypot(push.velocity[:, 0], push.velocity[:, 1])
    turned: FloatArray = (side * strength)[:, None] * tangent
    return turned
