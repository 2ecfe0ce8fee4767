"""`companion study liveness`: what a guard costs a planner that means well.

The improved planner by the network crosses the UUV case's convoys and streams, trial by trial the same
ships under the guard, under the plain half-space filter (fewer trials), and under none.  The vehicle has a
lag of 2 s and turns by at most 0.2 rad/s; a guard is asked five times a second.
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import msgspec
import numpy as np
from msgspec import Struct
from rich.console import Console

from companion.config import Config, overlay, to_mapping
from companion.config import from_mapping as configured
from companion.instant import Instant
from companion.messages import AutopilotHeartbeat, FloatArray, IntArray, OwnState, Tracks
from companion.planning.foresight import Foresight
from companion.planning.guard import Guard, Intended, Velocity, Verdict
from companion.reach import choose_kernel
from companion.reach.kernel import Kernel
from companion.reach.shapes import only
from sitl.studies.campaign import Campaign
from sitl.studies.case import Crossing, Readings
from sitl.studies.closest import to_the_hulls, to_the_sets
from sitl.studies.crossing import cross
from sitl.studies.guard import TRACKING_M
from sitl.studies.guard_trial import Ask
from sitl.studies.lanes_picture import TRAFFICS, TrafficKind
from sitl.studies.places import executor_of
from sitl.studies.planners import FieldPlanner, field_planner
from sitl.studies.ships import draw
from sitl.studies.wish import Wish

PART = 20
COMPARED = 40  # trials of the half-space filter at most
VALIDITY_S = 1500.0  # the scenario's: a guard promises nothing for ever
PERIOD_S = 0.2
MOST_CHANGED, MOST_TIME = 0.01, 0.02


class Part(Struct, frozen=True):
    """Some consecutive trials in one traffic under one guard."""

    traffic: TrafficKind
    guard: str
    first: int
    count: int


class Outcome(Struct, frozen=True):
    """One crossing."""

    time_s: float | None  # under way; None: not arrived
    steps: int
    changed: int
    to_set_m: float
    to_hull_m: float


@dataclass(frozen=True, slots=True)
class Guarded:
    """A planner with a guard behind it for each vehicle; `steps` and `changed` (trials,) are counted."""

    planner: FieldPlanner
    asks: tuple[Ask, ...]
    pictures: tuple[Tracks, ...]
    depth_m: float
    numbers: IntArray  # of the vehicles' trials
    steps: IntArray
    changed: IntArray

    def only(self, vehicles: IntArray) -> "Guarded":
        """For some of the vehicles."""
        return replace(
            self,
            planner=self.planner.only(vehicles),
            asks=tuple(self.asks[k] for k in vehicles),
            pictures=tuple(self.pictures[k] for k in vehicles),
            numbers=self.numbers[vehicles],
        )

    def wish(self, now: Instant, position_m: FloatArray, velocity_mps: FloatArray) -> Wish:
        """What the planner wants, as far as each guard lets it through."""
        wish = self.planner.wish(now, position_m, velocity_mps)
        flown = wish.velocity_mps.copy()
        beat = AutopilotHeartbeat(now, 1, 1, "ardupilot", "submarine", True, True, "GUIDED")
        for k, ask in enumerate(self.asks):
            moving = (float(velocity_mps[k, 0]), float(velocity_mps[k, 1]), 0.0)
            own = OwnState(now, float(position_m[k, 0]), float(position_m[k, 1]), self.depth_m, moving, None)
            wanted = (float(flown[k, 0]), float(flown[k, 1]), 0.0)
            verdict = ask(now, own, beat, self.pictures[k], wanted)
            assert verdict.velocity_ned_mps is not None
            self.steps[self.numbers[k]] += 1
            self.changed[self.numbers[k]] += verdict.changed
            flown[k] = verdict.velocity_ned_mps[:2]
        return Wish(flown, wish.steered)


def crossing(traffic: TrafficKind) -> Crossing:
    """The case."""
    return Crossing(readings=Readings(ships=traffic, vehicle="lag"), dt_s=PERIOD_S)


def settings(case: Crossing) -> Config:
    """The case's own configuration, with what the bundled submarine keeps."""
    over = {
        "contacts": {"validity_s": VALIDITY_S},
        "guard": {"tracking_error_m": TRACKING_M["submarine"]},
    }
    return configured(overlay(to_mapping(case.settings({"horizon": "clearing"})), over))


def run_part(seed: int, part: Part, kernel: str = "numpy") -> list[Outcome]:
    """Every trial of the part; the same arguments give the same numbers."""
    case = crossing(part.traffic)
    config, ships = settings(case), draw(case, seed, range(part.first, part.first + part.count))
    steps, changed = np.zeros((2, part.count), dtype=np.int64)

    def guarded(tracks: Tracks, vehicles: int) -> FieldPlanner | Guarded:
        planner = field_planner(case, tracks, vehicles, kernel, improved=True, network=True)
        if part.guard == "none":
            return planner
        believed = replace(tracks, validity_s=np.full(len(tracks), VALIDITY_S))
        rows = np.arange(len(tracks)).reshape(vehicles, -1)
        return Guarded(
            planner,
            tuple(_asked(part.guard, config, kernel, case.goal_m) for _ in range(vehicles)),
            tuple(only(believed, some) for some in rows),
            case.cruise_depth_m,
            np.arange(vehicles),
            steps,
            changed,
        )

    crossed = cross(case, ships, guarded)
    sets, hulls = to_the_sets(crossed.paths, ships), to_the_hulls(crossed.paths, ships)
    return [
        Outcome(
            time_s=round(float(crossed.paths.last[k]) * PERIOD_S, 3) if crossed.arrived[k] else None,
            steps=int(steps[k]),
            changed=int(changed[k]),
            to_set_m=round(float(sets.distance_m[k]), 4),
            to_hull_m=round(float(hulls.distance_m[k]), 4),
        )
        for k in range(part.count)
    ]


def _asked(guard: str, config: Config, kernel: str, goal_m: tuple[float, float]) -> Ask:
    if guard == "half-space":
        from sitl.studies.half_space import HalfSpaceFilter  # noqa: PLC0415 - an extra

        return HalfSpaceFilter(config)
    return Advised(config, choose_kernel("numba" if kernel == "numba" else "numpy"), goal_m)


class Advised:
    """The guard, told what the planner intends, as on the board."""

    def __init__(self, config: Config, kernel: Kernel, goal_m: tuple[float, float]) -> None:
        self._guard, self._foresight = Guard(config, kernel), Foresight(config, kernel)
        self._goal_m = np.array(goal_m)

    def __call__(
        self,
        now: Instant,
        own: OwnState,
        heartbeat: AutopilotHeartbeat,
        tracks: Tracks,
        wanted: Velocity | None,
        intended: Intended | None = None,
    ) -> Verdict:
        """See `Ask`."""
        if self._guard.lies_free:
            self._foresight.forget()
        else:
            self._foresight.look(now, own, tracks, self._goal_m)
        told = intended or self._foresight.intended
        return self._guard.check(now, own, heartbeat, tracks, 1, wanted, told)


def run(options: argparse.Namespace) -> int:
    """The table, and 1 where the guard changed or delayed more than it may."""
    wanted = {"none": options.trials, "way out": options.trials, "half-space": min(options.trials, COMPARED)}
    parts = [
        Part(traffic, guard, k, min(PART, n - k))
        for traffic in TRAFFICS
        for guard, n in wanted.items()
        for k in range(0, n, PART)
    ]
    identity = {"study": "liveness", "seed": options.seed, "trials": options.trials, "kernel": options.kernel}
    campaign: Campaign[Part, Outcome] = Campaign(options.out, identity, Part, Outcome)
    console = Console(highlight=False)
    with console.status("crossings"):
        results = campaign.run(
            partial(run_part, options.seed, kernel=options.kernel), parts, executor_of(options)
        )
    command = "companion " + " ".join(options.said)
    table = f"# What a guard costs\n\n    {command}\n\n{HEAD}"
    lost: list[str] = []
    for traffic in TRAFFICS:
        free = results[: options.trials]
        for guard, n in wanted.items():
            mine, results = results[:n], results[n:]
            text, share, longer = row(traffic, guard, mine, free[:n])
            table += text
            if guard == "way out" and (share >= MOST_CHANGED or longer >= MOST_TIME):
                lost.append(f"{traffic}: {share:.2%} changed, {longer:+.2%} of the median time")
    (options.out / "table.md").write_text(table, encoding="utf-8")
    whole = {**identity, "command": command, "parts": len(parts)}
    (options.out / "study.json").write_bytes(
        msgspec.json.format(msgspec.json.encode(whole), indent=1) + b"\n"
    )
    console.print(table, "\n".join(lost))
    return 1 if lost else 0


HEAD = (
    "| traffic | guard | trials | arrived | changed | trials with a change | time, median (s) | against none "
    "| time, p95 (s) | to set, min (m) | to set, median (m) | trials < delta | to hull, min (m) |\n"
    "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n"
)


def row(
    traffic: str, guard: str, mine: Sequence[Outcome], free: Sequence[Outcome]
) -> tuple[str, float, float]:
    """The row, the share of setpoints changed, and how much longer the median crossing takes."""
    times = np.array([np.inf if o.time_s is None else o.time_s for o in mine])
    unguarded = np.array([np.inf if o.time_s is None else o.time_s for o in free])
    share = sum(o.changed for o in mine) / max(sum(o.steps for o in mine), 1)
    longer = float(np.median(times) / np.median(unguarded)) - 1.0
    sets = np.array([o.to_set_m for o in mine])
    delta_m = crossing("convoy").delta_m
    cells = (
        traffic,
        guard,
        len(mine),
        int(np.isfinite(times).sum()),
        f"{share:.3%}",
        sum(o.changed > 0 for o in mine),
        f"{np.median(times):.1f}",
        f"{longer:+.2%}",
        f"{np.quantile(times, 0.95, method='nearest'):.1f}",
        f"{sets.min():.2f}",
        f"{np.median(sets):.2f}",
        int((sets < delta_m).sum()),
        f"{min(o.to_hull_m for o in mine):.2f}",
    )
    return "| " + " | ".join(map(str, cells)) + " |\n", share, longer
