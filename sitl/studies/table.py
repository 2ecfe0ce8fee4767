"""What came of a campaign, a row for each planner: for people (Markdown), spreadsheets (CSV) and programs."""

import csv
import io
from collections.abc import Sequence

import numpy as np
from msgspec import Struct

from sitl.studies.trials import Outcome


class Row(Struct, frozen=True):
    """A planner over all its trials; distances in metres, times in seconds; None where there is none."""

    planner: str
    trials: int
    arrived: int
    set_min_m: float | None
    set_median_m: float | None
    hull_min_m: float | None
    hull_median_m: float | None
    within_delta: int | None
    overlaps: int | None
    time_median_s: float | None
    time_p95_s: float | None
    vertical_min_m: float | None
    oldest_s: float | None
    step_p50_ms: float | None = None
    step_max_ms: float | None = None


HEADINGS = {
    "planner": "planner",
    "trials": "trials",
    "arrived": "arrived",
    "set_min_m": "to set, min (m)",
    "set_median_m": "to set, median (m)",
    "hull_min_m": "to hull, min (m)",
    "hull_median_m": "to hull, median (m)",
    "within_delta": "trials < delta",
    "overlaps": "hull overlaps",
    "time_median_s": "time, median (s)",
    "time_p95_s": "time, p95 (s)",
    "vertical_min_m": "vertical, min (m)",
    "oldest_s": "oldest info (s)",
    "step_p50_ms": "step, p50 (ms)",
    "step_max_ms": "step, max (ms)",
}

PAPER = (
    Row("*paper: network*", 20, 20, None, None, 7.5, None, None, 0, 720.0, None, None, 540.0, 27.0, 81.0),
    Row("*paper: exact*", 20, 20, 18.8, None, None, None, 0, 0, 720.0, None, None, None, None, None),
    Row("*paper: no uncertainty*", 20, 20, None, None, None, None, 11, 1, 720.0, None, None, None),
)


def row(
    title: str, outcomes: Sequence[Outcome], delta_m: float, step_ms: tuple[float, float] | None = None
) -> Row:
    """One planner's row."""
    sets = np.array([o.to_set_m for o in outcomes])
    hulls = np.array([o.to_hull_m for o in outcomes])
    times = np.array([o.time_s for o in outcomes if o.time_s is not None])
    oldest = [o.oldest_s for o in outcomes if o.oldest_s is not None]
    p50, most = (None, None) if step_ms is None else step_ms
    return Row(
        planner=title,
        trials=len(outcomes),
        arrived=sum(o.arrived for o in outcomes),
        set_min_m=_round(sets.min()),
        set_median_m=_round(np.median(sets)),
        hull_min_m=_round(hulls.min()),
        hull_median_m=_round(np.median(hulls)),
        within_delta=int((sets < delta_m).sum()),
        overlaps=int((hulls < 0).sum()),
        time_median_s=_round(np.median(times)) if len(times) else None,
        time_p95_s=_round(np.quantile(times, 0.95)) if len(times) else None,
        vertical_min_m=_round(min(o.vertical_m for o in outcomes)),
        oldest_s=max(oldest, default=None),
        step_p50_ms=p50,
        step_max_ms=most,
    )


def markdown(rows: Sequence[Row]) -> str:
    """The table, a line each."""
    names = list(HEADINGS)
    lines = [" | ".join(HEADINGS.values()), " | ".join("---" for _ in names)]
    lines += [" | ".join(_text(getattr(r, name)) for name in names) for r in rows]
    return "".join(f"| {line} |\n" for line in lines)


def comma_separated(rows: Sequence[Row]) -> str:
    """The same with the fields' own names."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(HEADINGS)
    for r in rows:
        values = [getattr(r, name) for name in HEADINGS]
        writer.writerow(["" if v is None else v for v in values])
    return text.getvalue()


def _text(value: object) -> str:
    if value is None:
        return ""
    return (
        f"{value:.4g}"
        if isinstance(value, float) and abs(value) < 10
        else (f"{value:.1f}" if isinstance(value, float) else str(value))
    )


def _round(value: float) -> float:
    return round(float(value), 2)
