"""Outcomes of recorded traffic as arrays."""

from collections.abc import Iterable
from dataclasses import dataclass, fields

import numpy as np

from companion import config
from companion.messages import (
    SPREAD_AGES_S,
    BoolArray,
    ContactReport,
    FloatArray,
    Heard,
    IntArray,
    OwnPosition,
)
from companion.picture import Picture
from companion.picture.behaviour import FEATURES
from companion.picture.forecast import Outcome

# the stated ages, and others around them that only help to fit
WATCHED_S = (*SPREAD_AGES_S, 45.0, 80.0, 150.0, 250.0, 350.0, 540.0, 660.0)
WINDOWS_S = ((35.0, 90.0), (80.0, 180.0), (240.0, 360.0), (540.0, 660.0))  # fitted together with an age


@dataclass(frozen=True, slots=True)
class Dataset:
    """n outcomes.  `vessel` numbers the ships of all files; `watch` indexes `WATCHED_S`."""

    vessel: IntArray
    at_ns: IntArray
    watch: IntArray
    age_s: FloatArray
    sog_mps: FloatArray
    ahead_m: FloatArray
    aside_m: FloatArray
    under_way: BoolArray
    sort: IntArray
    features: FloatArray  # (n, F)

    def __len__(self) -> int:
        return len(self.vessel)

    def only(self, rows: BoolArray | IntArray) -> "Dataset":
        """Some of the outcomes."""
        return Dataset(*(getattr(self, f.name)[rows] for f in fields(self)))

    def at(self, k: int) -> "Dataset":
        """Those that count for the k-th stated age, ships under way."""
        return self.only((self.watch == k) & self.under_way)

    def around(self, k: int) -> "Dataset":
        """Those fitted together with the k-th stated age, ships under way."""
        low, high = WINDOWS_S[k]
        return self.only((self.age_s >= low) & (self.age_s <= high) & self.under_way)

    @classmethod
    def joined(cls, parts: list["Dataset"]) -> "Dataset":
        """Several files as one; a number heard in two files is two vessels."""
        first = 0
        columns: dict[str, list[np.ndarray[tuple[int, ...], np.dtype[np.generic]]]] = {
            f.name: [] for f in fields(cls)
        }
        for part in parts:
            for f in fields(cls):
                values = getattr(part, f.name)
                columns[f.name].append(values + first if f.name == "vessel" else values)
            first += int(part.vessel.max(initial=-1)) + 1
        return cls(**{name: np.concatenate(values) for name, values in columns.items()})


class Collector:
    """A `Watch` that keeps everything."""

    def __init__(self, ages_s: tuple[float, ...] = WATCHED_S) -> None:
        self._ages_s = ages_s
        self.outcomes: list[Outcome] = []

    @property
    def ages_s(self) -> tuple[float, ...]:
        """See `Watch`."""
        return self._ages_s

    def take(self, outcome: Outcome) -> None:
        """Keep it."""
        self.outcomes.append(outcome)

    def dataset(self) -> Dataset:
        """What was collected."""
        kept = self.outcomes
        numbers = {mmsi: i for i, mmsi in enumerate(sorted({o.mmsi for o in kept}))}
        return Dataset(
            vessel=np.array([numbers[o.mmsi] for o in kept], dtype=np.int64),
            at_ns=np.array([o.at for o in kept], dtype=np.int64),
            watch=np.array([o.watch for o in kept], dtype=np.int64),
            age_s=np.array([o.age_s for o in kept]),
            sog_mps=np.array([o.forecast.fix.sog_mps or 0.0 for o in kept]),
            ahead_m=np.array([o.ahead_m for o in kept]),
            aside_m=np.array([o.aside_m for o in kept]),
            under_way=np.array([o.forecast.fix.is_under_way for o in kept], dtype=np.bool_),
            sort=np.array([o.forecast.sort for o in kept], dtype=np.int64),
            features=np.array([o.forecast.features for o in kept]).reshape(len(kept), len(FEATURES)),
        )


def collect(heard: Iterable[Heard], collector: Collector | None = None) -> Dataset:
    """Run recorded traffic through a picture, so that only what it believes counts, and keep the outcomes."""
    collector = collector or Collector()
    picture = Picture(config.Contacts(), most_contacts=100_000, watch=collector)
    for each in heard:
        if isinstance(each, ContactReport):
            picture.observe(each)
        elif isinstance(each, OwnPosition):
            picture.observe_own(each)
    return collector.dataset()
