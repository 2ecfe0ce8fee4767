"""`companion calibrate`: recorded traffic to a bounds file and a report."""

import argparse
from collections import Counter
from pathlib import Path

import numpy as np

from companion.calibrate import bounds_file, pictures, report
from companion.calibrate.conformal import calibrate
from companion.calibrate.dataset import Dataset, collect
from companion.calibrate.evaluate import figures, forgetting
from companion.calibrate.fit import Shape
from companion.calibrate.transfer import Transfer, foretold, is_at_rest, replayed
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
    checks = {path.name: _checked(text, str(target), path) for path in options.check}
    sources = ", ".join(path.name for path in options.traffic)
    pictures.draw(folder / f"{options.name}.bounds.png", found, forgotten, f"Bounds learned from {sources}")
    given = " ".join([*(path.name for path in options.traffic), f"--name {options.name}"])
    given += f" --splits {options.splits} --seed {options.seed}"
    given += "".join(f" --check {path.name}" for path in options.check)
    about = report.About(options.name, sources, vessels, shape, options.splits, given)
    page = report.text(about, found, forgotten, checks)
    (folder / f"{options.name}.bounds.md").write_text(page, encoding="utf-8")
    print(page)
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


def _checked(text: str, origin: str, path: Path) -> dict[float, tuple[list[Transfer], list[Transfer]]]:
    """By level, ships under way and at rest."""
    outcomes = foretold(read(path, Counter()))
    found = {}
    for level in REPORTED:
        bounds = learned.prepare(learned.parse(text, origin), level, origin)
        found[level] = replayed(bounds, outcomes), replayed(bounds, outcomes, is_at_rest)
    return found
