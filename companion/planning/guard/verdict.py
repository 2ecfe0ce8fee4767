"""What the guard says."""

from dataclasses import dataclass

from companion.messages import Reason

Velocity = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Verdict:
    """What the guard lets through: `velocity_ned_mps` is None while it is closed.

    `way_out`: a verified way out exists after this velocity.
    """

    velocity_ned_mps: Velocity | None
    changed: bool
    reasons: tuple[Reason, ...]
    way_out: bool = False
