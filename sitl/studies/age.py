"""`companion study age`: how old may information be at the channel's edge, and does the planner know?

The vehicle lies at the edge of endless traffic with reports of a given age and wants to cross.  Beside the
improved planner as it is: the same after a rehearsal, which crosses only if the whole way is safe, says so
if it is not, and holds.
"""

import argparse
import shlex
from functools import partial

import msgspec
from msgspec import Struct
from rich.console import Console
from rich.table import Table

from sitl.studies.campaign import Campaign
from sitl.studies.case import Crossing, Readings
from sitl.studies.places import executor_of
from sitl.studies.trials import Outcome, Part, parts, run_part

EXIT_OK, EXIT_FAILED = 0, 1
TITLE = "Information that grows old at the channel's edge"
AGES_S = (0, 60, 120, 180, 240, 300, 360, 420, 480, 540, 600)
HOLDS_S = 600.0
COLUMNS = (
    "age (s)",
    "crossed",
    "held",
    "to set, min (m)",
    "trials < delta",
    "without rehearsal: trials < delta",
)
NOTE = """\
Stream of ships, vehicle with lag and turn rate, the network as field.  "held": the rehearsal found no safe
way at any time within 600 s, said so, and the vehicle stayed at its post, keeping clear of every set, as long
as the trial lasts.  The last column is the same planner without the rehearsal."""


class AgeRow(Struct, frozen=True):
    """All trials with information of one age."""

    age_s: int
    trials: int
    crossed: int
    held: int
    set_min_m: float
    within_delta: int
    without: int


def case_of(age_s: float) -> Crossing:
    """A start at the edge, with information of that age; the goal is 100 m beyond the channel."""
    readings = Readings(ships="stream", vehicle="lag")
    return Crossing(
        readings=readings,
        before_m=0.0,
        beyond_m=100.0,
        information_s=0.0,
        information_age_s=age_s,
        time_limit_s=HOLDS_S,
    )


def run(options: argparse.Namespace) -> int:
    """A row for every age; 1 when a rehearsed crossing or a hold came within delta."""
    console = Console(highlight=False)
    rows = [age_row(options, age_s) for age_s in AGES_S]
    table = Table(*COLUMNS, title=TITLE, title_justify="left")
    for r in rows:
        table.add_row(*_cells(r))
    console.print(table)
    _write(options, rows)
    broken = [r.age_s for r in rows if r.within_delta]
    if broken:
        console.print(f"within delta after a rehearsal at ages {broken} s", style="bold red")
    return EXIT_FAILED if broken else EXIT_OK


def age_row(options: argparse.Namespace, age_s: int) -> AgeRow:
    """The trials of one age, with and without rehearsal."""
    case = case_of(age_s)
    identity = {"study": "age", "seed": options.seed, "case": case, "kernel": options.kernel}
    campaign = Campaign(options.out / "parts" / f"{age_s:03d}", identity, Part, Outcome)
    work = partial(run_part, case, options.seed, kernel=options.kernel)
    found = campaign.run(work, parts(("rehearsed", "improved"), options.trials), executor_of(options))
    gated = [o for o in found if o.planner == "rehearsed"]
    plain = [o for o in found if o.planner == "improved"]
    return AgeRow(
        age_s=age_s,
        trials=len(gated),
        crossed=sum(o.arrived for o in gated),
        held=sum(not o.arrived for o in gated),
        set_min_m=round(min(o.to_set_m for o in gated), 2),
        within_delta=sum(o.to_set_m < case.delta_m for o in gated),
        without=sum(o.to_set_m < case.delta_m for o in plain),
    )


def _cells(r: AgeRow) -> tuple[str, ...]:
    numbers = (r.age_s, r.crossed, r.held, f"{r.set_min_m:.1f}", r.within_delta, r.without)
    return tuple(str(n) for n in numbers)


def _write(options: argparse.Namespace, rows: list[AgeRow]) -> None:
    head = [" | ".join(COLUMNS), " | ".join("---" for _ in COLUMNS)]
    lines = [f"| {line} |\n" for line in (*head, *(" | ".join(_cells(r)) for r in rows))]
    command = shlex.join(("companion", *options.said))
    text = f"# {TITLE}\n\n    {command}\n\n{''.join(lines)}\n{NOTE}\n"
    (options.out / "table.md").write_text(text, encoding="utf-8")
    values = [",".join(AgeRow.__struct_fields__)]
    values += [",".join(str(v) for v in msgspec.structs.astuple(r)) for r in rows]
    (options.out / "table.csv").write_text("\n".join(values) + "\n", encoding="utf-8")
    whole = {"study": "age", "seed": options.seed, "command": command, "rows": rows}
    (options.out / "study.json").write_bytes(
        msgspec.json.format(msgspec.json.encode(whole), indent=1) + b"\n"
    )
