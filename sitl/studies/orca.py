"""A rival: ORCA (pyrvo) on the prediction every chart plotter shows, course and speed as reported.

Every ship is a disc that holds its hull and delta, at its reported position plus age times velocity, going
on as reported.  ORCA expects others to do half of the avoiding; ships do none.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from companion.errors import ConfigError
from companion.instant import Instant
from companion.messages import FloatArray, IntArray, Tracks
from companion.reach.shapes import only
from sitl.studies.case import Crossing
from sitl.studies.wish import Wish

HORIZON_S = 60.0  # how far ahead it looks
NEIGHBOURS_M = 600.0
PERIOD_S = 0.5  # how often it decides; in between it holds its velocity


@dataclass(frozen=True, slots=True)
class Orca:
    """One simulator a vehicle: agent 0 is the vehicle, the others are its ships."""

    case: Crossing
    tracks: Tracks
    simulators: tuple[Any, ...]
    held: FloatArray  # (m, 2) the velocities decided last

    @classmethod
    def of(cls, case: Crossing, tracks: Tracks, vehicles: int) -> "Orca":
        """Raises `ConfigError` without pyrvo."""
        try:
            import pyrvo  # noqa: PLC0415 - an extra
        except ImportError:
            raise ConfigError(
                '--planners orca needs pyrvo: pip install "companion[study]", or leave it out of --planners'
            ) from None
        k = len(tracks) // vehicles
        hull_m = np.hypot(
            np.maximum(tracks.bow_m, tracks.stern_m), np.maximum(tracks.port_m, tracks.starboard_m)
        )
        made = []
        for v in range(vehicles):
            simulator = pyrvo.RVOSimulator(
                PERIOD_S, NEIGHBOURS_M, k, HORIZON_S, HORIZON_S, 0.0, case.max_speed_mps
            )
            simulator.add_agent((0.0, 0.0))
            for i in range(v * k, (v + 1) * k):
                radius = float(hull_m[i]) + case.delta_m
                simulator.add_agent((0.0, 0.0), NEIGHBOURS_M, 0, HORIZON_S, HORIZON_S, radius, 20.0)
            made.append(simulator)
        return cls(case, tracks, tuple(made), np.zeros((vehicles, 2)))

    def only(self, vehicles: IntArray) -> "Orca":
        """For some of the vehicles."""
        k = len(self.tracks) // len(self.simulators)
        rows = (vehicles[:, None] * k + np.arange(k)).ravel()
        some = tuple(self.simulators[int(v)] for v in vehicles)
        return replace(self, tracks=only(self.tracks, rows), simulators=some, held=self.held[vehicles])

    def wish(self, now: Instant, position_m: FloatArray, velocity_mps: FloatArray) -> Wish:
        """See `Planner`."""
        m = len(self.simulators)
        if (now // round(self.case.dt_s * 1e9)) % max(round(PERIOD_S / self.case.dt_s), 1) == 0:
            self.held[:] = self._decide(now, position_m, velocity_mps)
        return Wish(self.held.copy(), np.ones(m, dtype=np.bool_))

    def _decide(self, now: Instant, position_m: FloatArray, velocity_mps: FloatArray) -> FloatArray:
        tracks = self.tracks
        k = len(tracks) // len(self.simulators)
        course = np.column_stack((np.cos(tracks.cog_rad), np.sin(tracks.cog_rad)))
        sails = tracks.sog_mps[:, None] * course
        place = np.column_stack((tracks.north_m, tracks.east_m)) + tracks.age_s(now)[:, None] * sails
        to_goal = np.array(self.case.goal_m) - position_m
        straight = self.case.max_speed_mps * to_goal / np.hypot(*to_goal.T)[:, None]
        decided = np.empty_like(position_m)
        for v, simulator in enumerate(self.simulators):
            simulator.set_agent_position(0, tuple(position_m[v].tolist()))
            simulator.set_agent_velocity(0, tuple(velocity_mps[v].tolist()))
            simulator.set_agent_pref_velocity(0, tuple(straight[v].tolist()))
            rows = slice(v * k, (v + 1) * k)
            ships = zip(place[rows].tolist(), sails[rows].tolist(), strict=True)
            for i, (where, goes) in enumerate(ships, start=1):
                simulator.set_agent_position(i, tuple(where))
                simulator.set_agent_velocity(i, tuple(goes))
                simulator.set_agent_pref_velocity(i, tuple(goes))
            simulator.do_step()
            velocity = simulator.get_agent_velocity(0)
            decided[v] = (velocity.x, velocity.y)
        return decided
