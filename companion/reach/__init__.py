"""Obstacle models and the sets a ship can reach."""

from companion.reach.compiled import choose_kernel
from companion.reach.sets import ReachableSets, at, tube
from companion.reach.slices import Slices
from companion.reach.support import support_straight

__all__ = ["ReachableSets", "Slices", "at", "choose_kernel", "support_straight", "tube"]
