"""From contact reports to tracks with bounds."""
