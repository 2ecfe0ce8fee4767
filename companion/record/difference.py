"""The first difference between two records.  Pure."""

import math
from dataclasses import dataclass

import msgspec


@dataclass(frozen=True, slots=True)
class Tolerance:
    """How far two numbers may lie apart and still be the same: |a - b| <= absolute + relative |a|."""

    absolute: float
    relative: float

    @property
    def is_exact(self) -> bool:
        """No difference is allowed: records are compared byte for byte."""
        return self.absolute == 0.0 and self.relative == 0.0


EXACT = Tolerance(0.0, 0.0)
# Another processor adds up the network's float32 products in another order: a few units of
# 2^-24 (6e-8) per layer, times saturated repulsions.  The one place this is written down.
OTHER_MACHINE = Tolerance(absolute=1e-5, relative=1e-4)

_EXACT_ONLY = frozenset({"digest", "text"})  # a last digit changes these beyond comparison


@dataclass(frozen=True, slots=True)
class FieldDifference:
    """Where two records differ: a path like `nearest[2].distance_m`, and both values."""

    path: str
    recorded: object
    replayed: object


def first_difference(
    recorded: bytes, replayed: bytes, tolerance: Tolerance = EXACT
) -> FieldDifference | None:
    """Compare two JSON records; None when they are the same."""
    if recorded == replayed:
        return None
    found = _compare("", msgspec.json.decode(recorded), msgspec.json.decode(replayed), tolerance)
    if found is None and tolerance.is_exact:
        return FieldDifference("", recorded, replayed)  # equal values, other bytes
    return found


def _compare(path: str, a: object, b: object, tolerance: Tolerance) -> FieldDifference | None:
    if isinstance(a, dict) and isinstance(b, dict):
        for key in sorted(a.keys() | b.keys()):
            if key in _EXACT_ONLY and not tolerance.is_exact:
                continue
            found = _compare(f"{path}.{key}".lstrip("."), a.get(key), b.get(key), tolerance)
            if found is not None:
                return found
        return None
    if isinstance(a, list) and isinstance(b, list) and len(a) == len(b):
        for i, (x, y) in enumerate(zip(a, b, strict=True)):
            found = _compare(f"{path}[{i}]", x, y, tolerance)
            if found is not None:
                return found
        return None
    return None if _same(a, b, tolerance) else FieldDifference(path, a, b)


def _same(a: object, b: object, tolerance: Tolerance) -> bool:
    if isinstance(a, float) and isinstance(b, float):
        return a == b or math.isclose(a, b, rel_tol=tolerance.relative, abs_tol=tolerance.absolute)
    return type(a) is type(b) and a == b
