"""`companion study endurance`: six channels in a row, with reports only while surfaced."""

import argparse
import math
import shlex
import time
from functools import partial
from itertools import pairwise

import numpy as np
from msgspec import Struct

from companion.build import build
from companion.config import Config, from_mapping
from companion.geodesy import LocalFrame
from companion.instant import NS_PER_S, instant
from companion.loop import run as turn
from companion.messages import Decision, Hull, Phase
from sitl.autopilot import Autopilot
from sitl.lockstep import LockstepSea
from sitl.measure import Measure
from sitl.profiles import PROFILES
from sitl.sea import Finish, Sea
from sitl.studies.campaign import Campaign, local_executor
from sitl.studies.endurance_picture import draw
from sitl.studies.guard import TRACKING_M
from sitl.studies.lanes_picture import APART_M, HULL, LANES_M, SPEED_MPS, WIDTH_M
from sitl.traffic import Fleet, Noise, Ship
from sitl.vehicle import KinematicSubmarine

CHANNELS, EVERY_M = 6, 5000.0
FIRST_M = 2500.0
SHIPS = 16  # a lane, abreast of the vehicle at the pace it is expected to make
PACE_MPS = 2.0
LIMIT_S = 24_000.0
RATE_HZ = 2.0
DECIDED = "decided"
SEEN_EVERY_S = 10.0
START = LocalFrame(59.9, 19.2)
UTC_NS = 1_780_293_600 * NS_PER_S


class Row(Struct, frozen=True):
    """One policy's crossing; `way` is time (s), east (m) and depth (m) every ten seconds."""

    policy: str
    arrived: bool
    time_s: float
    surfacings: int
    oldest_s: float
    nearest_set_m: float
    nearest_hull_m: float
    guard_changed: float
    way: list[tuple[float, float, float]]


def sea(seed: int, channels: int) -> Sea:
    """The vehicle at the surface, `channels` two-lane channels to its east."""
    rng = np.random.default_rng(seed)
    hull = Hull(*HULL)
    ships: list[Ship] = []
    for channel in range(channels):
        near = FIRST_M + channel * EVERY_M
        for lane, course in zip(LANES_M, (math.pi, 0.0), strict=True):
            at_s, shift = (near + lane) / PACE_MPS, rng.uniform(-APART_M / 2, APART_M / 2)
            for k in range(SHIPS):
                along = ((SHIPS - 1) / 2 - k) * APART_M + shift - SPEED_MPS * at_s
                number = len(ships)
                ships.append(
                    Ship(
                        mmsi=230_000_001 + number,
                        name=f"C{channel + 1} {k + 1}",
                        north_m=along * math.cos(course),
                        east_m=near + lane,
                        course_rad=course,
                        speed_mps=4.99,
                        hull=hull,
                    )
                )
    begin, end = instant(-400.0), instant(LIMIT_S)
    fleet = Fleet(tuple(ships), Noise(), rng, START, utc_ns_at_zero=UTC_NS, begin=begin, end=end)
    dynamics = KinematicSubmarine()
    autopilot = Autopilot(
        PROFILES["sub"], frame=START, home_m=(0.0, 0.0), utc_ns_at_zero=UTC_NS, boot=instant(-30.0)
    )
    goal = (0.0, FIRST_M + (channels - 1) * EVERY_M + WIDTH_M + FIRST_M)
    return Sea(
        frame=START,
        traffic=fleet,
        dynamics=dynamics,
        start=dynamics.start(0.0, 0.0, 0.0, math.pi / 2),
        autopilot=autopilot,
        finish=Finish(goal, 15.0, 1.0, instant(LIMIT_S)),
        utc_ns_at_zero=UTC_NS,
        antenna_height_m=1.0,
        receiver_on_s=400.0,
    )


def configuration(goal_deg: tuple[float, float], every_s: float) -> Config:
    """The UUV case's bounds; reports are believed for 900 s."""
    return from_mapping(
        {
            "goal": {"latitude_deg": goal_deg[0], "longitude_deg": goal_deg[1]},
            "contacts": {
                "speed_noise_mps": 0.05,
                "course_noise_rad": 0.01,
                "position_error_m": 1.0,
                "coarse_position_error_m": 1.0,
                "heading_error_rad": 0.02,
                "validity_s": 900.0,
            },
            "guard": {"tracking_error_m": TRACKING_M["submarine"]},
            "repulsion": {"kind": "exact"},
            "surfacing": {"every_s": every_s},
            "timing": {"rate_hz": RATE_HZ, "setpoint_validity_s": 1.5},
        }
    )


def cross(every_s: float, seed: int, channels: int) -> Row:
    """One crossing of them all, surfacing every so many seconds; 0 decides."""
    world = sea(seed, channels)
    config = configuration(world.goal_deg, every_s)
    companion = build(config)
    measure = Measure(world.truth, world.own_state, config.field.delta_m)
    seen = _Seen(measure)
    lockstep = LockstepSea(world, dt_s=1.0 / RATE_HZ)
    turn(lockstep, companion.core, companion.encoder, lockstep, seen, time.perf_counter)
    summary = measure.summary(measure.course())
    return Row(
        policy=f"every {every_s:g} s" if every_s else DECIDED,
        arrived=summary.arrived,
        time_s=summary.run_s,
        surfacings=seen.surfacings,
        oldest_s=summary.oldest_used_s or 0.0,
        nearest_set_m=math.inf if summary.closest_set is None else summary.closest_set.distance_m,
        nearest_hull_m=math.inf if summary.closest_hull is None else summary.closest_hull.distance_m,
        guard_changed=summary.guard.share,
        way=seen.way,
    )


class _Seen:
    """A journal that counts how often the vehicle came up to listen, and keeps its way."""

    def __init__(self, measure: Measure) -> None:
        self._measure = measure
        self._phases: list[Phase] = []
        self.way: list[tuple[float, float, float]] = []
        self.tick, self.sent, self.timed = measure.tick, measure.sent, measure.timed

    def decided(self, decision: Decision) -> None:
        """Keep the phase, and let the decision be measured."""
        self._phases.append(decision.phase)
        self._measure.decided(decision)
        own, t_s = decision.own, decision.t * 1e-9
        if own is not None and (not self.way or t_s >= self.way[-1][0] + SEEN_EVERY_S):
            self.way.append((t_s, own.east_m, own.depth_m))

    @property
    def surfacings(self) -> int:
        """Begun on the way."""
        return sum(a is Phase.RISE and b is Phase.LISTEN for a, b in pairwise(self._phases))


def _crossed(seed: int, channels: int, every_s: float) -> list[Row]:
    return [cross(every_s, seed, channels)]


def run(options: argparse.Namespace) -> int:
    """The table, and 1 when deciding did not arrive or came within delta of a set."""
    for every_s in options.every:
        configuration((0.0, 0.0), every_s)  # one that cannot be is refused before the others are sailed
    work = partial(_crossed, options.seed, options.channels)
    identity = {"study": "endurance", "seed": options.seed, "channels": options.channels}
    campaign: Campaign[float, Row] = Campaign(options.out, identity, float, Row)
    rows = campaign.run(work, [0.0, *options.every], local_executor(1))
    command = shlex.join(("companion", *options.said))
    text = (
        f"# Channels in a row: {options.channels}\n\n    {command}\n\n"
        "| surfacing | arrived | time (s) | surfacings | oldest information used (s) "
        "| nearest set (m) | nearest hull (m) | guard changed |\n"
        "| --- | --- | --- | --- | --- | --- | --- | --- |\n"
    )
    for r in rows:
        text += (
            f"| {r.policy} | {'yes' if r.arrived else 'no'} | {r.time_s:.0f} | {r.surfacings} "
            f"| {r.oldest_s:.0f} | {r.nearest_set_m:.1f} | {r.nearest_hull_m:.1f} | {r.guard_changed:.2%} |\n"
        )
    ways = {f"{r.policy}: {r.surfacings} surfacings": r.way for r in rows}
    draw(options.out / "surfacings.png", ways, [FIRST_M + k * EVERY_M for k in range(options.channels)])
    (options.out / "table.md").write_text(text, encoding="utf-8")
    print(text)
    delta_m = configuration((0.0, 0.0), 0.0).field.delta_m
    good = all(r.arrived and r.nearest_set_m >= delta_m for r in rows if r.policy == DECIDED)
    return 0 if good else 1
