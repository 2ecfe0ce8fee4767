"""The report's pictures: coverage and area against age, by sort of ship, and what forgetting costs."""

from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure as Canvas

from companion.calibrate.evaluate import PEER_RADIUS_M, Figure, Forgetting

INK, FAINT = "#1b2a38", "#8a97a3"
COLOURS = ("#0b6e99", "#c8553d", "#4f8a3c", "#7a5195", "#b8860b")


def draw(path: Path, figures: list[Figure], forgotten: list[Forgetting], title: str) -> None:
    """Four panels as a PNG."""
    canvas = Canvas(figsize=(13.0, 9.0), layout="constrained")
    FigureCanvasAgg(canvas)
    coverage, area, by_sort, cost = canvas.subplots(2, 2).ravel()
    levels = sorted({f.level for f in figures})
    for level, colour in zip(levels, COLOURS, strict=False):
        rows = [f for f in figures if f.level == level]
        minutes = [f.age_s / 60 for f in rows]
        for row in rows:
            coverage.plot(
                [row.age_s / 60] * len(row.by_split),
                [100 * s for s in row.by_split],
                ".",
                color=colour,
                alpha=0.25,
            )
        coverage.plot(
            minutes, [100 * f.coverage for f in rows], "o-", color=colour, label=f"{100 * level:g} %"
        )
        coverage.axhline(100 * level, color=colour, lw=0.8, ls="--")
        area.plot(
            minutes, [f.area_km2 for f in rows], "o-", color=colour, label=f"learned, {100 * level:g} %"
        )
        area.plot(
            minutes,
            [f.equal_disc_km2 for f in rows],
            "s:",
            color=colour,
            label=f"best disc, {100 * level:g} %",
        )
        for k, sort in enumerate(sorted({s for f in rows for s in f.by_sort})):
            if level == levels[0]:
                shown = [(f.age_s / 60, 100 * f.by_sort[sort][0]) for f in rows if sort in f.by_sort]
                by_sort.plot(*zip(*shown, strict=True), "o-", color=COLOURS[k], label=sort)
    by_sort.axhline(100 * levels[0], color=FAINT, lw=0.8, ls="--")
    for k, rule in enumerate(dict.fromkeys(f.rule for f in forgotten)):
        rows_of = [f for f in forgotten if f.rule == rule]
        cost.plot(
            [f.age_s / 60 for f in rows_of],
            [100 * f.misplaced for f in rows_of],
            "o-",
            color=COLOURS[k],
            label=rule,
        )
    _finish(coverage, "Unseen vessels inside their sets (dots: single splits)", "%", 4)
    _finish(area, "Mean area of the antenna's set", "km2", 2)
    area.set_yscale("log")
    _finish(by_sort, f"The same at {100 * levels[0]:g} %, by sort of ship, before any adaptation", "%", 4)
    _finish(
        cost,
        f"What forgetting costs: shown more than {PEER_RADIUS_M:.0f} m off, or not at all",
        "% of ships",
        4,
    )
    canvas.suptitle(title, color=INK, fontsize=13)
    canvas.savefig(path, dpi=110)


def _finish(axes: object, title: str, unit: str, where: int) -> None:
    axes.set_title(title, fontsize=10, color=INK)  # type: ignore[attr-defined]
    axes.set_xlabel("age of the report, minutes")  # type: ignore[attr-defined]
    axes.set_ylabel(unit)  # type: ignore[attr-defined]
    axes.grid(alpha=0.25)  # type: ignore[attr-defined]
    axes.legend(loc=where, fontsize=8, frameon=False)  # type: ignore[attr-defined]
