"""The paper's crossing as data: every number of the paper, and every reading of what it leaves open.

The vehicle starts `before_m` before the channel's near edge and crosses to the goal `beyond_m` after its
far edge.  Its local frame: north along the channel, east across it, the origin on the near edge.
"""

import math
from typing import Annotated, Literal

from msgspec import Meta

from companion.config import Config, NonNegative, Positive, Section, from_mapping
from companion.planning.field import SINGULAR_GAP_M
from sitl.traffic import NoiseKind


class Readings(Section, frozen=True):
    """What the paper leaves open; the defaults are the readings that give its figures.

    `ships`: "convoy" (`per_lane` ships a lane, the middle one meets the vehicle) or "stream" (lanes
    without end).  `attraction`: "unit" (K_p whatever the distance) or "proportional" (eq. (5) to the
    letter).  `obstacle`: the set of the ship's "hull" or of its "centre".  `horizon` of the paper's
    planners: the "tube" from now to the report's time plus T, or the "slice" at this moment; "per-ship"
    until the vehicle has cleared that ship.  `noise` of the true ships: "constant" (a corner of the bounds
    for ever, the worst case), "interval" (uniform, new every 10 s), "white" (new every 0.1 s), "none".
    `vehicle`: "integrator" (the paper's safety discussion), "lag" (lag of the speed, limited turn rate) or
    "sitl" (the bundled vehicle and autopilot through encoded bytes, with guard).
    """

    ships: Literal["convoy", "stream"] = "convoy"
    attraction: Literal["unit", "proportional"] = "unit"
    obstacle: Literal["hull", "centre"] = "hull"
    horizon: Literal["tube", "slice", "per-ship"] = "tube"
    noise: NoiseKind = "constant"
    vehicle: Literal["integrator", "lag", "sitl"] = "integrator"


class Crossing(Section, frozen=True):
    """The case study in numbers; times count from the scenario's start.

    The middle ship of each lane passes the crossing line `meets_s` after the reports, shifted by up to
    `spread_m` along the lane, drawn for each lane from the trial's seed: half a spacing either way.
    `information_age_s` is how old the reports are already when the vehicle leaves (the paper: 0).
    """

    readings: Readings = Readings()
    channel_m: Positive = 230.0
    lanes_m: tuple[float, float] = (57.5, 172.5)  # from the near edge; ships keep to the right
    before_m: NonNegative = 500.0
    beyond_m: NonNegative = 500.0
    per_lane: Annotated[int, Meta(ge=1, le=50)] = 5
    ship_speed_mps: Positive = 5.0
    speed_noise_mps: NonNegative = 0.05
    course_noise_rad: Annotated[float, Meta(ge=0, lt=0.5)] = 0.01
    length_m: Positive = 75.0
    beam_m: Positive = 25.0
    gap_m: Positive = 375.0
    meets_s: float = 70.0
    spread_m: NonNegative = 225.0
    information_s: NonNegative = 190.0
    information_age_s: NonNegative = 0.0
    max_speed_mps: Positive = 2.5
    max_turn_rate_radps: Positive = 0.2
    speed_lag_s: Positive = 2.0
    cruise_depth_m: NonNegative = 45.0
    sink_mps: Positive = 0.5
    draught_m: Positive = 8.0
    goal_radius_m: Positive = 15.0
    time_limit_s: Positive = 1200.0
    dt_s: Positive = 0.1
    same_way: bool = False  # both lanes sail north
    singular_gap_m: Positive = SINGULAR_GAP_M  # the exact field saturates this far outside delta
    model: str = "straight"  # the network
    scenario: str = "uuv_crossing"  # the bundled one that is sailed through bytes
    delta_m: Positive = 5.0
    horizon_s: Positive = 600.0
    k_p: Positive = 5.0
    k_r: Positive = 15000.0

    @property
    def spacing_m(self) -> float:
        """From bow to bow."""
        return self.length_m + self.gap_m

    @property
    def start_m(self) -> tuple[float, float]:
        """North and east of the start."""
        return 0.0, -self.before_m

    @property
    def goal_m(self) -> tuple[float, float]:
        """North and east of the goal."""
        return 0.0, self.channel_m + self.beyond_m

    @property
    def under_way_s(self) -> float:
        """How long a trial may last after the reports came."""
        return self.time_limit_s - self.information_s

    def settings(self, planner: dict[str, object], *, slices: bool = False) -> Config:
        """The companion's configuration for this case; `slices`: the sets at this moment, no tubes."""
        r = self.readings
        tables: dict[str, object] = {
            "goal": {"latitude_deg": 0.0, "longitude_deg": 0.0, "radius_m": self.goal_radius_m},
            "vehicle": {
                "max_speed_mps": self.max_speed_mps,
                "max_vertical_speed_mps": self.sink_mps,
                "cruise_depth_m": self.cruise_depth_m,
                "max_depth_m": max(self.cruise_depth_m, 60.0),
            },
            "contacts": {
                "speed_noise_mps": self.speed_noise_mps,
                "course_noise_rad": self.course_noise_rad,
                "validity_s": 1e6,  # the paper's ships keep their bounds for ever
            },
            "field": {
                "delta_m": self.delta_m,
                "horizon_s": 1e-6 if slices else self.horizon_s,
                "k_p": self.k_p,
                "k_r": self.k_r,
                "attraction": r.attraction,
            },
            "planner": planner,
            "repulsion": {"turning_model": ""},  # these ships keep their course
            "timing": {"rate_hz": 1.0 / self.dt_s, "setpoint_validity_s": max(0.5, 2 * self.dt_s)},
        }
        return from_mapping(tables, "study")

    def depth_m(self, since_information_s: float) -> float:
        """How deep the vehicle is: it dives at once and stays down until the goal."""
        return min(self.sink_mps * since_information_s, self.cruise_depth_m)

    def lane_course_rad(self, lane: int) -> float:
        """The near lane sails south, the far lane north, as the bundled scenario has it."""
        return 0.0 if self.same_way else math.pi * (1 - lane)
