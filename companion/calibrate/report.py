"""The page beside a bounds file: what was measured, as Markdown."""

from dataclasses import dataclass

import numpy as np

from companion.calibrate.evaluate import Figure, Forgetting
from companion.calibrate.fit import Shape
from companion.calibrate.transfer import Transfer

HEADINGS = "| outcomes | as in the file | adapting | after 30 minutes | of the best disc | by sort |"
Checks = dict[str, dict[float, tuple[list[Transfer], list[Transfer]]]]  # file, level: under way, at rest


@dataclass(frozen=True, slots=True)
class About:
    """How the bounds were made."""

    name: str
    sources: str
    vessels: int
    shape: Shape
    splits: int
    given: str  # to the command


def text(about: About, found: list[Figure], forgotten: list[Forgetting], checks: Checks) -> str:
    """The whole page."""
    lines = [
        f"# Bounds `{about.name}`",
        "",
        f"`companion calibrate {about.given}`",
        "",
        f"Learned from {about.sources}: {about.vessels} vessels under way, sets of shape *{about.shape}*.",
        f"Measured on vessels set aside, {about.splits} splits by vessel, a quarter each, dealt so that each",
        "is set aside equally often. Areas are of the antenna's set, without hull and position error. The",
        "best discs around the straight prediction hold, of all recorded outcomes, exactly the level wanted,",
        "and exactly the share that these sets held; the ratios are to the one and to the other.",
        "",
        f"![coverage and area]({about.name}.bounds.png)",
        "",
        "| age | wanted | coverage | km2 | disc of the level | of equal coverage | ratios | by sort (km2) |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
        *map(_figure, found),
        "",
        "Sorts of ship differ: sets of least mean area leave out ships that shuttle more often than others.",
        "At run time each sort, and each ship that left her sets, adapts until it is covered as wanted.",
        "",
        "## What forgetting costs",
        "",
        "Ships under way, by the rules of other systems: median distance from where the ship is shown, and",
        "the share more than 0.1 nautical miles off, or not shown at all.",
        "",
        "| age | rule | median m | misplaced |",
        "| --- | --- | --- | --- |",
        *map(_forgetting, forgotten),
    ]
    for where, by_level in checks.items():
        lines += ["", f"## On {where}", *_explained(by_level)]
        for level, (under_way, at_rest) in by_level.items():
            lines += [
                "",
                f"| {100 * level:g} % wanted {HEADINGS}",
                "| --- | --- | --- | --- | --- | --- | --- |",
                *_checked("under way", under_way),
                *_checked("at rest", at_rest),
            ]
    return "\n".join(lines) + "\n"


def _figure(f: Figure) -> str:
    sorts = ", ".join(f"{s} {100 * c:.1f} % ({a:.3g})" for s, (c, a, _) in f.by_sort.items())
    return (
        f"| {f.age_s / 60:g} min | {100 * f.level:g} % | {100 * f.coverage:.1f} % | {f.area_km2:.3g} "
        f"| {f.level_disc_km2:.3g} | {f.equal_disc_km2:.3g} | {f.ratio_to_level:.2f}, {f.ratio:.2f} "
        f"| {sorts} |"
    )


def _forgetting(row: Forgetting) -> str:
    median = "gone" if np.isnan(row.median_m) else f"{row.median_m:.0f}"
    return f"| {row.age_s / 60:g} min | {row.rule} | {median} | {100 * row.misplaced:.0f} % |"


def _explained(by_level: dict[float, tuple[list[Transfer], list[Transfer]]]) -> list[str]:
    late = any(t.scored_late for both in by_level.values() for rows in both for t in rows)
    if not late:
        return ["", "Shorter than half an hour: what comes after it cannot be shown."]
    return [
        "",
        "Sets as they stood when the forecast was made. After 30 minutes, with the 95 % interval that the",
        "number would have if no two outcomes were of one ship, and the mean area in parts of this water's",
        "best disc of the level.",
    ]


def _checked(who: str, rows: list[Transfer]) -> list[str]:
    lines = []
    for t in rows:
        if not t.scored:
            continue
        late = area = sorts = "-"
        if t.scored_late:
            low, high = t.interval_late
            late = f"{100 * t.adapted_late:.1f} % of {t.scored_late} ({100 * low:.1f} to {100 * high:.1f})"
        if np.isfinite(t.area_ratio_late):
            area = f"{t.area_ratio_late:.2f}"
            sorts = ", ".join(f"{name} {100 * share:.0f} %" for name, share in t.by_sort_late.items())
        shares = f"{100 * t.fixed:.1f} % | {100 * t.adapted:.1f} %"
        lines.append(f"| {who}, {t.age_s / 60:g} min | {t.scored} | {shares} | {late} | {area} | {sorts} |")
    return lines
