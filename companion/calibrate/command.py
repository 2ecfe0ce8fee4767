"""`companion calibrate`: recorded traffic to a bounds file and a report."""

import argparse
from collections import Counter
from pathlib import Path

import numpy as np

from companion.calibrate import bounds_file, pictures
from companion.calibrate.conformal import calibrate
from companion.calibrate.dataset import Dataset, collect
from companion.calibrate.evaluate import Figure, Forgetting, figures, forgetting
from companion.calibrate.fit import Shape
from companion.calibrate.transfer import Transfer, transfer
from companion.edges.traffic import read
from companion.errors import ConfigError
from companion.picture import learned

LEVELS = (0.9, 0.95, 0.99)
REPORTED = (0.95, 0.99)
FEWEST_VESSELS = 12
SHAPES: tuple[Shape, ...] = ("kite", "box")
QUICK_SPLITS = 4  # to choose the shape by


def run(options: argparse.Namespace) -> int:
    """Run the sub-command; the exit status."""
    rng = np.random.default_rng(options.seed)
    data = _gathered(options.traffic)
    vessels = len(np.unique(data.vessel[data.under_way]))
    if vessels < FEWEST_VESSELS or any(len(data.at(k)) < 100 for k in (0, 1)):
        raise ConfigError(
            f"traffic: {vessels} vessels were followed under way, too few or too briefly to learn bounds; "
            f"give recordings of at least {FEWEST_VESSELS} vessels and several minutes"
        )
    shape = _chosen_shape(data, options.seed)
    print(f"{vessels} vessels under way; shape of least area: {shape}; {options.splits} splits by vessel ...")
    found = figures(data, shape, REPORTED, options.splits, rng)
    result = calibrate(data, shape, rng)
    text = bounds_file.text(result, data, LEVELS, [path.name for path in options.traffic])
    folder = Path(options.out)
    folder.mkdir(parents=True, exist_ok=True)
    target = folder / f"{options.name}.bounds.toml"
    target.write_text(text, encoding="utf-8")
    forgotten = forgetting(data)
    checks = {}
    for path in options.check:
        bounds = learned.prepare(learned.parse(text, str(target)), 0.95, str(target))
        checks[path.name] = transfer(bounds, read(path, Counter()))
    sources = ", ".join(path.name for path in options.traffic)
    pictures.draw(folder / f"{options.name}.bounds.png", found, forgotten, f"Bounds learned from {sources}")
    report = _report(options.name, sources, vessels, shape, found, forgotten, checks, options.splits)
    (folder / f"{options.name}.bounds.md").write_text(report, encoding="utf-8")
    print(report)
    print(f"wrote {target}, and beside it the report (.md) and its pictures (.png)")
    return 0


def _gathered(paths: list[Path]) -> Dataset:
    parts = []
    for path in paths:
        counts: Counter[str] = Counter()
        parts.append(collect(read(path, counts)))
        dropped = ", ".join(
            f"{n} {key}" for key, n in sorted(counts.items()) if "bad" in key or "short" in key
        )
        print(f"{path.name}: {len(parts[-1])} outcomes" + (f" (left out: {dropped})" if dropped else ""))
    return Dataset.joined(parts)


def _chosen_shape(data: Dataset, seed: int) -> Shape:
    """The shape with the smaller mean ratio to the best disc, on the same few splits."""

    def ratio(shape: Shape) -> float:
        rows = figures(data, shape, (REPORTED[0],), QUICK_SPLITS, np.random.default_rng(seed))
        return float(np.nanmean([f.ratio_to_level for f in rows]))

    return min(SHAPES, key=ratio)


def _report(
    name: str,
    sources: str,
    vessels: int,
    shape: Shape,
    found: list[Figure],
    forgotten: list[Forgetting],
    checks: dict[str, tuple[list[Transfer], list[Transfer]]],
    splits: int,
) -> str:
    lines = [
        f"# Bounds `{name}`",
        "",
        f"Learned from {sources}: {vessels} vessels under way, sets of shape *{shape}*.",
        f"Measured on vessels set aside, {splits} splits by vessel, a quarter each. Areas are of the",
        "antenna's set, without hull and position error. The best discs around the straight prediction",
        "hold, of all recorded outcomes, exactly the level wanted, and exactly the share that these sets",
        "held; the ratios are to the one and to the other.",
        "",
        f"![coverage and area]({name}.bounds.png)",
        "",
        "| age | wanted | coverage | km2 | disc of the level | of equal coverage | ratios | by sort (km2) |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for f in found:
        sorts = ", ".join(f"{s} {100 * c:.1f} % ({a:.3g})" for s, (c, a, _) in f.by_sort.items())
        lines.append(
            f"| {f.age_s / 60:g} min | {100 * f.level:g} % | {100 * f.coverage:.1f} % | {f.area_km2:.3g} "
            f"| {f.level_disc_km2:.3g} | {f.equal_disc_km2:.3g} | {f.ratio_to_level:.2f}, {f.ratio:.2f} "
            f"| {sorts} |"
        )
    lines += [
        "",
        "Sorts of ship differ: sets of least mean area leave out ships that shuttle more often than others.",
        "At run time each sort adapts by itself until it is covered as wanted.",
        "",
        "## What forgetting costs",
        "",
        "Ships under way, by the rules of other systems: median distance from where the ship is shown, and",
        "the share more than 0.1 nautical miles off, or not shown at all.",
        "",
        "| age | rule | median m | misplaced |",
        "| --- | --- | --- | --- |",
    ]
    for row in forgotten:
        median = "gone" if np.isnan(row.median_m) else f"{row.median_m:.0f}"
        lines.append(f"| {row.age_s / 60:g} min | {row.rule} | {median} | {100 * row.misplaced:.0f} % |")
    for where, (under_way, at_rest) in checks.items():
        lines += [
            "",
            f"## The 95 % sets on {where}",
            "",
            "| ships | age | outcomes | as in the file | adapting | after 30 minutes of adapting |",
            "| --- | --- | --- | --- | --- | --- |",
            *_checked("under way", under_way),
            *_checked("at rest", at_rest),
        ]
    return "\n".join(lines) + "\n"


def _checked(who: str, rows: list[Transfer]) -> list[str]:
    lines = []
    for t in rows:
        late = f"{100 * t.adapted_late:.1f} % of {t.scored_late}" if t.scored_late else "-"
        if t.scored:
            shares = f"{100 * t.fixed:.1f} % | {100 * t.adapted:.1f} %"
            lines.append(f"| {who} | {t.age_s / 60:g} min | {t.scored} | {shares} | {late} |")
    return lines
