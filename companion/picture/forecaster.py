"""From what recorded ships did to what these may do: the learned spread of every row.

A ship's features change when her behaviour is looked at anew, every ten seconds; her reports come faster.  So
the scale that they amount to is kept beside them.
"""

from collections.abc import Sequence

import numpy as np

from companion.messages import FloatArray, IntArray
from companion.picture.adaptation import SLOW, STILL, Adaptation
from companion.picture.behaviour import Features
from companion.picture.bounds import Assumptions
from companion.picture.forecast import History
from companion.picture.learned import STILL_MPS, LearnedBounds
from companion.picture.said import Said


class Forecaster:
    """Sizes the sets of ships by a bounds file and by what this water taught."""

    def __init__(self, bounds: LearnedBounds, adaptation: Adaptation) -> None:
        self._bounds = bounds
        self._adaptation = adaptation
        self._features: list[Features | None] = []  # of each slot
        self._log_scale = np.zeros((0, *bounds.base.T.shape))  # and what they amount to, (slots, K, 3)

    def spread_m(
        self,
        said: Said,
        numbers: Sequence[int],
        slots: IntArray,
        histories: Sequence[History | None],
        assumptions: Assumptions,
    ) -> FloatArray:
        """(n, K, 3) how far recorded ships like these strayed, NaN where not known; `numbers` are MMSIs."""
        bounds, adaptation = self._bounds, self._adaptation
        sog = said.sog_mps
        top = assumptions.top_speeds_mps(sog)
        slow = sog < assumptions.slow_below_mps
        found = np.full((len(sog), *self._log_scale.shape[1:]), np.nan)
        if slow.any():
            rest = np.where(sog[slow] < STILL_MPS, STILL, SLOW)
            found[slow] = bounds.at_rest_m(adaptation.raised[rest], sog[slow], top[slow])
        known = [None if each is None else each.known() for each in histories]
        way = ~slow & np.isfinite(sog) & np.isfinite(said.cog_rad)
        way &= np.array([each is not None for each in known])
        told = [each for each, under_way in zip(known, way.tolist(), strict=True) if under_way and each]
        if told:
            at = slots[way]
            self._scale(at, [features for features, _ in told])
            raised = adaptation.raised_of(
                [sort for _, sort in told], (numbers[i] for i in np.flatnonzero(way).tolist())
            )
            found[way] = bounds.spread_m(self._log_scale[at], raised, sog[way], top[way])
        return found

    def _scale(self, slots: IntArray, features: Sequence[Features]) -> None:
        """Bring `_log_scale` of these slots up to date."""
        more = int(slots.max()) + 1 - len(self._features)
        if more > 0:
            more = max(more, len(self._features))
            self._features += [None] * more
            self._log_scale = np.concatenate((self._log_scale, np.zeros((more, *self._log_scale.shape[1:]))))
        held = self._features
        fresh = [
            (slot, new) for slot, new in zip(slots.tolist(), features, strict=True) if held[slot] is not new
        ]
        if fresh:
            for slot, new in fresh:
                held[slot] = new
            self._log_scale[[slot for slot, _ in fresh]] = self._bounds.log_scale(
                np.array([new for _, new in fresh])
            )
