"""How far a model is from the exact field, measured through onnxruntime."""

import numpy as np

from companion.messages import FloatArray
from companion.planning.field import repulsion_strength
from companion.planning.network import infer, open_session
from companion.planning.rows import COLUMNS
from models import sampling
from models.spec import Spec

POINTS = 40_000
TURNING_POINTS = 20_000


def errors(content: bytes, spec: Spec) -> dict[str, float]:
    """Distance, direction and magnitude errors between delta and twice delta from the set."""
    session = open_session(content, spec.name)
    near_m, far_m = spec.field.delta_m, 2 * spec.field.delta_m
    rng = np.random.default_rng((spec.seed, 1))
    points = POINTS if len(spec.domain) == len(COLUMNS) else TURNING_POINTS
    rows = sampling.around(rng, points, spec.domain, near_m, far_m)
    distance, away, velocity = infer(session, rows)
    true_distance, true_away = sampling.exact(rows)
    near = (true_distance >= 0.98 * near_m) & (true_distance <= 1.02 * far_m)
    under = (true_distance - distance)[near]
    turned = degrees_between(away, true_away)[near]
    strength = repulsion_strength(true_distance, spec.field.k_r, spec.field.delta_m)
    relative = np.abs(np.hypot(velocity[:, 0], velocity[:, 1]) / strength - 1)[near]
    return {
        "points": float(near.sum()),
        "unsafe_points": float((under < 0).sum()),
        "unsafe_max_m": max(-float(under.min()), 0.0),
        **percentiles("distance_under_m", under),
        **percentiles("direction_deg", turned),
        **percentiles("magnitude_relative", relative),
    }


def degrees_between(a: FloatArray, b: FloatArray) -> FloatArray:
    """(n,) angles between unit vectors (n, 2)."""
    cross, dot = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], (a * b).sum(axis=1)
    return np.asarray(np.degrees(np.abs(np.arctan2(cross, dot))))


def percentiles(name: str, values: FloatArray) -> dict[str, float]:
    """p50, p95, p99 and the greatest value."""
    at = np.percentile(values, [50, 95, 99, 100])
    return {f"{name}_{p}": float(v) for p, v in zip(("p50", "p95", "p99", "max"), at, strict=True)}
