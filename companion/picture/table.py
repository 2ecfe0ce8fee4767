"""Rows of bounds as arrays: one slot per hypothesis, sorted into `Tracks` when something changed."""

from typing import NamedTuple

import numpy as np

from companion.instant import Instant
from companion.messages import SPREAD_AGES_S, BoolArray, FloatArray, IntArray, Tracks
from companion.picture.bounds import Bounds

NEVER = Instant(2**63 - 1)
_COLUMNS = ("north_m", "east_m", *Bounds._fields, "draught_m")
_MODEL = _COLUMNS.index("model")
_SPREAD = (len(SPREAD_AGES_S), 3)


class Block(NamedTuple):
    """What n slots are to say; only `shown` rows are in the tracks.

    `changes_at` is when a row must be looked at again, and no part of what it says.
    """

    measured_at: IntArray
    north_m: FloatArray
    east_m: FloatArray
    bounds: Bounds
    draught_m: FloatArray
    spread_m: FloatArray  # (n, K, 3), or (n, 0, 3) where no row has one
    shown: BoolArray
    changes_at: IntArray


class Table:
    """Storage of rows by slot; a slot is given out, written any number of times, and taken back."""

    def __init__(self) -> None:
        self._free: list[int] = []
        self._used = 0
        self._names: list[str] = []
        self._values = np.zeros((len(_COLUMNS), 64))
        self._whole = np.zeros((2, 64), dtype=np.int64)  # mmsi, measured_at
        self._spread: FloatArray | None = None  # (slots, K, 3) once a row has one
        self._shown = np.zeros(64, dtype=np.bool_)
        self._changes_at = np.full(64, NEVER, dtype=np.int64)
        self._order: IntArray | None = None
        self._named: tuple[str, ...] | None = None
        self._revision = 0
        self._tracks = self._build()

    def new_slot(self) -> int:
        """A slot without a row."""
        if self._free:
            return self._free.pop()
        self._used += 1
        self._names.append("")
        more = len(self._shown)
        if self._used > more:
            self._values = np.concatenate((self._values, np.zeros((len(_COLUMNS), more))), axis=1)
            self._whole = np.concatenate((self._whole, np.zeros((2, more), dtype=np.int64)), axis=1)
            self._shown = np.concatenate((self._shown, np.zeros(more, dtype=np.bool_)))
            self._changes_at = np.concatenate((self._changes_at, np.full(more, NEVER, dtype=np.int64)))
            if self._spread is not None:
                self._spread = np.concatenate((self._spread, np.zeros((more, *_SPREAD))))
        return self._used - 1

    @property
    def size(self) -> int:
        """Slots are numbered below this."""
        return self._used

    def name(self, slot: int, mmsi: int, name: str) -> None:
        """Say whose slot it is, before its row is written."""
        if self._whole[0, slot] != mmsi:
            self._whole[0, slot] = mmsi
            self._order = None
        if self._names[slot] != name:
            self._names[slot] = name
            self._named = None
            self._stale = True

    def write(self, slots: IntArray, block: Block) -> None:
        """Set the rows of n different slots."""
        self._changes_at[slots] = block.changes_at
        if not np.array_equal(self._shown[slots], block.shown):
            self._shown[slots] = block.shown
            self._order = None
            self._stale = True
        values = np.array((block.north_m, block.east_m, *block.bounds, block.draught_m))
        if self._spread is None and block.spread_m.shape[1]:
            self._spread = np.zeros((len(self._shown), *_SPREAD))
        self._change(self._whole, (1, slots), block.measured_at, block.shown)
        self._change(self._values, (slice(None), slots), values, block.shown)
        if self._spread is not None:
            spread = block.spread_m if block.spread_m.shape[1] else np.zeros((len(slots), *_SPREAD))
            self._change(self._spread, slots, spread, block.shown[:, None, None])

    def _change(
        self,
        held: FloatArray | IntArray,
        where: IntArray | tuple[slice | int, IntArray],
        values: FloatArray | IntArray,
        shown: BoolArray,
    ) -> None:
        """What nobody sees changes nothing."""
        if not self._stale:
            old = held[where]
            same = (old == values) | ((old != old) & (values != values))  # noqa: PLR0124
            self._stale = not (same | ~shown).all()
        held[where] = values

    def release(self, slot: int) -> None:
        """Take a slot back."""
        self._changes_at[slot] = NEVER
        self._free.append(slot)
        if self._shown[slot]:
            self._shown[slot] = False
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
            shown = np.flatnonzero(self._shown)
            self._order = shown[np.argsort(self._whole[0, shown], kind="stable")]
            self._named = None
        if self._named is None:
            self._named = tuple(self._names[slot] for slot in self._order)
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
            names=self._named,
            **columns,
        )
