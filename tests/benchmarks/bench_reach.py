"""Figures of the reachable sets, printed and drawn.

    python -m tests.benchmarks.bench_reach speed              microseconds per call
    python -m tests.benchmarks.bench_reach sound [MILLIONS]   sampled points against the sets (default 10)
    python -m tests.benchmarks.bench_reach kernels            compiled against numpy, bit by bit
    python -m tests.benchmarks.bench_reach loose              straight sets against dense hulls
    python -m tests.benchmarks.bench_reach turning            turning tubes against what is reached
    python -m tests.benchmarks.bench_reach boxes              boxes as Flow* makes them
    python -m tests.benchmarks.bench_reach draw FOLDER        the pictures of docs/reachable_sets.md

Not collected by pytest; the tests check smaller versions of the same.
"""

import sys
import timeit
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Literal

import numpy as np
import shapely

from companion import reach
from companion.config import Field
from companion.instant import instant
from companion.messages import Tracks
from companion.planning.field import ExactRepulsion
from tests.benchmarks import pictures, turned
from tests.builders import T0, tracks
from tests.ships import drive, plane, random_ships, random_turns, swing
from tests.test_reach_cross_checks import box_area
from tests.test_reach_straight import dense_hull, stated_domain


def traffic(n: int, seed: int = 0) -> Tracks:
    """n ordinary ships within 10 km, last heard up to ten minutes ago."""
    rng = np.random.default_rng(seed)
    return random_ships(
        rng,
        n,
        north_m=rng.uniform(-1e4, 1e4, n),
        east_m=rng.uniform(-1e4, 1e4, n),
        measured_at_ns=-(rng.uniform(0, 600, n) * 1e9).astype(np.int64),
        sog_mps=rng.uniform(2, 12, n),
        speed_noise_mps=np.full(n, 0.25),
        course_noise_rad=np.full(n, 0.05),
        heading_error_rad=np.full(n, 0.05),
        position_error_m=np.full(n, 10.0),
        bow_m=rng.uniform(20, 200, n),
        stern_m=rng.uniform(5, 50, n),
        port_m=rng.uniform(3, 16, n),
        starboard_m=rng.uniform(3, 16, n),
    )


def speed() -> None:
    """Best of many repetitions, so that other work on the machine counts little."""
    print(f"{'ships':>6} {'call':<34} {'us':>9} {'us/ship':>9}")
    for n in (1, 20, 100, 1000):
        for name, call in calls(traffic(n)).items():
            number = max(2, 1000 // n)
            best = min(timeit.repeat(call, number=number, repeat=40)) / number * 1e6
            print(f"{n:>6} {name:<34} {best:9.1f} {best / n:9.3f}")
    ship, points = traffic(1), np.random.default_rng(1).normal(0, 5000, (1_000_000, 2))
    sets = reach.tube(ship, T0, 600.0)
    best = min(timeit.repeat(lambda: sets.nearest_many(points), number=1, repeat=3))
    print(f"a million gradients of one set: {best:.2f} s; 8 million: {8 * best:.2f} s")


def calls(ships: Tracks) -> dict[str, Callable[[], object]]:
    """What is timed."""
    position, field = np.array((10.0, 20.0)), ExactRepulsion(Field())

    def kernel_calls(name: Literal["numpy", "numba"]) -> dict[str, Callable[[], object]]:
        kernel = reach.choose_kernel(name)
        sets = reach.tube(ships, T0, 600.0, kernel)
        return {
            f"nearest, {name}": lambda: sets.nearest(position),
            f"tube and nearest, {name}": lambda: reach.tube(ships, T0, 600.0, kernel).nearest(position),
        }

    return {
        "new tracks: shapes": lambda: reach.tube(replace(ships), T0, 600.0),
        **kernel_calls("numpy"),
        **kernel_calls("numba"),
        "exact field (tube, nearest, eq. 8)": lambda: field(ships, T0, 600.0, position),
    }


def sound(millions: float) -> None:
    """Straight and turning ships by turns; every sampled point against its own ship's set."""
    rng, each, done, worst = np.random.default_rng(0), 5000, 0, -np.inf
    while done < millions * 1e6:
        turning = rng.random() < 0.1
        ship = (random_turns if turning else random_ships)(rng, 1)
        age = float(ship.age_s(T0)[0])
        until = age + float(rng.choice([0.0, 5.0, 60.0, 300.0]))
        points = (swing if turning else drive)(rng, ship, 0, age, until, each)
        distance, _ = reach.tube(ship, T0, until).nearest_many(plane(points))
        worst, done = max(worst, float(distance.max())), done + each
    print(f"{done} points of {done // each} ships: worst distance outside its set {worst:.2e} m")


def kernels() -> None:
    """Distances and directions of both kernels for random sets and points, inside and outside."""
    rng, unequal, apart, total = np.random.default_rng(0), 0, 0.0, 0
    for _ in range(200):
        ships = random_ships(rng, 200)
        position = rng.normal(0, 4000, (200, 2))
        one, other = (
            reach.tube(ships, T0, 600.0, reach.choose_kernel(k)).nearest(position) for k in ("numpy", "numba")
        )
        pairs = ((one.distance_m, other.distance_m), (one.away, other.away))
        unequal += sum(int((a != b).sum()) for a, b in pairs)
        apart = max(apart, float(np.abs(one.distance_m - other.distance_m).max()))
        total += 600
    print(f"{unequal} of {total} values differ; distances by at most {apart:.1e} m")


def loose() -> None:
    """The largest excess of the support over a dense shapely hull's, over the stated domain."""
    rng = np.random.default_rng(1)
    angle = np.linspace(0, 2 * np.pi, 1440, endpoint=False)
    normal = np.column_stack((np.cos(angle), np.sin(angle)))
    excess = []
    for _ in range(200):
        ship = stated_domain(rng, 1)
        age = float(ship.age_s(T0)[0])
        ours = reach.tube(ship, T0, 600.0).support(normal)[0]
        dense = shapely.get_coordinates(dense_hull(ship, age, max(age, 600.0))) @ normal.T
        excess.append(ours - dense.max(axis=0))
    values = np.array(excess)
    print(f"support minus dense hull: min {values.min():.1e}, p99 {np.quantile(values, 0.99):.4f}, ")
    print(f"max {values.max():.4f} m over {len(values)} ships (the dense hull itself lacks up to 4 mm)")


def turning() -> None:
    """Gap from the tube's boundary to the really reached, motion only, at 8 m/s."""
    print("rate rad/s  error   ages s    area ratio   gap m: mean    p95    max")
    for rate in (0.0, 0.002, 0.005, 0.01):
        for error in (1e-4, 1e-3):
            for first, last in ((0.0, 60.0), (60.0, 120.0), (60.0, 300.0), (120.0, 120.0)):
                ratio, gap = turned.looseness(turned.example(rate, error, first), last)
                figures = f"{gap.mean():13.2f} {np.quantile(gap, 0.95):6.2f} {gap.max():6.2f}"
                print(f"{rate:9.3f} {error:8.4f} {first:4.0f}-{last:3.0f} {ratio:11.3f} {figures}")
    ship = turned.example(0.005, 1e-3, 0.0)
    rng = np.random.default_rng(0)

    def fresh() -> None:
        reach.tube(replace(ship, sog_mps=ship.sog_mps + rng.random()), T0, 300.0)

    print(f"a tube of 300 s: {min(timeit.repeat(fresh, number=1, repeat=20)) * 1e3:.1f} ms, once a second")


def boxes() -> None:
    """Area of axis-parallel boxes over the exact area at 600 s, and how many boxes make a tube as small."""
    ship = {"bow_m": 0.0, "stern_m": 0.0, "port_m": 0.0, "starboard_m": 0.0}
    print(
        "heading   box / exact at 600 s   boxes needed for a tube [0, 600] of at most 1.5, 1.1 times the area"
    )
    for course in (0.0, 0.1, 0.25, 0.5, 0.785):
        contact = tracks({"cog_rad": course, **ship})
        exact = shapely.Polygon(reach.at(contact, instant(600.0)).outline(0)).area
        tube = shapely.Polygon(reach.tube(contact, T0, 600.0).outline(0)).area
        needed = [_boxes_needed(course, tube, ratio) for ratio in (1.5, 1.1)]
        ratio = box_area(course, 5.0, 0.05, 0.01, 600.0) / exact
        print(f"{course:7.3f} {ratio:14.2f} {' ':20} {needed[0]:>8} {needed[1]:>8}")


def _boxes_needed(course: float, tube_area: float, ratio: float) -> str:
    for count in (2**k for k in range(14)):
        times = np.linspace(0, 600, count + 1)
        union = shapely.union_all([_box(course, a, b) for a, b in pairwise(times)])
        if union.area <= ratio * tube_area:
            return str(count)
    return "never"


def _box(course: float, start_s: float, end_s: float) -> shapely.Polygon:
    """The box that intervals give over [start, end]."""
    low, high = course - 0.01, course + 0.01
    courses = np.array([low, high, *[q for q in np.arange(-4, 5) * np.pi / 2 if low < q < high]])
    runs = np.outer((start_s * 4.95, start_s * 5.05, end_s * 4.95, end_s * 5.05), np.exp(1j * courses))
    made: shapely.Polygon = shapely.box(runs.real.min(), runs.imag.min(), runs.real.max(), runs.imag.max())
    return made


def main(words: list[str]) -> None:
    """See the module's docstring."""
    match words:
        case ["speed"]:
            speed()
        case ["sound", *rest]:
            sound(float(rest[0]) if rest else 10.0)
        case ["kernels"]:
            kernels()
        case ["loose"]:
            loose()
        case ["turning"]:
            turning()
        case ["boxes"]:
            boxes()
        case ["draw", folder]:
            pictures.draw(Path(folder))
        case _:
            sys.exit(__doc__)


if __name__ == "__main__":
    main(sys.argv[1:])
