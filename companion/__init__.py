"""Cross ship traffic you cannot see: reachable sets, a learned repulsive field, and a guard."""
