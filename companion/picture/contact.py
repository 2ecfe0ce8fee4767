"""Everything known of one MMSI: where it may be, what it is, and from which sources."""

from collections import Counter
from dataclasses import dataclass, field

from companion.messages import ContactReport, Hull, Source, TargetKind
from companion.picture.association import Places
from companion.picture.echo import Evidence
from companion.picture.forecast import Craft
from companion.picture.identity import Station


@dataclass(slots=True, eq=False)
class Contact:
    """One MMSI.  Static data may come before or after the first position; the newest wins."""

    mmsi: int
    station: Station
    places: Places = field(default_factory=Places)
    echo: Evidence = field(default_factory=Evidence)
    heard_from: Counter[Source] = field(default_factory=Counter)
    kind: TargetKind = TargetKind.UNKNOWN
    hull: Hull | None = None
    ship_type: int | None = None
    name: str = ""

    def complete(self, report: ContactReport) -> bool:
        """Take what the report says of the ship itself; True when that was news.  Silence erases nothing."""
        before = self.kind, self.hull, self.ship_type, self.name
        if report.kind is not TargetKind.UNKNOWN:
            self.kind = report.kind
        self.hull = report.hull or self.hull
        self.ship_type = self.ship_type if report.ship_type is None else report.ship_type
        self.name = report.name or self.name
        return before != (self.kind, self.hull, self.ship_type, self.name)

    def craft(self) -> Craft:
        """What bounds are conditioned on."""
        length_m = self.hull.bow_m + self.hull.stern_m if self.hull else 0.0
        return Craft(self.mmsi, self.kind is TargetKind.CLASS_B, self.ship_type, length_m)
