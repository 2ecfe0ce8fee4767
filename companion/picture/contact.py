"""Everything known of one MMSI: where it may be, what it is, and from which sources."""

from dataclasses import dataclass, field

from companion.messages import ContactReport, Hull, Source, TargetKind
from companion.picture.association import Places
from companion.picture.echo import Evidence
from companion.picture.forecast import Craft
from companion.picture.identity import Station

_UNKNOWN = TargetKind.UNKNOWN
UNSET = 0  # of a transponder nobody gave its number


@dataclass(slots=True, eq=False)
class Contact:
    """One MMSI.  Static data may come before or after the first position; the newest wins."""

    mmsi: int
    station: Station
    places: Places = field(default_factory=Places)
    echo: Evidence = field(default_factory=Evidence)
    kind: TargetKind = TargetKind.UNKNOWN
    hull: Hull | None = None
    ship_type: int | None = None
    name: str = ""
    draught_m: float | None = None
    heard_from: dict[Source, int] = field(default_factory=dict)  # reports from each source
    _craft: Craft | None = None

    def complete(self, report: ContactReport) -> bool:
        """Take what the report says of the ship itself; True when that was news.  Silence erases nothing."""
        source = report.source
        self.heard_from[source] = self.heard_from.get(source, 0) + 1
        is_news = False
        if report.kind is not self.kind and report.kind is not _UNKNOWN:
            self.kind, is_news = report.kind, True
        if report.hull is not None and report.hull is not self.hull:
            told = _around(self.hull, report.hull) if self.is_shared and self.hull else report.hull
            is_news |= told != self.hull
            self.hull = told
        if report.ship_type is not None and report.ship_type != self.ship_type:
            self.ship_type, is_news = report.ship_type, True
        if report.name is not None and report.name != self.name:
            self.name, is_news = report.name, True
        if report.draught_m is not None and report.draught_m != self.draught_m:
            deepest_m = max(self.draught_m or 0.0, report.draught_m)
            self.draught_m, is_news = (deepest_m if self.is_shared else report.draught_m), True
        if is_news:
            self._craft = None
        return is_news

    @property
    def is_shared(self) -> bool:
        """Several ships under one number: seen at two places, or a number that was never set."""
        return self.places.shared or self.mmsi == UNSET

    def craft(self) -> Craft:
        """What bounds are conditioned on."""
        if self._craft is None:
            length_m = self.hull.bow_m + self.hull.stern_m if self.hull else 0.0
            self._craft = Craft(self.mmsi, self.kind is TargetKind.CLASS_B, self.ship_type, length_m)
        return self._craft


def _around(one: Hull, other: Hull) -> Hull:
    """The hull that holds both: nobody can say which of the ships told it."""
    return Hull(
        max(one.bow_m, other.bow_m),
        max(one.stern_m, other.stern_m),
        max(one.port_m, other.port_m),
        max(one.starboard_m, other.starboard_m),
    )
