"""How far the bounds hold: by seed of the splits, and from one water on another.

    python -m tests.benchmarks.bench_bounds seeds FIRST LAST     Houston's vessels, 16 splits for each seed
    python -m tests.benchmarks.bench_bounds close FIRST LAST     the same, of ages within 5 % of those stated
    python -m tests.benchmarks.bench_bounds waters               every water's bounds on every other

The waters are the recordings; Houston's vessels by halves, the northern and the southern (each where its
median latitude is) on one another; and the short recordings again and again, ships of new numbers each time,
for an hour and a half.  What was chosen on splits was chosen on seeds 1 to 5 and 101 to 103.  Half a minute
of one core for a seed, a minute for the waters; not collected by pytest.
"""

import sys
from collections import Counter
from pathlib import Path

import numpy as np
from msgspec.structs import replace

from companion.calibrate import bounds_file
from companion.calibrate.conformal import calibrate
from companion.calibrate.dataset import WATCHED_S, Collector, Dataset, collect
from companion.calibrate.evaluate import Figure, figures
from companion.calibrate.transfer import Transfer, replayed
from companion.edges import traffic
from companion.instant import after
from companion.messages import SPREAD_AGES_S
from companion.picture import learned
from companion.picture.forecast import Outcome

DATA = Path(__file__).parents[3] / "shared" / "data"
HOUSTON = "ais_houston_ship_channel_20200101_1500-1700Z.csv.gz"
GULF = "n2k_gulf_of_finland_20140815_refragmented.candump.gz"
IJSSELMEER = "n2k_ijsselmeer_20221130_native.candump.gz"
SPLITS, LEVELS = 16, (0.95, 0.99)
CLOSE = 0.05
REPEATED_S = 5400.0


def water(name: str) -> list[Outcome]:
    """A recording's outcomes at all watched ages."""
    collector = Collector()
    collect(traffic.read(DATA / name, Counter()), collector)
    return collector.outcomes


def half(outcomes: list[Outcome], *, north: bool) -> list[Outcome]:
    """Those of the vessels whose median latitude is on that side of the median vessel under way."""
    seen: dict[int, list[float]] = {}
    for o in outcomes:
        if o.forecast.fix.is_under_way:
            seen.setdefault(o.mmsi, []).append(o.forecast.fix.latitude_deg)
    where = {mmsi: float(np.median(latitudes)) for mmsi, latitudes in seen.items()}
    cut = float(np.median(list(where.values())))
    return [o for o in outcomes if o.mmsi in where and (where[o.mmsi] >= cut) == north]


def dataset(outcomes: list[Outcome]) -> Dataset:
    """To learn from."""
    collector = Collector()
    collector.outcomes = outcomes
    return collector.dataset()


def repeated(outcomes: list[Outcome], span_s: float) -> list[Outcome]:
    """A recording of that length again and again until `REPEATED_S`, its ships with new numbers each time."""
    found: list[Outcome] = []
    for i in range(round(REPEATED_S / span_s)):
        for o in outcomes:
            fix = replace(o.forecast.fix, at=after(o.forecast.fix.at, i * span_s))
            forecast = replace(o.forecast, fix=fix)
            found.append(o._replace(mmsi=o.mmsi + i * 10**9, at=after(o.at, i * span_s), forecast=forecast))
    return found


def seeds(first: int, last: int, *, close: bool = False) -> None:
    """Coverage and ratios of each seed, and the least, median and greatest."""
    data = dataset(water(HOUSTON))
    if close:
        stated = np.array(WATCHED_S)[data.watch]
        data = data.only(abs(data.age_s - stated) <= CLOSE * stated)
    by_age: dict[tuple[float, float], list[Figure]] = {}
    for seed in range(first, last + 1):
        for f in figures(data, "kite", LEVELS, SPLITS, np.random.default_rng(seed)):
            by_age.setdefault((f.level, f.age_s), []).append(f)
            print(
                f"seed {seed:3d}  {100 * f.level:g} %  {f.age_s / 60:4g} min  {100 * f.coverage:.1f} %  "
                f"{f.area_km2:8.4f} km2  {f.ratio_to_level:.2f} of the level's disc, {f.ratio:.2f}",
                flush=True,
            )
    print("\nleast, median and greatest of the seeds")
    for (level, age_s), found in sorted(by_age.items()):
        print(
            f"{100 * level:g} %  {age_s / 60:4g} min  coverage {_range([100 * f.coverage for f in found], 1)}"
            f"  of the level's disc {_range([f.ratio_to_level for f in found], 2)}"
            f"  of equal coverage {_range([f.ratio for f in found], 2)}"
        )


def _range(values: list[float], digits: int) -> str:
    return " ".join(f"{x:.{digits}f}" for x in (min(values), float(np.median(values)), max(values)))


def waters() -> None:
    """Coverage on one water of the bounds of another, as in the file and adapting."""
    houston, gulf, ijsselmeer = water(HOUSTON), water(GULF), water(IJSSELMEER)
    north, south = half(houston, north=True), half(houston, north=False)
    open_water = Dataset.joined([dataset(gulf), dataset(ijsselmeer)])
    for name, data, other in (
        ("Gulf of Finland and IJsselmeer on Houston", open_water, houston),
        ("Gulf of Finland on Houston", dataset(gulf), houston),
        ("Houston on the Gulf of Finland", dataset(houston), gulf),
        ("Houston on the IJsselmeer", dataset(houston), ijsselmeer),
        ("Houston north on south", dataset(north), south),
        ("Houston south on north", dataset(south), north),
        ("Houston on the Gulf again and again", dataset(houston), repeated(gulf, 600.0)),
        ("Houston on the IJsselmeer again and again", dataset(houston), repeated(ijsselmeer, 180.0)),
    ):
        found = calibrate(data, "kite", np.random.default_rng(0))
        scored = [o for o in other if o.watch < len(SPREAD_AGES_S)]
        text = bounds_file.text(found, data, LEVELS, [name])
        for level in LEVELS:
            for t in replayed(learned.prepare(learned.parse(text, name), level, name), scored):
                if t.scored:
                    print(f"{name}  {100 * level:g} %  {_told(t)}", flush=True)


def _told(t: Transfer) -> str:
    told = f"{t.age_s / 60:4g} min  {t.scored:5d}: {100 * t.fixed:.1f} % -> {100 * t.adapted:.1f} %"
    if not t.scored_late:
        return told
    low, high = t.interval_late
    sorts = ", ".join(f"{sort} {100 * share:.0f}" for sort, share in t.by_sort_late.items())
    return (
        f"{told}; after half an hour {100 * t.adapted_late:.1f} % of {t.scored_late} "
        f"({100 * low:.1f} to {100 * high:.1f}), {t.area_ratio_late:.2f} of the disc; {sorts}"
    )


if __name__ == "__main__":
    if sys.argv[1:2] in (["seeds"], ["close"]):
        seeds(int(sys.argv[2]), int(sys.argv[3]), close=sys.argv[1] == "close")
    else:
        waters()
