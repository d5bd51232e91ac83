"""The changing data of a run and the time step."""
