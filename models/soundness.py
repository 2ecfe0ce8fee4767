"""Does a model ever claim more distance than there is?  `python -m models.soundness NAME --points 10000000`

Ships over the model's whole domain, the vehicle from deep inside their sets to kilometres off, through
onnxruntime; the exact tubes decide, and where they say less, the closed-form support.  For ships that turn
the exact tubes are the unions of slabs of `companion.reach.turning`.
Ends with status 1 if one point is unsafe.
"""

import argparse
import sys
from dataclasses import dataclass

import numpy as np
from onnxruntime import InferenceSession

from companion.messages import FloatArray
from companion.planning.model_file import METADATA_KEY, TURNING, decode_metadata, read_bytes
from companion.planning.network import INPUT, OUTPUTS, open_session
from companion.planning.onnx_weights import metadata_text
from companion.planning.rows import COLUMNS
from companion.reach import support_straight
from companion.reach.turning import SLAB_S
from models import sampling

BANDS_M = ((5.0, 10.0), (0.0, 5.0), (5.0, 10.0), (10.0, 200.0), (-60.0, 0.0), (200.0, 30_000.0))
CHUNK = 50_000
PLACES, SLABS_AT_ONCE = 500, 200  # around a ship that turns


@dataclass(frozen=True, slots=True)
class Verdict:
    """What a run found."""

    points: int
    unsafe: int
    nearest_m: float  # least of true minus claimed distance


def least_distance(rows: FloatArray, away: FloatArray) -> FloatArray:
    """(m,) bounds of the true distance from below, by the closed-form support in directions near `away`.

    The second opinion where the tubes' nearest point says less than the model.
    """
    column = dict(zip(COLUMNS, rows.T, strict=True))
    bearing = np.arctan2(away[:, 1], away[:, 0])[:, None] + np.linspace(-0.1, 0.1, 4001)
    support = support_straight(
        column["speed_mps"],
        column["age_s"],
        column["until_age_s"],
        heading_offset_rad=column["heading_rad"] - column["course_rad"],
        directions_rad=bearing - column["course_rad"][:, None],
        **{name: column[name] for name in COLUMNS[6:] if name != "heading_rad"},
    )
    toward = column["north_m"][:, None] * np.cos(bearing) + column["east_m"][:, None] * np.sin(bearing)
    return np.asarray((toward - support).max(axis=1, initial=-np.inf))


def run(name: str, points: int, seed: int = 0, *, show: bool = False) -> Verdict:
    """Compare claimed and true distances at `points` random places."""
    origin, content = read_bytes(name)
    session = open_session(content, origin)
    metadata = decode_metadata(metadata_text(content, METADATA_KEY), origin)
    domain = {i.name: (i.low, i.high) for i in metadata.inputs}
    unsafe, nearest, done = 0, np.inf, 0
    while done < points:
        rng = np.random.default_rng((seed, done))
        low, high = BANDS_M[done // CHUNK % len(BANDS_M)]
        n = min(CHUNK, points - done)
        if metadata.kind == TURNING:
            under = _under_turning(session, rng, n, domain, (low, high))
        else:
            rows = sampling.place(rng, sampling.ships(rng, n, domain), low, high)
            claimed, away, _ = session.run(OUTPUTS, {INPUT: rows})
            under = sampling.exact(rows)[0] - claimed
            doubtful = ~(under >= 0)
            under[doubtful] = least_distance(rows[doubtful], away[doubtful]) - claimed[doubtful]
        unsafe += int((~(under >= 0)).sum())
        nearest = min(nearest, float(under.min()))
        done += n
        if show and done // CHUNK % 20 == 0:
            print(f"{done} points, {unsafe} unsafe, nearest {1000 * nearest:.3f} mm", flush=True)
    return Verdict(done, unsafe, nearest)


def _under_turning(
    session: InferenceSession,
    rng: np.random.Generator,
    n: int,
    domain: sampling.Domain,
    band: tuple[float, float],
) -> FloatArray:
    """(n,) true minus claimed distance, at many places around each of a few ships that turn."""
    parts = []
    for ship in sampling.ships(rng, -(-n // PLACES), domain):
        rows, distance, _ = sampling.crowded(rng, ship, PLACES, *band)
        pieces = max(int(np.ceil((ship[5] - ship[4]) / SLAB_S)), 1) * PLACES // SLABS_AT_ONCE + 1
        claimed = [session.run(OUTPUTS, {INPUT: part})[0] for part in np.array_split(rows, pieces)]
        parts.append(distance - np.concatenate(claimed))
    return np.concatenate(parts)[:n]


def main() -> int:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("model", nargs="?", default="straight")
    parser.add_argument("--points", type=int, default=10_000_000)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    verdict = run(given.model, given.points, given.seed, show=True)
    print(f"{given.model}: {verdict.unsafe} of {verdict.points} points unsafe; true minus claimed distance "
          f"is at least {1000 * verdict.nearest_m:.3f} mm")  # fmt: skip
    return 1 if verdict.unsafe else 0


if __name__ == "__main__":
    sys.exit(main())
