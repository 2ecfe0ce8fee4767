"""The paper's experiments and what goes beyond them, as campaigns of many trials: one command each."""
