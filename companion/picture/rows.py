"""The rows of the tracks: every place of every contact as numbers, told for many contacts at once.

A report costs little until somebody asks for the tracks; then the rows of the contacts touched since are
written with one pass of numpy over all of them.
"""

import math
from collections.abc import Iterable

import numpy as np

from companion.geodesy import LocalFrame
from companion.instant import Instant
from companion.messages import IntArray, Tracks
from companion.picture.adaptation import Adaptation
from companion.picture.area import ALWAYS, entries_ns
from companion.picture.association import Hypothesis
from companion.picture.bounds import Assumptions
from companion.picture.contact import Contact
from companion.picture.forecast import Craft
from companion.picture.forecaster import Forecaster
from companion.picture.said import Said
from companion.picture.table import NEVER, Block, Table


class Rows:
    """Which slots of the table belong to which contact, and what they say."""

    def __init__(self, assumptions: Assumptions, adaptation: Adaptation | None) -> None:
        self._assumptions = assumptions
        learned = assumptions.learned
        self._table = Table()
        self._slots: dict[int, list[int]] = {}  # of an MMSI's places, in the order of its places
        self._owner: dict[int, int] = {}  # slot -> mmsi
        # what a slot's ship is, as last told, and her extent and draught; the same until there is news of her
        self._crafts: list[Craft | None] = []
        self._extent_m = np.zeros((0, 5))
        self._forecaster = None if learned is None or adaptation is None else Forecaster(learned, adaptation)
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
            mine = self._slots.get(contact.mmsi)
            if mine is None or len(mine) != len(held):
                mine = self._resize(contact.mmsi, len(held))
            slots += mine
            places += held
            contacts += [contact] * len(held) if len(held) != 1 else (contact,)
        if places:
            self._describe(contacts, slots)
            at = np.array(slots)
            self._table.write(at, self._block(contacts, places, at, now, frame))
        self.next_change = self._table.next_change()

    def _describe(self, contacts: list[Contact], slots: list[int]) -> None:
        """Tell what the ships are, where that is new."""
        if len(self._crafts) < self._table.size:
            more = self._table.size - len(self._crafts)
            self._crafts += [None] * more
            self._extent_m = np.concatenate((self._extent_m, np.zeros((more, 5))))
        crafts = self._crafts
        for contact, slot in zip(contacts, slots, strict=True):
            craft = contact.craft()
            if crafts[slot] is not craft:
                crafts[slot] = craft
                hull = self._assumptions.extent(contact.hull, contact.kind)
                draught_m = math.nan if contact.draught_m is None else contact.draught_m
                self._extent_m[slot] = hull.bow_m, hull.stern_m, hull.port_m, hull.starboard_m, draught_m
                self._table.name(slot, contact.mmsi, contact.name)

    def _block(
        self,
        contacts: list[Contact],
        places: list[Hypothesis],
        slots: IntArray,
        now: Instant,
        frame: LocalFrame,
    ) -> Block:
        said = Said.of([place.motion.report for place in places])
        extent_m = self._extent_m[slots]
        learned_m = None
        if self._forecaster is not None:
            histories = [place.history for place in places]
            numbers = [contact.mmsi for contact in contacts]
            learned_m = self._forecaster.spread_m(said, numbers, slots, histories, self._assumptions)
        bounds, spread = self._assumptions.of(said, extent_m, learned_m)
        hull_m = np.maximum(bounds.bow_m, bounds.stern_m) + np.maximum(bounds.port_m, bounds.starboard_m)
        enters_at = entries_ns(
            (frame.latitude_deg, frame.longitude_deg),
            said.latitude_deg,
            said.longitude_deg,
            said.measured_at,
            hull_m + bounds.position_error_m,
            bounds.top_speed_mps,
        )
        shown = enters_at <= now
        seen_again = np.full(len(places), NEVER, dtype=np.int64)
        for i, contact in enumerate(contacts):
            echo = contact.echo
            if echo.confirmed or echo.hidden_until is not None:
                seen_again[i] = echo.hidden_until or NEVER
                shown[i] &= not echo.hides(now)
        north, east = frame.to_local_many(said.latitude_deg, said.longitude_deg)
        turns = np.stack((enters_at, seen_again))
        return Block(
            measured_at=said.measured_at,
            # a place beyond the horizon has no coordinates on the tangent plane, and needs none
            north_m=np.where(shown, north, 0.0),
            east_m=np.where(shown, east, 0.0),
            bounds=bounds,
            draught_m=extent_m[:, 4],
            spread_m=spread,
            shown=shown,
            changes_at=np.where(turns > now, turns, NEVER).min(axis=0),
        )

    def _resize(self, mmsi: int, wanted: int) -> list[int]:
        slots = self._slots.setdefault(mmsi, [])
        while len(slots) < wanted:
            slots.append(self._table.new_slot())
            self._owner[slots[-1]] = mmsi
        while len(slots) > wanted:
            self._owner.pop(slots[-1])
            self._crafts[slots[-1]] = None
            self._table.release(slots.pop())
        if not slots:
            del self._slots[mmsi]
        return slots
