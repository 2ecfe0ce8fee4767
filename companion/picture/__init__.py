"""From contact reports to tracks with bounds."""

from companion.picture.picture import Picture

__all__ = ["Picture"]
