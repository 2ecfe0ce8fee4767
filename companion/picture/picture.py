"""The contact picture: reports in, tracks with bounds out.  Nothing is forgotten by time.

    report -> cleaned -> station rule -> contact of its MMSI -> place (association, gate)
           -> own-ship evidence -> row of stated bounds in the table

A report touches one contact; `tracks` writes the rows of the contacts touched since, and of those
whose bounds change by age alone, and is otherwise the same object as before.
"""

from collections import Counter

import numpy as np

from companion import config
from companion.geodesy import LocalFrame
from companion.instant import NS_PER_S, Instant
from companion.messages import ContactReport, FloatArray, OwnPosition, Reason, Source, TargetKind, Tracks
from companion.picture import learned
from companion.picture.adaptation import Adaptation
from companion.picture.association import CONTINUED, Placement
from companion.picture.bounds import Assumptions
from companion.picture.capacity import Room
from companion.picture.contact import Contact
from companion.picture.echo import EchoWatch, Evidence
from companion.picture.forecast import History, Watch
from companion.picture.identity import Station, may_be_a_ship, station
from companion.picture.listening import Listening, Silence
from companion.picture.notes import Ledger, not_a_ship, of_counts
from companion.picture.own_sources import OwnSources
from companion.picture.plausibility import Gate
from companion.picture.reports import cleaned, has_position
from companion.picture.rows import Rows

MOST_CONTACTS = 5000
CLOCK_STEP_S = 60.0  # a log's clock that goes back by more was set, and not a report that came late
STEP_TOOK_S = 10.0
_CLOCK_STEP_NS = round(CLOCK_STEP_S * NS_PER_S)
_AIRCRAFT = TargetKind.AIRCRAFT
_BELIEVED = {Placement.FIRST, Placement.CONTINUED, Placement.CONFIRMED}


class Picture:
    """All ships heard of, one contact for each MMSI, whatever the source.

    `counts` has every report's fate under stable keys; `reports_heard` and `last_heard` count them all.
    Memory is bounded: with `MOST_CONTACTS` known, a new one takes the place of a contact without
    position, else of the one farthest from us if it is nearer itself, and is refused otherwise; both
    are counted and noted, for water with unknown ships in it is not clear.
    """

    def __init__(
        self,
        contacts: config.Contacts,
        most_contacts: int = MOST_CONTACTS,
        *,
        watch: Watch | None = None,
        surfaced_depth_m: float = 1.0,
    ) -> None:
        name = contacts.bounds_file
        bounds = learned.load(name, contacts.bounds_level) if name else None
        self._assumptions = Assumptions(contacts, bounds)
        self.adaptation = Adaptation(bounds) if bounds else None  # scores forecasts, with a bounds file
        self._watch: Watch | None = watch or self.adaptation
        self._gate = Gate(self._assumptions)
        self._echo = EchoWatch(contacts.own_mmsi)
        self.listening = Listening(surfaced_depth_m)
        self._silence = Silence(self.listening)
        self.own_sources = OwnSources()
        self._contacts: dict[int, Contact] = {}
        self._most_contacts = most_contacts
        self._touched: set[int] = set()  # rows to be written
        self._unjudged: set[int] = set()  # notes to be judged
        self._ledger = Ledger()
        self._rows = Rows(self._assumptions, self.adaptation)
        self._room = Room()
        self._frame: LocalFrame | None = None
        self.counts: Counter[str] = Counter()
        self.reports_heard = 0
        self.last_heard: Instant | None = None

    def __len__(self) -> int:
        """Contacts known, with or without a row in the tracks."""
        return len(self._contacts)

    def heard_from(self, mmsi: int) -> dict[Source, int]:
        """How many reports of a contact came from each source; empty when it is unknown."""
        contact = self._contacts.get(mmsi)
        return dict(contact.heard_from) if contact else {}

    def placed(self) -> set[int]:
        """The numbers of the contacts with a position, wherever they are."""
        return {mmsi for mmsi, contact in self._contacts.items() if contact.places.held}

    def places_deg(self) -> FloatArray:
        """(n, 2) latitude and longitude of every place where a contact may have been heard last."""
        newest = [place.report for c in self._contacts.values() for place in c.places.held]
        return np.array([(r.latitude_deg, r.longitude_deg) for r in newest], dtype=np.float64).reshape(-1, 2)

    def end(self, mmsi: int) -> bool:
        """The operator says that this contact is no more; False when it was not known."""
        if mmsi not in self._contacts:
            return False
        self._forget(mmsi)
        self.counts["picture.ended_by_operator"] += 1
        return True

    def observe_own(self, own: OwnPosition) -> None:
        """A position of our own platform, to know our echo by."""
        self.listening.observe_own(own)
        if self.own_sources.observe(own):
            self._echo.observe_own(own)

    def observe(self, report: ContactReport) -> None:
        """Take one report, from any source, in any order."""
        self.reports_heard += 1
        received, last = report.received_at, self.last_heard
        if last is None or received >= last:
            self.last_heard = received
        elif last - received > _CLOCK_STEP_NS:
            self._follow_clock(received - last)
            self.last_heard = received
        if report.kind is _AIRCRAFT:  # its number is of another kind than a ship's
            self.counts[not_a_ship(Station.AIRCRAFT)] += 1
            return
        report = cleaned(report, self.counts)
        mmsi = report.mmsi
        contact = self._contacts.get(mmsi) or self._admit(report)
        if contact is None:
            return
        self._unjudged.add(mmsi)
        if contact.complete(report):
            self._touched.add(mmsi)
        if not has_position(report):
            self.counts["picture.static"] += 1
            return
        self._echo.weigh(contact.echo, report)
        self._touched.add(mmsi)
        placement = self._place(contact, report)
        if self._watch is not None and placement in _BELIEVED and contact.places.newest is not None:
            place = contact.places.newest
            if place.history is None:
                place.history = History(len(self._watch.ages_s))
            place.history.take(report, contact.craft(), self._watch)

    def _place(self, contact: Contact, report: ContactReport) -> Placement:
        places = contact.places
        before = tuple(places.held) if len(places.held) > 1 else ()  # a single one stays
        placement = places.take(report, self._gate)
        if placement is CONTINUED:
            self.counts["picture.continued"] += 1
        else:
            self.counts[placement.value] += 1
        for gone in before:
            if gone not in places.held:
                self.counts["picture.refuted" if gone.suspect else "picture.place_given_up"] += 1
        return placement

    def tracks(self, now: Instant, frame: LocalFrame) -> Tracks:
        """All contacts that may be in the area, in MMSI order; the same object while nothing changed.

        An MMSI whose whereabouts are in doubt has several rows, one for each place.
        """
        if frame != self._frame:
            self._frame = frame
            self._touched.update(self._contacts)
        if now >= self._rows.next_change:
            due = self._rows.due(now)
            self._touched |= due
            self._unjudged |= due
        elif not self._touched:
            return self._rows.tracks()
        self._rows.write((self._contacts[mmsi] for mmsi in sorted(self._touched)), now, frame)
        self._touched.clear()
        return self._rows.tracks()

    def notes(self, now: Instant) -> list[Reason]:
        """What an operator should know, a bounded number of sentences."""
        for mmsi in self._unjudged:
            self._ledger.enter(self._contacts[mmsi], now)
        self._unjudged.clear()
        found = self.own_sources.doubts(now) + self._ledger.reasons()
        found += of_counts(self.counts, self._most_contacts)
        found += self._silence.notes(self._contacts.values(), self.last_heard, now)
        if self.adaptation is not None:
            found += self.adaptation.notes(now)
        return found

    def silent(self, now: Instant) -> list[int]:
        """The ships under way not heard of for a while in which we listened, in MMSI order."""
        return self._silence.silent(self._contacts.values(), now)

    def _follow_clock(self, step_ns: int) -> None:
        """The source's clock was set back: every instant known moves with it, and ages go on.

        How long that took nobody knows; `STEP_TOOK_S` are taken for it.
        """
        step_ns -= round(STEP_TOOK_S * NS_PER_S)
        self.counts["picture.clock_set_back"] += 1
        for contact in self._contacts.values():
            contact.echo = Evidence(genuine=contact.echo.genuine, confirmed=contact.echo.confirmed)
            contact.places.move_clock(step_ns)
        self._touched.update(self._contacts)
        self._unjudged.update(self._contacts)

    def _admit(self, report: ContactReport) -> Contact | None:
        """A contact for a number not known yet, unless it is no ship or there is no room."""
        sender = station(report.mmsi)
        if not may_be_a_ship(sender, report):
            self.counts[not_a_ship(sender)] += 1
            return None
        if len(self._contacts) >= self._most_contacts:
            gone = self._room.made_by(report, self._contacts.values(), self._echo.newest_place())
            if gone is None:
                self.counts["picture.refused_when_full"] += 1
                return None
            self.counts["picture.evicted_when_full"] += 1
            self._forget(gone)
        contact = self._contacts[report.mmsi] = Contact(report.mmsi, sender)
        return contact

    def _forget(self, mmsi: int) -> None:
        self._rows.remove(mmsi)
        self._touched.discard(mmsi)
        self._unjudged.discard(mmsi)
        self._ledger.strike(mmsi)
        del self._contacts[mmsi]
