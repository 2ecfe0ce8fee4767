"""`companion study guard`: hostile planners against the guard, and what a plain filter makes of them."""

import argparse
from collections.abc import Sequence

import numpy as np
from msgspec import Struct
from rich.console import Console

from companion.config import Config, from_mapping
from companion.reach import choose_kernel
from sitl.studies.bad_vehicle import Bodies
from sitl.studies.campaign import Campaign, local_executor
from sitl.studies.guard_trial import Ask, Outcome, asking, run_trial, unguarded
from sitl.studies.hostile import PLANNERS
from sitl.studies.lanes_picture import TRAFFICS, Lanes

PART = 25  # trials a worker takes at once
COMPARED = 600  # trials of the comparisons at most
RENEWED = 0.3  # share of the trials with new reports on the way
VEHICLES = ("submarine", "boat")
TRACKING_M = {"submarine": 3.0, "boat": 8.0}  # what the bundled ones keep (tests/test_guard_tracking.py)


class Part(Struct, frozen=True):
    """Some consecutive trials under one guard."""

    guard: str  # "way out", "half-space" or "none"
    first: int
    count: int
    seed: int
    duration_s: float
    rate_hz: float
    kernel: str
    bodies: Bodies = "points"
    broken: bool = False  # ships leave their declared bounds on the way
    beside_m: float = 0.0  # starts so near outside delta, viable or not


def configuration(vehicle: str, rate_hz: float) -> Config:
    """The UUV case's own, for a vehicle under water or at the surface."""
    deep = 0.0 if vehicle == "boat" else 45.0
    return from_mapping(
        {
            "goal": {"latitude_deg": 59.9, "longitude_deg": 19.2},
            "vehicle": {"cruise_depth_m": deep},
            "timing": {"rate_hz": rate_hz, "setpoint_validity_s": 3.0 / rate_hz},
            "guard": {"tracking_error_m": TRACKING_M[vehicle]},
        }
    )


def trials(part: Part) -> list[Outcome]:
    """What a worker does: every number follows from the seed and the trial's own."""
    return [_trial(part, number) for number in range(part.first, part.first + part.count)]


def _trial(part: Part, number: int) -> Outcome:
    rng = np.random.default_rng((part.seed, number))
    planner, traffic = PLANNERS[number % 6], TRAFFICS[number // 6 % 2]
    config = configuration(VEHICLES[number // 12 % 2], part.rate_hz)
    while True:  # until a start is viable
        renewed = float(rng.uniform(5.0, 0.8 * part.duration_s)) if rng.random() < RENEWED else None
        broken = float(rng.uniform(10.0, 0.5 * part.duration_s)) if part.broken else None
        outcome = run_trial(
            config,
            Lanes(traffic, rng, renewed, broken),
            planner,
            rng,
            _asked(part, config),
            part.duration_s,
            bodies=part.bodies,
            beside_m=part.beside_m,
        )
        if outcome.viable or part.beside_m > 0:
            return outcome


def _asked(part: Part, config: Config) -> Ask:
    if part.guard == "half-space":
        from sitl.studies.half_space import HalfSpaceFilter  # noqa: PLC0415 - an extra

        return HalfSpaceFilter(config)
    if part.guard == "none":
        return unguarded
    return asking(config, choose_kernel("numba" if part.kernel == "numba" else "numpy"))


def run(options: argparse.Namespace) -> int:
    """The campaign, its table, and 1 where the guard let one breach happen."""
    wanted = {"way out": options.trials, **dict.fromkeys(options.compare, min(options.trials, COMPARED))}
    parts = [
        Part(
            guard,
            k,
            min(PART, n - k),
            options.seed,
            options.duration,
            options.rate,
            options.kernel,
            options.vehicles,
            options.ships == "break",
            options.beside,
        )
        for guard, n in wanted.items()
        for k in range(0, n, PART)
    ]
    identity = [wanted, options.seed, options.duration, options.rate]
    beyond = [options.vehicles, options.ships, options.beside]
    if beyond != ["points", "keep", 0.0]:
        identity += beyond
    campaign: Campaign[Part, Outcome] = Campaign(options.out, identity, Part, Outcome)
    console = Console()
    with console.status("hostile trials") as status:
        done: list[int] = [0]

        def finished(part: Part, results: Sequence[Outcome]) -> None:  # noqa: ARG001
            done[0] += len(results)
            status.update(f"hostile trials: {done[0]} of {sum(wanted.values())}")

        results = campaign.run(trials, parts, local_executor(options.jobs), finished)
    delta_m = configuration("submarine", options.rate).field.delta_m
    text, first = "", 0
    breaches: dict[str, int] = {}
    for guard, n in wanted.items():
        outcomes = results[first : first + n]
        first += n
        # a claim is made for ships that keep their bounds, from a start with a way out
        claimed = [] if options.ships == "break" else [o for o in outcomes if o.viable]
        breaches[guard] = sum(o.closest_set_m < delta_m for o in claimed)
        text += _row(guard, outcomes, delta_m)
    if options.beside > 0 or options.ships == "break":
        text += _beyond(results[: wanted["way out"]], delta_m)
    command = "companion " + " ".join(options.said)
    parts_text = _by_planner(results[: wanted["way out"]], delta_m)
    table = f"    {command}\n\n{HEAD}{text}\n{parts_text}"
    (options.out / "table.md").write_text(table, encoding="utf-8")
    print(table)
    return 1 if breaches["way out"] else 0


HEAD = (
    "| guard | trials | breaches | nearest set (m) | nearest hull (m) | changed | steps without way out |\n"
    "| --- | --- | --- | --- | --- | --- | --- |\n"
)


def _row(name: str, outcomes: Sequence[Outcome], delta_m: float) -> str:
    steps = sum(o.steps for o in outcomes)
    return (
        f"| {name} | {len(outcomes)} | {sum(o.closest_set_m < delta_m for o in outcomes)} "
        f"| {min(o.closest_set_m for o in outcomes):.2f} | {min(o.closest_hull_m for o in outcomes):.2f} "
        f"| {sum(o.changed for o in outcomes) / steps:.1%} | {sum(o.no_way_out for o in outcomes)} |\n"
    )


def _beyond(outcomes: Sequence[Outcome], delta_m: float) -> str:
    """Where nothing is claimed: what came of it all the same."""
    text = ""
    for name, viable in (("a way out at the start", True), ("none", False)):
        some = [o for o in outcomes if o.viable is viable]
        text += _row(f"of these, {name}", some, delta_m) if some else ""
    told = sum(o.unforetold for o in outcomes)
    struck = sum(o.closest_hull_m < 0 for o in outcomes)
    near = [o for o in outcomes if o.closest_set_m < delta_m]
    warned = sum(o.no_way_out > 0 for o in near)
    return text + (
        f"\n`guard.report_unforetold` in {told} of {len(outcomes)} trials; inside a true hull in {struck}; "
        f"`guard.no_way_out` in {warned} of the {len(near)} that came within delta.\n"
    )


def _by_planner(outcomes: Sequence[Outcome], delta_m: float) -> str:
    """The way-out guard's row, planner by planner, traffic by traffic, vehicle by vehicle."""
    text = HEAD.replace("guard", "planner, traffic, vehicle", 1)
    for k, planner in enumerate(PLANNERS):
        for j, traffic in enumerate(TRAFFICS):
            for i, vehicle in enumerate(VEHICLES):
                some = [o for n, o in enumerate(outcomes) if (n % 6, n // 6 % 2, n // 12 % 2) == (k, j, i)]
                text += _row(f"{planner}, {traffic}, {vehicle}", some, delta_m) if some else ""
    return text
