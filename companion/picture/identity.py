"""What an MMSI says of its sender: ship, fixed station, aircraft, survivor, or nonsense.

ITU-R M.585 gives the number's first digits a meaning.  A transponder that was set up wrongly is
still bolted to a ship, so a number that means nothing stays a contact and is noted; only what
certainly is no ship on the water is left out.
"""

from enum import StrEnum

from companion.messages import ContactReport, TargetKind

HIGHEST_AIS_NUMBER = 2**30 - 1  # the field has 30 bits: no radio can send more
_FASTEST_SHIP_MPS = 35.0  # 68 knots


class Station(StrEnum):
    """Who sends under this number."""

    SHIP = "ship"  # MIDxxxxxx, and 98MIDxxxx (a craft of a mother ship)
    ODD = "odd number"  # 0, group calls (0MIDxxxxx), 8..., beyond nine digits: a ship set up wrongly
    SURVIVOR = "survivor"  # 970 SART, 972 man overboard, 974 EPIRB: afloat and drifting
    COAST = "base station"  # 00MIDxxxx
    AID = "aid to navigation"  # 99MIDxxxx
    AIRCRAFT = "aircraft"  # 111MIDxxx (search and rescue), and whatever ADS-B tells of
    IMPOSSIBLE = "impossible number"  # more than the 30 bits of the radio message


def station(mmsi: int) -> Station:
    """The rule of ITU-R M.585 for `mmsi`."""
    if not 0 <= mmsi <= HIGHEST_AIS_NUMBER:
        return Station.IMPOSSIBLE
    prefix = mmsi // 1_000_000
    if prefix in {970, 972, 974}:
        return Station.SURVIVOR
    if prefix == 111:
        return Station.AIRCRAFT
    if 990 <= prefix <= 999:
        return Station.AID
    if 200 <= prefix <= 799 or 980 <= prefix <= 989:
        return Station.SHIP
    return Station.COAST if 0 < mmsi < 10_000_000 else Station.ODD


def may_be_a_ship(sender: Station, report: ContactReport) -> bool:
    """Whether `report` must be kept as a contact.

    A fixed station that tells a speed, if only 0, or that sends a ship's message, is a ship under a wrong
    number: their own messages have none.  So is an aircraft that sends a ship's message at a ship's speed.
    """
    if sender is Station.IMPOSSIBLE:
        return False
    if sender is Station.AIRCRAFT:
        sails = report.sog_mps is None or report.sog_mps < _FASTEST_SHIP_MPS
        return sails and report.kind in {TargetKind.CLASS_A, TargetKind.CLASS_B}
    if sender in {Station.COAST, Station.AID}:
        return report.sog_mps is not None or report.kind is not TargetKind.UNKNOWN
    return True
