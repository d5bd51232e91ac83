"""State of a run and its time step."""
