"""From reachable sets to the velocity the vehicle should fly."""
