"""Studies: many runs, one table, an exit status."""
