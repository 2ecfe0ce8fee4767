"""`companion study uuv`: the paper's vehicle crossing a shipping channel, planner beside planner."""

import argparse
import shlex
import time
from collections.abc import Sequence
from functools import partial

import msgspec
from rich.console import Console
from rich.progress import Progress

from companion.errors import ConfigError
from sitl.studies import figures
from sitl.studies.campaign import Campaign
from sitl.studies.case import Crossing, Readings
from sitl.studies.places import executor_of
from sitl.studies.planners import PLANNERS
from sitl.studies.report import show, write
from sitl.studies.step_time import step_ms
from sitl.studies.table import PAPER, row
from sitl.studies.trials import CHUNK, Outcome, Part, parts, run_part

EXIT_OK, EXIT_FAILED = 0, 1
DEFAULT_PLANNERS = ("network", "exact", "no-uncertainty", "improved")
TITLE = "UUV crossing of a shipping channel"


def run(options: argparse.Namespace) -> int:
    """The whole study; 1 when a planner that claims safety came within delta."""
    console = Console(highlight=False)
    case = case_of(options)
    names = planners_of(options)
    identity = {
        "study": "uuv",
        "seed": options.seed,
        "case": case,
        "planners": names,
        "kernel": options.kernel,
    }
    work = partial(run_part, case, options.seed, kernel=options.kernel)
    todo = parts(names, options.trials, 1 if case.readings.vehicle == "sitl" else CHUNK)
    began = time.perf_counter()
    campaign = Campaign(options.out, identity, Part, Outcome)
    with Progress(console=console, transient=True) as bar:
        task = bar.add_task("trials", total=options.trials * len(names))
        bar.advance(task, sum(p.count for p in todo if msgspec.json.encode(p) in campaign.done))
        outcomes = campaign.run(
            work, todo, executor_of(options), lambda part, _: bar.advance(task, part.count)
        )
    took_s = time.perf_counter() - began
    rows, failures = [], []
    for name in names:
        mine = sorted((o for o in outcomes if o.planner == name), key=lambda o: o.trial)
        timing = step_ms(case, options.seed, name, options.kernel, time.perf_counter)
        rows.append(row(PLANNERS[name].title, mine, case.delta_m, timing))
        within = [o.trial for o in mine if o.to_set_m < case.delta_m]
        if PLANNERS[name].claims_safety and within:
            failures.append(
                f"{PLANNERS[name].title}: within delta in {len(within)} trials, first {within[0]}"
            )
    command = shlex.join(("companion", *options.said))
    known = {**identity, "planners": names, "trials": options.trials}
    said = (PLANNER_NOTE, DISTANCE_NOTE, *paired(outcomes), *failures)
    write(options.out, TITLE, command, known, [*rows, *PAPER], said)
    figures.distances(options.out / "distances.png", case, outcomes)
    figures.snapshots(options.out / "snapshots.png", case, options.seed, outcomes, options.kernel)
    show(console, TITLE, [*rows, *PAPER])
    console.print(
        f"{options.out}: table.md, table.csv, study.json, distances.png, snapshots.png; {took_s:.1f} s"
    )
    for sentence in failures:
        console.print(sentence, style="bold red")
    return EXIT_FAILED if failures else EXIT_OK


PLANNER_NOTE = """\
network, exact: the paper's planner by the network and by the exact sets; no uncertainty: the same, speeds
and courses believed to the letter; improved: the network with a horizon per ship and a pull astern (the
product's default); ORCA: pyrvo on courses and speeds as reported; search: the earliest way through the sets
of every moment, the bound of what is possible.  The paper's own rows are as printed there."""
DISTANCE_NOTE = """\
Distances are horizontal, to the ships' reachable sets of the same moment and to the true hulls, negative
inside; a hull overlap is horizontal too, with the vertical clearance beside it.  Times run from the
scenario's start; the reports come at 190 s."""


def paired(outcomes: Sequence[Outcome]) -> list[str]:
    """By how much the network changes a trial's least distance, where the exact planner sailed it too."""
    said: list[str] = []
    for learned, exact in (("network", "exact"), ("improved", "improved-exact")):
        least = [{o.trial: o.to_set_m for o in outcomes if o.planner == name} for name in (learned, exact)]
        if all(least):
            most_m = max(abs(least[0][trial] - least[1][trial]) for trial in least[0])
            said.append(
                f"Trial by trial the least distance of {PLANNERS[learned].title} is within {most_m:.3f} m "
                f"of that of {PLANNERS[exact].title}."
            )
    return said


def case_of(options: argparse.Namespace) -> Crossing:
    """The case these options describe."""
    values = {name: getattr(options, name) for name in Readings.__struct_fields__}
    readings = msgspec.convert({k: v for k, v in values.items() if v is not None}, Readings)
    return Crossing(readings=readings)


def planners_of(options: argparse.Namespace) -> tuple[str, ...]:
    """The planners asked for, or all; raises `ConfigError` for one there is not."""
    names: Sequence[str] = options.planners.split(",") if options.planners else DEFAULT_PLANNERS
    for name in names:
        if name not in PLANNERS:
            raise ConfigError(f"--planners {name}: there is {', '.join(PLANNERS)}")
    return tuple(names)
