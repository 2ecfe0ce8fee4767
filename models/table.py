"""The honest table: how long each way takes, for how many contacts.  How wrong each is says its card.

Everything on one thread.  `exact` is the field of the closed-form sets as the core calls it, tracks
unchanged between calls, as they are during a crossing.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from companion.config import Field
from companion.messages import FloatArray
from companion.planning.field import ExactRepulsion
from companion.planning.model_file import METADATA_KEY, decode_metadata, read_bytes
from companion.planning.network import INPUT, OUTPUTS, open_session
from companion.planning.onnx_weights import metadata_text
from companion.planning.rows import COLUMNS
from models import sampling

CONTACTS = (1, 20, 100, 1000, 10_000)
BUDGET_S = 0.4  # per cell
BASELINE, OURS = "paper15x16", "straight"


@dataclass(frozen=True, slots=True)
class Row:
    """One way of computing the repulsion: (p50, p99) microseconds for each count of contacts."""

    name: str
    latency_us: dict[int, tuple[float, float]]


def latencies(seed: int = 0) -> list[Row]:
    """Time every way on the paper's ships, the only ones the baseline knows."""
    baseline, ours = (open_session(read_bytes(name)[1], name) for name in (BASELINE, OURS))
    text = metadata_text(read_bytes(BASELINE)[1], METADATA_KEY)
    domain = {i.name: (i.low, i.high) for i in decode_metadata(text, BASELINE).inputs}
    rng = np.random.default_rng(seed)
    rows = sampling.place(rng, sampling.ships(rng, max(CONTACTS), domain), 5.0, 2000.0)
    exact = ExactRepulsion(Field())

    def one_by_one(part: FloatArray) -> None:
        for i in range(len(part)):
            baseline.run(OUTPUTS, {INPUT: part[i : i + 1]})

    ways: list[tuple[str, Callable[[FloatArray], Callable[[], object]]]] = [
        (f"{BASELINE}, one call per ship (the paper's way)", lambda part: lambda: one_by_one(part)),
        (f"{BASELINE}, batched", lambda part: lambda: baseline.run(OUTPUTS, {INPUT: part})),
        (f"{OURS}, batched (certified)", lambda part: lambda: ours.run(OUTPUTS, {INPUT: part})),
        ("exact sets", lambda part: _exact_call(exact, part)),
    ]
    table = []
    for name, prepare in ways:
        cells = {n: _percentiles(prepare(np.ascontiguousarray(rows[:n]))) for n in CONTACTS}
        table.append(Row(name, cells))
    return table


def markdown(table: list[Row]) -> str:
    """The table as it stands in a model card."""
    lines = [
        "| p50 / p99, microseconds | " + " | ".join(f"n = {n}" for n in CONTACTS) + " |",
        "| --- " * (len(CONTACTS) + 1) + "|",
    ]
    for row in table:
        cells = (f"{row.latency_us[n][0]:.0f} / {row.latency_us[n][1]:.0f}" for n in CONTACTS)
        lines.append(f"| {row.name} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def write(folder: Path) -> Path:
    """Measure and write latency.md; returns its path."""
    target = folder / "latency.md"
    target.write_text(
        f"""# Latency

One thread, wall clock, on the machine that ran `companion latency`; the paper's 75 x 25 m ships. Errors
stand in the model cards, [{OURS}]({OURS}.md) and [{BASELINE}]({BASELINE}.md), measured the same way.

{markdown(latencies())}

For these ships the exact sets are the fastest and have no error: the network earns its place where
a set has no closed form.
""",
        encoding="utf-8",
    )
    return target


def _exact_call(exact: ExactRepulsion, part: FloatArray) -> Callable[[], object]:
    tracks, until = sampling.tracks_of(part), part[:, COLUMNS.index("until_age_s")]
    return lambda: exact(tracks, sampling.NOW, until, np.zeros(2))


def _percentiles(call: Callable[[], object]) -> tuple[float, float]:
    call()
    end = time.perf_counter() + BUDGET_S
    spent: list[int] = []
    while len(spent) < 5 or (time.perf_counter() < end and len(spent) < 2000):
        start = time.perf_counter_ns()
        call()
        spent.append(time.perf_counter_ns() - start)
    p50, p99 = np.percentile(spent, [50, 99]) / 1000
    return float(p50), float(p99)
