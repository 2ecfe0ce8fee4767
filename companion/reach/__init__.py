"""Obstacle models and the sets a ship can reach."""

from companion.reach.sets import ReachableSets, at, tube
from companion.reach.support import support_straight

__all__ = ["ReachableSets", "at", "support_straight", "tube"]
