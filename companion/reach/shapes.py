"""Which model describes which contact, and what of its set only a new report changes."""

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import lru_cache
from typing import Any

import numpy as np

from companion.messages import FloatArray, IntArray, Model, Tracks
from companion.reach.disc import disc_shapes
from companion.reach.interface import Shapes
from companion.reach.kernel import Kernel
from companion.reach.spread import spread_shapes
from companion.reach.straight import straight_shapes
from companion.reach.turning import turning_shapes

MODELS: dict[Model, Callable[[Tracks, Kernel], Shapes]] = {
    Model.STRAIGHT: straight_shapes,
    Model.DISC: disc_shapes,
    Model.TURNING: turning_shapes,
    Model.KITE: spread_shapes,
    Model.BOX: spread_shapes,
}


@dataclass(frozen=True, slots=True)
class Prepared:
    """The shapes of all contacts, model by model."""

    parts: tuple[tuple[IntArray | None, Shapes], ...]  # rows (None: all) and their shapes
    turned_m: FloatArray  # (n,) what the hull adds on all sides when it may have turned any way


@dataclass(frozen=True, slots=True, eq=False)
class Same:
    """Tracks compared by identity: they are immutable."""

    tracks: Tracks

    def __hash__(self) -> int:
        return id(self.tracks)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Same) and self.tracks is other.tracks


def prepare(tracks: Tracks, kernel: Kernel) -> Prepared:
    """The shapes of `tracks`; the latest few are remembered, which no result depends on."""
    return _prepared(Same(tracks), kernel)


@lru_cache(maxsize=4)
def _prepared(same: Same, kernel: Kernel) -> Prepared:
    tracks = same.tracks
    parts: list[tuple[IntArray | None, Shapes]] = []
    for model, shapes in MODELS.items():
        rows = np.flatnonzero(tracks.model == model)
        if len(rows) == len(tracks):
            parts = [(None, shapes(tracks, kernel))]
            break
        if rows.size:
            parts.append((rows, shapes(only(tracks, rows), kernel)))
    if sum(len(tracks) if rows is None else len(rows) for rows, _ in parts) != len(tracks):
        raise ValueError(f"tracks.model has a number that is none of {list(MODELS)}")
    # a distance that is no number would let a ship out of every comparison
    for column in fields(tracks):
        values = getattr(tracks, column.name)
        may_be_open = column.name in ("validity_s", "draught_m")
        if isinstance(values, np.ndarray) and not may_be_open and not np.isfinite(values).all():
            raise ValueError(f"tracks.{column.name} has a value that is no finite number")
    return Prepared(tuple(parts), hull_m(tracks))


def hull_m(tracks: Tracks) -> FloatArray:
    """(n,) what the hull adds on all sides when it may have turned any way; a disc has it already."""
    hull = np.hypot(np.maximum(tracks.bow_m, tracks.stern_m), np.maximum(tracks.port_m, tracks.starboard_m))
    return np.where(tracks.model == Model.DISC, 0.0, hull)


def only(tracks: Tracks, rows: IntArray) -> Tracks:
    """The tracks of some rows."""
    values = {f.name: getattr(tracks, f.name) for f in fields(tracks)}
    kept: dict[str, Any] = {k: v[rows] for k, v in values.items() if isinstance(v, np.ndarray)}
    return replace(tracks, **kept, names=())
