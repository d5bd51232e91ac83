"""Recording: what a run keeps of its state, and the guards that watch it."""
