"""A trial through everything: the bundled vehicle and autopilot, encoded bytes, picture and guard.

The case's bundled scenario with its convoys, drawn from the trial's seed so that they meet the vehicle as in
the study's own.  What is sent over the air is rounded as AIS rounds; sets have its margins.
"""

from typing import Any

import msgspec
import numpy as np

from companion.build import build
from companion.config import from_mapping
from companion.core import Core
from companion.errors import ConfigError
from companion.loop import run
from companion.messages import FloatArray
from sitl.launch import scenario_sea
from sitl.lockstep import LockstepSea
from sitl.measure import Measure
from sitl.scenario import Scenario, load
from sitl.sea import Sea
from sitl.studies.case import Crossing

OVER: dict[str, dict[str, dict[str, Any]]] = {
    "network": {"planner": {"horizon": "paper"}, "repulsion": {"kind": "network"}},
    "exact": {"planner": {"horizon": "paper"}, "repulsion": {"kind": "exact"}},
    "no-uncertainty": {
        "planner": {"horizon": "paper"},
        "repulsion": {"kind": "exact"},
        "contacts": {"speed_noise_mps": 0.0, "course_noise_rad": 0.0, "heading_error_rad": 0.0},
    },
    "improved": {"planner": {"horizon": "clearing"}, "repulsion": {"kind": "network"}},
    "improved-exact": {"planner": {"horizon": "clearing"}, "repulsion": {"kind": "exact"}},
}


class Run(msgspec.Struct, frozen=True):
    """What came of it; times since the vehicle left."""

    arrived: bool
    under_way_s: float | None
    to_set_m: float
    to_set_at_s: float
    to_hull_m: float
    vertical_m: float
    oldest_s: float | None


def scenario_of(case: Crossing) -> Scenario:
    """The bundled scenario with this case's numbers."""
    bundled = load(case.scenario)
    listens_s = float(bundled.companion["vehicle"]["listen_s"])
    ships = msgspec.structs.replace(
        bundled.ships,
        per_lane=case.per_lane,
        noise=case.readings.noise,
        meet_s=case.meets_s + listens_s,
        spread_m=case.spread_m,
    )
    vehicle = msgspec.structs.replace(bundled.vehicle, before_m=case.before_m)
    end = msgspec.structs.replace(bundled.end, beyond_m=case.beyond_m)
    channel = msgspec.structs.replace(bundled.channel, same_way=case.same_way)
    return msgspec.structs.replace(bundled, channel=channel, ships=ships, vehicle=vehicle, end=end)


def sail(case: Crossing, seed: int, trial: int, planner: str) -> Run:
    """One trial; raises `ConfigError` for what the whole line does not do."""
    if planner not in OVER or case.readings.ships != "convoy":
        raise ConfigError(
            f"--vehicle sitl: sails convoys, by one of {', '.join(OVER)}; "
            "give --planners and --ships so, or --vehicle lag"
        )
    scenario = scenario_of(case)
    sea = scenario_sea(scenario, seed=seed * 1_000_003 + trial)
    field = {"attraction": case.readings.attraction, "delta_m": case.delta_m, "horizon_s": case.horizon_s}
    repulsion = {**OVER[planner]["repulsion"], "model": case.model, "turning_model": ""}
    over = {**OVER[planner], "repulsion": repulsion, "field": {**field, "k_p": case.k_p, "k_r": case.k_r}}
    config = from_mapping(scenario.companion_tables(sea.goal_deg, over), "study")
    companion = build(config)
    measure = Measure(sea.truth, sea.own_state, config.field.delta_m, sea.traffic.known_until_s)
    lockstep = LockstepSea(sea, dt_s=1.0 / config.timing.rate_hz)
    run(lockstep, companion.core, companion.encoder, lockstep, measure, _no_clock)
    summary = measure.summary(measure.course(_origin_m(sea, companion.core)))
    near, hull = summary.closest_set, summary.closest_hull
    if near is None or hull is None:
        raise ConfigError("--vehicle sitl: no ship was heard; the scenario's ships must be within reach")
    return Run(
        arrived=summary.arrived,
        under_way_s=summary.under_way_s,
        to_set_m=near.distance_m,
        to_set_at_s=(near.at - summary.start) * 1e-9,
        to_hull_m=hull.distance_m,
        vertical_m=hull.vertical_clearance_m,
        oldest_s=summary.oldest_used_s,
    )


def _origin_m(sea: Sea, core: Core) -> FloatArray:
    """(2,) where the companion's local frame lies in the sea's: it begins where it first heard of itself."""
    frame = core.frame
    return (
        np.zeros(2)
        if frame is None
        else np.array(sea.frame.to_local(frame.latitude_deg, frame.longitude_deg))
    )


def _no_clock() -> float:
    return 0.0
