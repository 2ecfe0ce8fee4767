"""Rows of bounds as arrays: one slot per hypothesis, sorted into `Tracks` when something changed."""

from dataclasses import dataclass, field

import numpy as np

from companion.instant import Instant
from companion.messages import SPREAD_AGES_S, FloatArray, IntArray, Tracks
from companion.picture.bounds import Bounds

NEVER = Instant(2**63 - 1)
_COLUMNS = ("north_m", "east_m", *Bounds._fields)
_MODEL = _COLUMNS.index("model")
_SPREAD = (len(SPREAD_AGES_S), 3)


@dataclass(frozen=True, slots=True)
class Row:
    """One slot's contents; only `shown` rows are in the tracks.

    `changes_at` is when it must be looked at again, and no part of what it says.
    """

    mmsi: int
    measured_at: Instant
    north_m: float
    east_m: float
    bounds: Bounds
    name: str
    shown: bool
    changes_at: Instant = field(compare=False)
    spread_m: tuple[float, ...] = ()  # of `Tracks.spread_m`, flat; empty for other models


class Table:
    """Storage of rows by slot; a slot is given out, written any number of times, and taken back."""

    def __init__(self) -> None:
        self._free: list[int] = []
        self._rows: list[Row | None] = []
        self._values = np.zeros((len(_COLUMNS), 64))
        self._whole = np.zeros((2, 64), dtype=np.int64)  # mmsi, measured_at
        self._spread: FloatArray | None = None  # (slots, 4, 3) once a row has one
        self._changes_at = np.full(64, NEVER, dtype=np.int64)
        self._order: IntArray | None = None
        self._revision = 0
        self._tracks = self._build()

    def new_slot(self) -> int:
        """A slot without a row."""
        if self._free:
            return self._free.pop()
        self._rows.append(None)
        if len(self._rows) > len(self._changes_at):
            more = len(self._changes_at)
            self._values = np.concatenate((self._values, np.zeros((len(_COLUMNS), more))), axis=1)
            self._whole = np.concatenate((self._whole, np.zeros((2, more), dtype=np.int64)), axis=1)
            self._changes_at = np.concatenate((self._changes_at, np.full(more, NEVER, dtype=np.int64)))
            if self._spread is not None:
                self._spread = np.concatenate((self._spread, np.zeros((more, *_SPREAD))))
        return len(self._rows) - 1

    def write(self, slot: int, row: Row) -> None:
        """Set a slot's row."""
        old = self._rows[slot]
        self._rows[slot] = row
        self._changes_at[slot] = row.changes_at
        was_shown = old is not None and old.shown
        if not (was_shown or row.shown):
            return
        if was_shown != row.shown or (old is not None and old.mmsi != row.mmsi):
            self._order = None
            self._stale = True
        if row.shown and row != old:
            self._values[:, slot] = (row.north_m, row.east_m, *row.bounds)
            self._whole[:, slot] = (row.mmsi, row.measured_at)
            if row.spread_m and self._spread is None:
                self._spread = np.zeros((len(self._changes_at), *_SPREAD))
            if self._spread is not None:
                self._spread[slot] = np.reshape(row.spread_m, _SPREAD) if row.spread_m else 0.0
            self._stale = True

    def release(self, slot: int) -> None:
        """Take a slot back."""
        old = self._rows[slot]
        self._rows[slot] = None
        self._changes_at[slot] = NEVER
        self._free.append(slot)
        if old is not None and old.shown:
            self._order = None
            self._stale = True

    def due(self, now: Instant) -> list[int]:
        """Slots whose row changes by age alone, up to `now`."""
        return [int(slot) for slot in np.flatnonzero(self._changes_at <= now)]

    def next_change(self) -> Instant:
        """The first instant at which a slot falls due."""
        return Instant(int(self._changes_at.min()))

    def tracks(self) -> Tracks:
        """The shown rows in MMSI order; the same object as long as no row changed."""
        if self._stale:
            self._revision += 1
            self._tracks = self._build()
        return self._tracks

    def _build(self) -> Tracks:
        self._stale = False
        if self._order is None:
            shown = [(row.mmsi, slot) for slot, row in enumerate(self._rows) if row and row.shown]
            self._order = np.array([slot for _, slot in sorted(shown)], dtype=np.int64)
        values = np.take(self._values, self._order, axis=1)
        whole = np.take(self._whole, self._order, axis=1)
        model = values[_MODEL].astype(np.int64)
        spread = np.empty((len(model), 0, 3)) if self._spread is None else self._spread[self._order]
        for array in (values, whole, model, spread):
            array.flags.writeable = False
        columns: dict[str, FloatArray] = dict(zip(_COLUMNS, values, strict=True))
        del columns["model"]
        return Tracks(
            revision=self._revision,
            mmsi=whole[0],
            measured_at_ns=whole[1],
            model=model,
            spread_m=spread,
            names=tuple(row.name for slot in self._order if (row := self._rows[slot])),
            **columns,
        )
