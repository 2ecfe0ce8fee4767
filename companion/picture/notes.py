"""What an operator should know of the picture: a bounded list of sentences, from its state alone.

A code that begins with "note." informs; one that begins with "picture." is a doubt, and a decision
that rests on it is degraded.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

from companion.instant import Instant
from companion.messages import Reason
from companion.picture.contact import Contact
from companion.picture.identity import Station

_NAMED = 3  # so many numbers are spelt out, the rest is counted


@dataclass(frozen=True, slots=True)
class _Rule:
    code: str
    applies: Callable[[Contact, Instant], bool]
    text: str


def _is_doubted(contact: Contact, now: Instant) -> bool:
    echo = contact.echo
    return echo.doubted and not (echo.confirmed or echo.genuine or echo.hides(now))


_RULES = (
    _Rule(
        "picture.quarantined",
        lambda c, _: not c.places.shared and len(c.places.held) > 1,
        "implausible report, both places kept: {which}",
    ),
    _Rule(
        "picture.shared_number",
        lambda c, _: c.places.shared,
        "one number in two places, all kept: {which}",
    ),
    _Rule(
        "picture.echo_doubted",
        _is_doubted,
        "our echo? kept as a contact: {which}; set contacts.own_mmsi if it is us",
    ),
    _Rule(
        "note.echo",
        lambda c, _: c.echo.confirmed,
        "our own echo, no contact: {which}",
    ),
    _Rule(
        "note.survivor",
        lambda c, _: c.station is Station.SURVIVOR,
        "distress transmitter (SART, MOB or EPIRB): {which}",
    ),
    _Rule(
        "note.odd_number",
        lambda c, _: c.station not in {Station.SHIP, Station.SURVIVOR},
        "no ship's number, kept as contact: {which}",
    ),
    _Rule(
        "note.coarse_position",
        lambda c, _: bool(c.places.held) and not c.places.held[-1].report.accurate,
        "{count} contacts not flagged accurate: contacts.coarse_position_error_m holds",
    ),
    _Rule(
        "note.assumed_hull",
        lambda c, _: bool(c.places.held) and c.hull is None,
        "{count} contacts of unknown size: the default hull of their class holds",
    ),
)


class Ledger:
    """Which rule applies to which contact, kept up to date contact by contact."""

    def __init__(self) -> None:
        self._which: dict[str, set[int]] = {rule.code: set() for rule in _RULES}

    def enter(self, contact: Contact, now: Instant) -> None:
        """Judge a contact anew."""
        for rule in _RULES:
            which = self._which[rule.code]
            (which.add if rule.applies(contact, now) else which.discard)(contact.mmsi)

    def strike(self, mmsi: int) -> None:
        """A contact is known no more."""
        for which in self._which.values():
            which.discard(mmsi)

    def reasons(self) -> list[Reason]:
        """At most one sentence for each rule, doubts first."""
        found = []
        for rule in _RULES:
            which = self._which[rule.code]
            if which:
                named = ", ".join(str(mmsi) for mmsi in sorted(which)[:_NAMED])
                more = f" and {len(which) - _NAMED} more" if len(which) > _NAMED else ""
                found.append(Reason(rule.code, rule.text.format(which=named + more, count=len(which))))
        return found


_NOT_A_SHIP = {station: f"picture.not_a_ship.{station.name.lower()}" for station in Station}


def not_a_ship(sender: Station) -> str:
    """The key of `Picture.counts` for reports left out because of who sends them."""
    return _NOT_A_SHIP[sender]


def of_counts(counts: Counter[str], most_contacts: int) -> list[Reason]:
    """What the fate of the reports so far is worth telling."""
    found = []
    left_out = {s: counts[key] for s, key in _NOT_A_SHIP.items() if counts[key]}
    if left_out:
        listed = ", ".join(f"{count} from {who}" for who, count in left_out.items())
        found.append(Reason("note.not_ships", f"reports left out: {listed}"))
    lost = counts["picture.refused_when_full"] + counts["picture.evicted_when_full"]
    if lost:
        text = f"{most_contacts} contacts, the most held; far ones left out {lost} times"
        found.append(Reason("picture.full", text))
    if counts["picture.clock_set_back"]:
        times = counts["picture.clock_set_back"]
        text = f"the clock was set back {times} times; ages went on from there"
        found.append(Reason("note.clock_set_back", text))
    return found
