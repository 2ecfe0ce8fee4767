"""The honest table: how long each way takes, for how many contacts, and how wrong each is.

Everything on one thread, on the paper's ships, the only ones the baseline knows; errors 5 to 10 m from
their tubes (delta to twice delta); turning ships are these in a turn.  Exact ways are called as the core
calls them, tracks unchanged between calls as they are during a crossing, but a turning ship's tube is
computed anew, as it is once a second.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from onnxruntime import InferenceSession

from companion.config import Field
from companion.errors import ConfigError
from companion.instant import after
from companion.messages import FloatArray
from companion.planning.field import ExactRepulsion
from companion.planning.model_file import METADATA_KEY, decode_metadata, read_bytes
from companion.planning.network import INPUT, OUTPUTS, infer, open_session
from companion.planning.onnx_weights import metadata_text
from companion.planning.rows import COLUMNS
from companion.reach import choose_kernel
from models import sampling
from models.evaluate import degrees_between

CONTACTS = (1, 20, 100, 1000, 10_000)
BUDGET_S = 0.4  # per cell
TURN_NS = 5_000_000
TOO_LONG_S = 2.0  # a way that took longer is not asked for more contacts
BASELINE, OURS = "paper15x16", "straight"
POINTS = 100_000
TURNING, TURNS = "turning", (0.004, 0.0005)  # rad/s, and its error: over 600 s nearly half a turn
TURNING_POINTS = 5000

Call = Callable[[], object]
Ways = list[tuple[str, Callable[[FloatArray], Call]]]


@dataclass(frozen=True, slots=True)
class Row:
    """One way of computing the repulsion."""

    name: str
    latency_us: dict[int, tuple[float, float, float]]  # p10, p50 and p99 for a count of contacts
    distance_m: tuple[float, float] | None = None  # p50, p99 of what is claimed too little or too much
    direction_deg: tuple[float, float] | None = None
    unsafe: int | None = None  # of POINTS


def measure(seed: int = 0) -> list[Row]:
    """Time every way, in turn at each count of contacts, and compare the networks with the truth."""
    rng = np.random.default_rng(seed)
    rows = sampling.place(rng, sampling.ships(rng, max(CONTACTS), _papers_ships()), 5.0, 2000.0)
    ways = _ways()
    latency: dict[str, dict[int, tuple[float, float, float]]] = {name: {} for name, _ in ways}
    for n in CONTACTS:
        part = np.ascontiguousarray(rows[:n])
        calls = {
            name: prepare(part)
            for name, prepare in ways
            if max((cell[1] for cell in latency[name].values()), default=0.0) < 1e6 * TOO_LONG_S / 10
        }
        for name, cell in _percentiles(calls).items():
            latency[name][n] = cell
    near = sampling.place(rng, sampling.ships(rng, POINTS, _papers_ships()), 5.0, 10.0)
    return [Row(name, latency[name], *_errors(name, near)) for name, _ in ways]


def _papers_ships() -> dict[str, tuple[float, float]]:
    text = metadata_text(read_bytes(BASELINE)[1], METADATA_KEY)
    return {i.name: (i.low, i.high) for i in decode_metadata(text, BASELINE).inputs}


def _ways() -> Ways:
    baseline, ours = (open_session(read_bytes(name)[1], name) for name in (BASELINE, OURS))

    def one_by_one(part: FloatArray) -> None:
        for i in range(len(part)):
            baseline.run(OUTPUTS, {INPUT: part[i : i + 1]})

    exact = ExactRepulsion(Field())
    ways: Ways = [
        (f"{BASELINE}, one call per ship (the paper's way)", lambda part: lambda: one_by_one(part)),
        (f"{BASELINE}, batched", lambda part: lambda: baseline.run(OUTPUTS, {INPUT: part})),
        (f"{OURS}, batched (certified)", lambda part: lambda: infer(ours, part)),
        ("exact sets, numpy", lambda part: _exact_call(exact, part)),
    ]
    try:
        compiled = ExactRepulsion(Field(), choose_kernel("numba"))
    except ConfigError:  # an extra
        pass
    else:
        ways.append(("exact sets, compiled", lambda part: _exact_call(compiled, part)))
    turning = open_session(read_bytes(TURNING)[1], TURNING)
    ways.append((f"turning ships, {TURNING}, batched (certified)", lambda part: _network_call(turning, part)))
    ways.append(("turning ships, exact sets, numpy", lambda part: _turning_call(exact, part)))
    return ways


def _exact_call(exact: ExactRepulsion, part: FloatArray) -> Call:
    tracks, until = sampling.tracks_of(part), part[:, COLUMNS.index("until_age_s")]
    return lambda: exact(tracks, sampling.NOW, until, np.zeros(2))


def _turned(part: FloatArray) -> FloatArray:
    """The same ships in a turn."""
    return np.column_stack((part, np.broadcast_to(TURNS, (len(part), 2))))


def _network_call(session: InferenceSession, part: FloatArray) -> Call:
    rows = _turned(part)
    return lambda: infer(session, rows)


def _turning_call(exact: ExactRepulsion, part: FloatArray) -> Call:
    tracks, until = sampling.tracks_of(_turned(part)), part[:, COLUMNS.index("until_age_s")]
    seconds = iter(range(10**9))
    return lambda: exact(tracks, after(sampling.NOW, float(next(seconds))), until, np.zeros(2))


def _errors(
    name: str, rows: FloatArray
) -> tuple[tuple[float, float] | None, tuple[float, float] | None, int | None]:
    model = next((m for m in (BASELINE, OURS, f"turning ships, {TURNING}") if name.startswith(m)), None)
    if model is None:
        return None, None, None
    if model.endswith(TURNING):
        rng, model = np.random.default_rng(1), TURNING
        rows = sampling.place(rng, _turned(rows[:TURNING_POINTS]), 5.0, 10.0)
    distance, away, _ = infer(open_session(read_bytes(model)[1], model), rows)
    true_distance, true_away = sampling.exact(rows)
    off = np.percentile(np.abs(distance - true_distance), [50, 99])
    turned = np.percentile(degrees_between(away, true_away), [50, 99])
    return (
        (float(off[0]), float(off[1])),
        (float(turned[0]), float(turned[1])),
        int((distance > true_distance).sum()),
    )


def markdown(table: list[Row]) -> str:
    """The table of latencies, and the one of errors."""
    heads = " | ".join(f"n = {n}" for n in CONTACTS)
    lines = [f"| p50 (p10) / p99, microseconds | {heads} |", "| --- " * (len(CONTACTS) + 1) + "|"]
    for row in table:
        cells = (_cell(row.latency_us.get(n)) for n in CONTACTS)
        lines.append(f"| {row.name} | " + " | ".join(cells) + " |")
    lines += [
        "",
        (
            f"| p50 / p99 of {POINTS} points 5 to 10 m off, {TURNING_POINTS} of turning ships "
            "| distance, m | direction, degrees | unsafe points |"
        ),
        "| --- | --- | --- | --- |",
    ]
    for row in table:
        if row.distance_m and row.direction_deg:
            distance, direction = (f"{x[0]:.3g} / {x[1]:.3g}" for x in (row.distance_m, row.direction_deg))
            lines.append(f"| {row.name} | {distance} | {direction} | {row.unsafe} |")
    return "\n".join(lines)


def _cell(cell: tuple[float, float, float] | None) -> str:
    return "-" if cell is None else f"{cell[1]:.0f} ({cell[0]:.0f}) / {cell[2]:.0f}"


def write(folder: Path) -> Path:
    """Measure and write latency.md; returns its path."""
    target = folder / "latency.md"
    target.write_text(
        f"""# Latency

One thread, wall clock, on the machine that ran `companion latency`, all ways in turn so that a busy
moment strikes all; p10 is the least disturbed. The paper's 75 x 25 m ships; the errors over the networks'
whole domains stand in their cards, [{OURS}]({OURS}.md), [{TURNING}]({TURNING}.md) and
[{BASELINE}]({BASELINE}.md).

{markdown(measure())}

For ships that keep their course the exact sets are the fastest and have no error; there the network is the
paper's method made safe. The sets of turning ships are not cheap: there the network pays. A dash stands
where one call would take too long to be measured. "Unsafe" is more distance than the exact sets of
`companion/reach` have, which for turning ships contain the true ones.
""",
        encoding="utf-8",
    )
    return target


def _percentiles(calls: dict[str, Call]) -> dict[str, tuple[float, float, float]]:
    """Time all of them in turn, a few milliseconds each; the first call of a turn does not count."""
    spent: dict[str, list[int]] = {name: [] for name in calls}
    end = time.perf_counter() + BUDGET_S * len(calls)
    turns = 0
    while turns < 3 or time.perf_counter() < end:
        for name, call in calls.items():
            call()
            until = time.perf_counter_ns() + TURN_NS
            while True:
                start = time.perf_counter_ns()
                call()
                now = time.perf_counter_ns()
                spent[name].append(now - start)
                if now > until:
                    break
        turns += 1
    cells = {}
    for name, times in spent.items():
        p10, p50, p99 = (float(us) for us in np.percentile(times, [10, 50, 99]) / 1000)
        cells[name] = (p10, p50, p99)
    return cells
