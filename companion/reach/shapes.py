"""Which model describes which contact, and what of its set only a new report changes."""

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import lru_cache
from typing import Any

import numpy as np

from companion.messages import BoolArray, FloatArray, IntArray, Model, Tracks
from companion.reach.hull import Corners
from companion.reach.interface import Shapes
from companion.reach.kernel import Kernel
from companion.reach.straight import straight_shapes

# every model but DISC
MODELS: dict[Model, Callable[[Tracks, Kernel], Shapes]] = {Model.STRAIGHT: straight_shapes}


@dataclass(frozen=True, slots=True)
class Prepared:
    """The shapes of all contacts, model by model."""

    parts: tuple[tuple[IntArray | None, Shapes], ...]  # rows (None: all) and their shapes
    is_disc: BoolArray  # (n,) rows whose model is DISC at any age
    disc_margin_m: FloatArray  # (n,) what hull and position error add to a disc
    hull_m: FloatArray  # (n,) radius of the circle around the antenna that holds the hull


@dataclass(frozen=True, slots=True, eq=False)
class _Same:
    """Tracks compared by identity: they are immutable."""

    tracks: Tracks

    def __hash__(self) -> int:
        return id(self.tracks)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Same) and self.tracks is other.tracks


def prepare(tracks: Tracks, kernel: Kernel) -> Prepared:
    """The shapes of `tracks`; the latest few are remembered, which no result depends on."""
    return _prepared(_Same(tracks), kernel)


@lru_cache(maxsize=4)
def _prepared(same: _Same, kernel: Kernel) -> Prepared:
    tracks = same.tracks
    length = Corners.of(tracks).length_m
    parts: list[tuple[IntArray | None, Shapes]] = []
    for model, shapes in MODELS.items():
        rows = np.flatnonzero(tracks.model == model)
        if len(rows) == len(tracks):
            parts = [(None, shapes(tracks, kernel))]
            break
        if rows.size:
            parts.append((rows, shapes(only(tracks, rows), kernel)))
    hull = length.max(axis=0, initial=0.0)
    return Prepared(tuple(parts), tracks.model == Model.DISC, hull + tracks.position_error_m, hull)


def only(tracks: Tracks, rows: IntArray) -> Tracks:
    """The tracks of some rows."""
    values = {f.name: getattr(tracks, f.name) for f in fields(tracks)}
    kept: dict[str, Any] = {k: v[rows] for k, v in values.items() if isinstance(v, np.ndarray)}
    return replace(tracks, **kept, names=())
