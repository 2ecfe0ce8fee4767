"""One hostile trial: a planner that means harm, a vehicle that is as bad as declared, and the guard between.

No bytes here: the guard is asked directly, thousands of times faster than through the whole companion.
"""

import math
from typing import Protocol

import numpy as np
from msgspec import Struct

from companion import reach
from companion.config import Config
from companion.instant import Instant, instant
from companion.messages import AutopilotHeartbeat, OwnState, Tracks
from companion.planning.guard import Guard, Intended, Velocity, Verdict
from companion.reach.kernel import Kernel, nearest
from sitl.closest import to_hulls
from sitl.studies.bad_vehicle import SIM_S, BadVehicle, Bodies
from sitl.studies.hostile import PlannerKind, hostile, intending
from sitl.studies.lanes_picture import Lanes

FAR_M = 9999.0
INTENDING = 0.5  # share of the planners that say what they intend
NEAR_M = 15.0  # nearer than this every simulated step is measured, else every step of the guard


class Ask(Protocol):
    """A guard as something to ask."""

    def __call__(
        self,
        now: Instant,
        own: OwnState,
        heartbeat: AutopilotHeartbeat,
        tracks: Tracks,
        wanted: Velocity | None,
        intended: Intended | None = None,
    ) -> Verdict:
        """What it says to one wanted velocity (NED, m/s), and to what is intended after it."""
        ...


class Outcome(Struct, frozen=True):
    """What came of a trial; distances are of the true position, metres, `FAR_M` where none was near."""

    closest_set_m: float
    closest_hull_m: float
    steps: int
    changed: int
    no_way_out: int
    viable: bool
    unforetold: bool = False  # whether a ship that left its bounds was told of


def asking(config: Config, kernel: Kernel = nearest) -> Ask:
    """The project's guard as something to ask."""
    guard = Guard(config, kernel)
    return lambda now, own, heartbeat, tracks, wanted, intended=None: guard.check(
        now, own, heartbeat, tracks, 1, wanted, intended
    )


def unguarded(
    now: Instant,  # noqa: ARG001 - asked like the guard
    own: OwnState,  # noqa: ARG001
    heartbeat: AutopilotHeartbeat,  # noqa: ARG001
    tracks: Tracks,  # noqa: ARG001
    wanted: Velocity | None,
    intended: Intended | None = None,  # noqa: ARG001
) -> Verdict:
    """No guard: what is wanted is flown, and what is no velocity is none."""
    flown = wanted if wanted is not None and all(map(math.isfinite, wanted)) else (0.0, 0.0, 0.0)
    return Verdict(flown, False, ())


def run_trial(
    config: Config,
    lanes: Lanes,
    planner: PlannerKind,
    rng: np.random.Generator,
    ask: Ask,
    duration_s: float,
    *,
    bodies: Bodies = "points",
    beside_m: float = 0.0,
) -> Outcome:
    """Fly one trial; a start from which the guard finds no way out is not viable and ends it at once.

    With `beside_m` the start is up to so far outside delta of a ship's set, and is flown, viable or not.
    """
    start_m = lanes.start_m(rng)
    if beside_m > 0:
        start_m = lanes.beside_m(rng, config.field.delta_m, beside_m)
    vehicle = BadVehicle(config, rng, start_m, bodies)
    plan = hostile(planner, rng, config.vehicle.max_speed_mps)
    intends = intending(rng, config.vehicle.max_speed_mps) if rng.random() < INTENDING else None
    period_s = 1.0 / config.timing.rate_hz
    closest_set = closest_hull = FAR_M
    changed = lost = 0
    steps = round(duration_s / period_s)
    sets_m = math.inf
    is_viable, unforetold = True, False
    for step in range(steps):
        t = step * period_s
        now = instant(t)
        tracks = lanes.tracks(t)
        own = vehicle.measured(now)
        beat = AutopilotHeartbeat(now, 1, 1, "ardupilot", "submarine", True, True, "GUIDED")
        wanted = plan(t, own, tracks, now) if step else (0.0, 0.0, 0.0)
        verdict = ask(now, own, beat, tracks, wanted, intends and intends(now, own))
        if not step:
            is_viable = viable(config, vehicle, tracks)
            if not is_viable and beside_m == 0:
                return Outcome(FAR_M, FAR_M, 0, 0, 0, viable=False)
        unforetold |= any(reason.code == "guard.report_unforetold" for reason in verdict.reasons)
        changed += verdict.changed
        lost += not verdict.way_out
        assert verdict.velocity_ned_mps is not None
        vehicle.send(t, verdict.velocity_ned_mps)
        for k in range(round(period_s / SIM_S)):
            at_s, here = t + k * SIM_S, vehicle.true_m
            if sets_m < NEAR_M or k == 0:
                sets_m = float(reach.at(tracks, instant(at_s)).nearest(here).distance_m.min())
                closest_set = min(closest_set, sets_m)
            if sets_m < NEAR_M or lanes.has_broken(at_s):  # a ship out of bounds is near no set of its own
                closest_hull = min(closest_hull, float(to_hulls(lanes.truth(at_s), here).min()))
            vehicle.move(at_s)
    return Outcome(closest_set, closest_hull, steps, changed, lost, is_viable, unforetold)


def viable(config: Config, vehicle: BadVehicle, tracks: Tracks) -> bool:
    """Whether the guard finds a way out from the start: the same starts for whatever is compared."""
    own = vehicle.measured(instant(0.0))
    beat = AutopilotHeartbeat(own.stamp, 1, 1, "ardupilot", "submarine", True, True, "GUIDED")
    return Guard(config).check(own.stamp, own, beat, tracks, 1, (0.0, 0.0, 0.0)).way_out
