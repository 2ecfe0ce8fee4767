"""What ITU-R M.1371 says of AIS fields, whichever format carries them."""

from functools import lru_cache

from companion.messages import Hull

# A report without a time stamp is as old as reports with one are when they arrive: of the recorded
# ones (4231 of sound transponders) 98 % at most 3 s.
UNSTAMPED_AGE_ERROR_S = 3.0
HIGHEST_AIS_NUMBER = 2**30 - 1  # the field has 30 bits: no radio can send more
FASTEST_MPS = 102.25 * 1852 / 3600  # 1022 means "102.2 knots or more", 1023 "not available"
NAVIGATIONAL_STATUS_UNKNOWN = 15
CRAFT_OF_MOTHERSHIP = 98  # first two digits of the MMSI
_PADDING = bytes(0 if b in b"@\xff" else b for b in range(256))
_UNPRINTABLE = bytes(b for b in range(1, 256) if not 0x20 <= b < 0x7F and b != 0xFF)


def is_mmsi(number: int) -> bool:
    """What a radio can send.  0 and ten digits are transponders set up wrongly, on ships all the same."""
    return 0 <= number <= HIGHEST_AIS_NUMBER


def is_position(latitude_deg: float, longitude_deg: float) -> bool:
    """On the globe: 91 and 181 degrees say "not available"."""
    return -90.0 <= latitude_deg <= 90.0 and -180.0 <= longitude_deg <= 180.0


@lru_cache(maxsize=4096)
def text(raw: bytes) -> str | None:
    """A name, cut at the first padding character; None when nothing is left."""
    return raw.translate(_PADDING, _UNPRINTABLE).partition(b"\0")[0].decode("ascii").strip() or None


def hull(bow_m: float, stern_m: float, port_m: float, starboard_m: float) -> Hull | None:
    """A hull from the antenna's distances; None when there is no length or no beam.

    Bow and port both zero mean that only length and beam are known, not where the antenna is:
    the hull returned then holds the ship wherever the antenna may be.
    """
    if bow_m + stern_m <= 0 or port_m + starboard_m <= 0:
        return None
    if bow_m == 0 and port_m == 0:
        return Hull(stern_m, stern_m, starboard_m, starboard_m)
    return Hull(bow_m, stern_m, port_m, starboard_m)
