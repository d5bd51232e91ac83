"""Recording: records of a run's state, and the guards that check it."""
