"""The rows of the tracks: every place of every contact as numbers, told for many contacts at once.

A report costs little until somebody asks for the tracks; then the rows of the contacts touched since are
written with one pass of numpy over all of them.
"""

from collections.abc import Iterable

import numpy as np

from companion.geodesy import LocalFrame
from companion.instant import Instant
from companion.messages import FloatArray, Tracks
from companion.picture.adaptation import SLOW, STILL, Adaptation
from companion.picture.area import ALWAYS, entries_ns
from companion.picture.association import Hypothesis
from companion.picture.bounds import Assumptions
from companion.picture.contact import Contact
from companion.picture.learned import STILL_MPS
from companion.picture.table import NEVER, Block, Table


class Rows:
    """Which slots of the table belong to which contact, and what they say."""

    def __init__(self, assumptions: Assumptions, adaptation: Adaptation | None) -> None:
        self._assumptions = assumptions
        self._adaptation = adaptation
        self._table = Table()
        self._slots: dict[int, list[int]] = {}  # of an MMSI's places, in the order of its places
        self._owner: dict[int, int] = {}  # slot -> mmsi
        self.next_change = NEVER  # when a row changes by age alone

    def tracks(self) -> Tracks:
        """The rows as last written; the same object as long as none changed."""
        return self._table.tracks()

    def due(self, now: Instant) -> set[int]:
        """The MMSIs with a row that changes by age alone, up to `now`."""
        return {self._owner[slot] for slot in self._table.due(now)}

    def remove(self, mmsi: int) -> None:
        """A contact is known no more."""
        self._resize(mmsi, 0)
        self.next_change = ALWAYS  # the tracks are told anew

    def write(self, touched: Iterable[Contact], now: Instant, frame: LocalFrame) -> None:
        """Tell the rows of `touched` anew."""
        contacts: list[Contact] = []
        places: list[Hypothesis] = []
        slots: list[int] = []
        for contact in touched:
            held = contact.places.held
            slots += self._resize(contact.mmsi, len(held))
            for place in held:
                contacts.append(contact)
                places.append(place)
        if places:
            self._table.write(np.array(slots), self._block(contacts, places, now, frame))
        self.next_change = self._table.next_change()

    def _block(
        self, contacts: list[Contact], places: list[Hypothesis], now: Instant, frame: LocalFrame
    ) -> Block:
        reports = [place.motion.report for place in places]
        extents = [self._assumptions.extent(c.hull, c.kind) for c in contacts]
        bounds, spread = self._assumptions.of(reports, extents, self._learned_m(contacts, places))
        where = np.array([(r.latitude_deg, r.longitude_deg) for r in reports], dtype=np.float64)
        measured_at = np.array([r.measured_at for r in reports], dtype=np.int64)
        hull_m = np.maximum(bounds.bow_m, bounds.stern_m) + np.maximum(bounds.port_m, bounds.starboard_m)
        enters_at = entries_ns(
            (frame.latitude_deg, frame.longitude_deg),
            where,
            measured_at,
            hull_m + bounds.position_error_m,
            bounds.top_speed_mps,
        )
        hidden = np.array([c.echo.hides(now) for c in contacts])
        shown = (enters_at <= now) & ~hidden
        north, east = frame.to_local_many(where[:, 0], where[:, 1])
        turns = np.stack((enters_at, np.array([c.echo.hidden_until or NEVER for c in contacts])))
        return Block(
            mmsi=np.array([c.mmsi for c in contacts], dtype=np.int64),
            measured_at=measured_at,
            # a place beyond the horizon has no coordinates on the tangent plane, and needs none
            north_m=np.where(shown, north, 0.0),
            east_m=np.where(shown, east, 0.0),
            bounds=bounds,
            draught_m=np.array([c.draught_m for c in contacts], dtype=np.float64),
            spread_m=spread,
            names=[c.name for c in contacts],
            shown=shown,
            changes_at=np.where(turns > now, turns, NEVER).min(axis=0),
        )

    def _learned_m(self, contacts: list[Contact], places: list[Hypothesis]) -> FloatArray | None:
        """(n, K, 3) how far recorded ships like these strayed; NaN where that is not known."""
        bounds, adaptation = self._assumptions.learned, self._adaptation
        if bounds is None or adaptation is None:
            return None
        reports = [place.motion.report for place in places]
        said = np.array([(r.sog_mps, r.cog_rad) for r in reports], dtype=np.float64)  # None becomes NaN
        sog = said[:, 0]
        top = self._assumptions.top_speeds_mps(sog)
        slow = sog < self._assumptions.slow_below_mps
        found = np.full((len(places), len(bounds.quantile), 3), np.nan)
        rest = np.where(sog[slow] < STILL_MPS, STILL, SLOW)
        found[slow] = bounds.at_rest_m(adaptation.raised[rest], sog[slow], top[slow])
        known = [place.history.known() if place.history is not None else None for place in places]
        under_way = ~slow & np.isfinite(said).all(axis=1) & np.array([each is not None for each in known])
        way = np.flatnonzero(under_way)
        if len(way):
            told = [each for i in way.tolist() if (each := known[i]) is not None]
            features = np.array([each for each, _ in told])
            sorts, numbers = [sort for _, sort in told], (contacts[i].mmsi for i in way.tolist())
            raised = adaptation.raised_of(sorts, numbers)
            found[way] = bounds.spread_m(features, raised, sog[way], top[way])
        return found

    def _resize(self, mmsi: int, wanted: int) -> list[int]:
        slots = self._slots.setdefault(mmsi, [])
        while len(slots) < wanted:
            slots.append(self._table.new_slot())
            self._owner[slots[-1]] = mmsi
        while len(slots) > wanted:
            self._owner.pop(slots[-1])
            self._table.release(slots.pop())
        if not slots:
            del self._slots[mmsi]
        return slots
