"""CPU time of one whole control step, from frames to the setpoint's bytes, and the guard's share of it.

    python -m tests.benchmarks.bench_step [SHIPS ...]          default 20 200 1000

A vehicle listens at the surface, dives, and crosses among ships without end; autopilot and receivers
send real bytes.  Timed apart: steps on which reports came, and steps in silence.  Not collected by pytest.
"""

import math
import sys
import time
from collections import defaultdict

import numpy as np

from companion.build import build
from companion.config import from_mapping
from companion.geodesy import LocalFrame
from companion.instant import NS_PER_S, instant
from companion.messages import Hull, Setpoint
from companion.planning.guard import Guard
from sitl.autopilot import Autopilot
from sitl.lockstep import LockstepSea
from sitl.profiles import PROFILES
from sitl.sea import Finish, Sea
from sitl.traffic import Fleet, Noise, Ship
from sitl.vehicle import KinematicSubmarine

START = LocalFrame(59.9, 19.2)
UTC_NS = 1_780_293_600 * NS_PER_S
KM2_PER_SHIP = 0.5  # the density is the same for any number of ships
LISTEN_S, LIMIT_S = 60.0, 300.0
RATE_HZ = 10.0


def sea(n: int, seed: int = 1) -> Sea:
    """`n` ships on two courses, in a square whose middle the vehicle crosses."""
    rng = np.random.default_rng(seed)
    half_m = 500.0 * math.sqrt(n * KM2_PER_SHIP)
    ships = tuple(
        Ship(
            mmsi=230_000_001 + k,
            name=f"S{k}",
            north_m=rng.uniform(-half_m, half_m),
            east_m=rng.uniform(-half_m, half_m),
            course_rad=rng.choice((0.0, math.pi)),
            speed_mps=5.0,
            hull=Hull(55.0, 20.0, 10.0, 15.0),
        )
        for k in range(n)
    )
    begin, end = instant(-400.0), instant(LIMIT_S)
    fleet = Fleet(ships, Noise(), rng, START, utc_ns_at_zero=UTC_NS, begin=begin, end=end)
    dynamics = KinematicSubmarine()
    autopilot = Autopilot(
        PROFILES["sub"], frame=START, home_m=(0.0, 0.0), utc_ns_at_zero=UTC_NS, boot=instant(-30.0)
    )
    return Sea(
        frame=START,
        traffic=fleet,
        dynamics=dynamics,
        start=dynamics.start(0.0, 0.0, 0.0, math.pi / 2),
        autopilot=autopilot,
        finish=Finish((0.0, 5000.0), 15.0, 1.0, instant(LIMIT_S)),
        utc_ns_at_zero=UTC_NS,
        antenna_height_m=1.0,
        receiver_on_s=400.0,
    )


def measure(n: int) -> None:
    """One run; prints p50 and p95 in milliseconds."""
    world = sea(n)
    goal = world.goal_deg
    config = from_mapping(
        {
            "goal": {"latitude_deg": goal[0], "longitude_deg": goal[1]},
            "contacts": {
                "speed_noise_mps": 0.05,
                "course_noise_rad": 0.01,
                "position_error_m": 1.0,
                "coarse_position_error_m": 1.0,
                "heading_error_rad": 0.02,
                "validity_s": 900.0,
            },
            "vehicle": {"listen_s": LISTEN_S},
            "timing": {"rate_hz": RATE_HZ, "setpoint_validity_s": 0.5},
        }
    )
    companion = build(config)
    guard_ms = [0.0]
    check = Guard.check

    def timed(self: Guard, *arguments: object) -> object:
        began = time.thread_time()
        verdict = check(self, *arguments)  # type: ignore[arg-type]
        guard_ms[0] = (time.thread_time() - began) * 1e3
        return verdict

    Guard.check = timed  # type: ignore[method-assign, assignment]
    taken: dict[str, list[tuple[float, float]]] = defaultdict(list)
    revision = -1
    changed = 0
    lockstep = LockstepSea(world, dt_s=1.0 / RATE_HZ)
    for tick in lockstep:
        began = time.thread_time()
        decision = companion.core.step(tick)
        companion.encoder.system_id = decision.system_id or 1
        sent = [companion.encoder.encode(message) for message in decision.outgoing]
        step_ms = (time.thread_time() - began) * 1e3
        for message, data in zip(decision.outgoing, sent, strict=True):
            lockstep.send(tick.t, data, message.valid_until if isinstance(message, Setpoint) else None)
        if decision.setpoint is not None and len(decision.tracks):
            heard = decision.tracks.revision != revision
            for kind in ("all", "reports" if heard else "silence"):
                taken[kind].append((step_ms, guard_ms[0]))
            changed += decision.guard_changed
        revision = decision.tracks.revision
    Guard.check = check  # type: ignore[method-assign]
    for kind, rows in sorted(taken.items()):
        step, guard = np.array(rows).T
        quantiles = [f"{q:7.3f}" for part in (step, guard) for q in np.quantile(part, (0.5, 0.95, 1.0))]
        print(f"{n:>5} {kind:<8} {len(rows):>5}  " + " ".join(quantiles) + f"  changed {changed}")


def main() -> None:
    """Every number of ships asked for."""
    print("ships  step         n  | whole step p50, p95, max (ms) | guard p50, p95, max (ms)")
    for n in [int(a) for a in sys.argv[1:]] or [20, 200, 1000]:
        measure(n)


if __name__ == "__main__":
    main()
