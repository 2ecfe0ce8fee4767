"""What an operator should know of the picture: a bounded list of sentences, from its state alone."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from companion.instant import Instant
from companion.messages import Reason
from companion.picture.contact import Contact
from companion.picture.identity import Station

_NAMED = 5  # so many numbers are spelt out, the rest is counted


@dataclass(frozen=True, slots=True)
class _Rule:
    code: str
    applies: Callable[[Contact, Instant], bool]
    text: str


_RULES = (
    _Rule(
        "picture.echo",
        lambda c, _: c.echo.confirmed,
        "our own ship's reports, no contact: MMSI {which}",
    ),
    _Rule(
        "picture.echo_doubted",
        lambda c, now: c.echo.doubted and not (c.echo.confirmed or c.echo.genuine or c.echo.hides(now)),
        "on our own place but not proved to be us, kept as a contact "
        "(set contacts.own_mmsi if it is us): MMSI {which}",
    ),
    _Rule(
        "picture.quarantined",
        lambda c, _: not c.places.shared and len(c.places.held) > 1,
        "a report outside what the ship can have done, both places kept: MMSI {which}",
    ),
    _Rule(
        "picture.shared_number",
        lambda c, _: c.places.shared,
        "two ships under one number, or one forged, all places kept: MMSI {which}",
    ),
    _Rule(
        "picture.survivor",
        lambda c, _: c.station is Station.SURVIVOR,
        "distress transmitter (SART, man overboard or EPIRB): MMSI {which}",
    ),
    _Rule(
        "picture.odd_number",
        lambda c, _: c.station not in {Station.SHIP, Station.SURVIVOR},
        "numbers that no ship should have, kept as contacts: MMSI {which}",
    ),
    _Rule(
        "picture.coarse",
        lambda c, _: bool(c.places.held) and not c.places.held[-1].report.accurate,
        "position not flagged accurate, taken with contacts.coarse_position_error_m: {count} contacts",
    ),
    _Rule(
        "picture.no_hull",
        lambda c, _: bool(c.places.held) and c.hull is None,
        "size not reported, taken with the configured one: {count} contacts",
    ),
)


def of_contacts(contacts: Iterable[Contact], now: Instant) -> list[Reason]:
    """At most one sentence for each rule, in the order of the rules."""
    listed = sorted(contacts, key=lambda c: c.mmsi)
    found = []
    for rule in _RULES:
        which = [c.mmsi for c in listed if rule.applies(c, now)]
        if which:
            named = ", ".join(str(mmsi) for mmsi in which[:_NAMED])
            more = f" and {len(which) - _NAMED} more" if len(which) > _NAMED else ""
            found.append(Reason(rule.code, rule.text.format(which=named + more, count=len(which))))
    return found
